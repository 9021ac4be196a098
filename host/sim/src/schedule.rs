//! The deadlines of all slots, least first.

/// A tournament of deadlines: the least is read in one step and one is changed in log₂ n steps.
#[derive(Clone, Debug)]
pub(crate) struct Schedule {
    /// The root at 1, the children of `i` at `2i` and `2i + 1`, the slots in the second half.
    tree: Vec<u64>,
}

/// The deadline of a slot that waits for nothing but input.
pub(crate) const NEVER: u64 = u64::MAX;

impl Schedule {
    pub(crate) fn new() -> Self {
        Self { tree: vec![NEVER; 2] }
    }

    fn leaves(&self) -> usize {
        self.tree.len() / 2
    }

    /// Sets the deadline of `slot`, which may be new.
    pub(crate) fn set(&mut self, slot: usize, deadline: u64) {
        if slot >= self.leaves() {
            self.grow(slot + 1);
        }
        let mut index = self.leaves() + slot;
        self.tree[index] = deadline;
        while index > 1 {
            let least = self.tree[index].min(self.tree[index ^ 1]);
            index /= 2;
            if self.tree[index] == least {
                return;
            }
            self.tree[index] = least;
        }
    }

    /// The least deadline, [`NEVER`] where there is none.
    pub(crate) fn earliest(&self) -> u64 {
        self.tree[1]
    }

    /// The slot whose deadline is not after `now`: the least deadline first, then the lowest slot.
    pub(crate) fn due(&self, now: u64) -> Option<usize> {
        let earliest = self.earliest();
        if earliest > now || earliest == NEVER {
            return None;
        }
        let mut index = 1;
        while index < self.leaves() {
            index *= 2;
            index += usize::from(self.tree[index] != earliest);
        }
        Some(index - self.leaves())
    }

    fn grow(&mut self, slots: usize) {
        let old = self.tree.split_off(self.leaves());
        self.tree = vec![NEVER; 2 * slots.next_power_of_two()];
        for (slot, deadline) in old.into_iter().enumerate() {
            self.set(slot, deadline);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tournament_agrees_with_a_plain_list() {
        let mut random = fastrand::Rng::with_seed(7);
        let mut schedule = Schedule::new();
        let mut list = vec![NEVER; 100];
        for _ in 0..5_000 {
            let slot = random.usize(..100);
            let deadline = if random.bool() { random.u64(..50) } else { NEVER };
            schedule.set(slot, deadline);
            list[slot] = deadline;
            let least = *list.iter().min().unwrap();
            assert_eq!(schedule.earliest(), least);
            let expected = list.iter().position(|&at| at == least && at <= 20);
            assert_eq!(schedule.due(20), expected);
        }
    }

    #[test]
    fn what_never_falls_due_is_not_due_at_the_end_of_time() {
        let mut schedule = Schedule::new();
        schedule.set(2, NEVER);
        assert_eq!(schedule.due(u64::MAX), None);
    }
}
