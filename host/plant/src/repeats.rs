//! Events that come again and again: a master whose parameters are refused sends them fifty times
//! a second, and people need not read each of them.

use codewheel_station::{Duration, Instant};

/// So many equal events in a row are told one by one.
const TOLD: u32 = 3;
/// Events further apart than this are no row.
const ROW: Duration = Duration::from_secs(1);
/// How often a row that goes on is told.
const REMINDER: Duration = Duration::from_secs(10);
/// Different events remembered; more than take part in any row.
const REMEMBERED: usize = 8;

/// What has been told lately.
#[derive(Debug)]
pub(crate) struct Repeats<E> {
    /// The one that came last at the end.
    rows: Vec<Row<E>>,
}

#[derive(Debug)]
struct Row<E> {
    event: E,
    length: u32,
    last: Instant,
    told: Instant,
    untold: u64,
}

impl<E: Copy + PartialEq> Repeats<E> {
    pub(crate) const fn new() -> Self {
        Self { rows: Vec::new() }
    }

    /// How often an event is to be told to have come, now that it comes: once, or as often as it
    /// came since it was told last; `None`: it is not told now.
    pub(crate) fn tell(&mut self, at: Instant, event: E) -> Option<u64> {
        let known = self.rows.iter().position(|row| row.event == event);
        let row = known.map(|place| self.rows.remove(place));
        if self.rows.len() == REMEMBERED {
            self.rows.remove(0);
        }
        let mut row = row.unwrap_or(Row { event, length: 0, last: at, told: at, untold: 0 });
        if at.since(row.last) > ROW {
            row.length = 0;
        }
        row.last = at;
        row.length = row.length.saturating_add(1);
        let is_told = row.length <= TOLD || at.since(row.told) >= REMINDER;
        let count = if is_told {
            row.told = at;
            Some(std::mem::take(&mut row.untold) + 1)
        } else {
            row.untold += 1;
            None
        };
        self.rows.push(row);
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(repeats: &mut Repeats<char>, millis: u64, event: char) -> Option<u64> {
        repeats.tell(Instant::ZERO + Duration::from_millis(millis), event)
    }

    #[test]
    fn a_row_of_equal_events_is_told_three_times_and_then_counted() {
        let mut repeats = Repeats::new();
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for count in 0..600 {
            // Two events in turn are two rows.
            a.extend(told(&mut repeats, count * 20, 'a'));
            b.extend(told(&mut repeats, count * 20, 'b'));
        }
        assert_eq!(a, [1, 1, 1, 500]);
        assert_eq!(b, a);
    }

    #[test]
    fn what_comes_after_a_pause_is_told_with_what_was_left_out() {
        let mut repeats = Repeats::new();
        for count in 0..10 {
            told(&mut repeats, count, 'a');
        }
        assert_eq!(told(&mut repeats, 5_000, 'a'), Some(8));
        assert_eq!(told(&mut repeats, 5_001, 'a'), Some(1));
    }

    #[test]
    fn few_events_are_told_as_they_are() {
        let mut repeats = Repeats::new();
        for count in 0..100 {
            assert_eq!(told(&mut repeats, count * 1_500, 'a'), Some(1));
        }
    }
}
