//! Non-volatile memory that loses power in the middle of a write.

use codewheel_encoder::Slot;

/// Two slots of octets in RAM, overwritten in place from the first octet on, so that an interrupted
/// write leaves the new beginning before the old end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TornMemory {
    a: Vec<u8>,
    b: Vec<u8>,
}

impl TornMemory {
    /// Two empty slots.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// What `slot` holds; empty where nothing was ever written.
    #[must_use]
    pub fn read(&self, slot: Slot) -> &[u8] {
        match slot {
            Slot::A => &self.a,
            Slot::B => &self.b,
        }
    }

    /// Writes `octets` to `slot`. With `cut_after` the power fails after that many of them: what
    /// the slot held behind stays. A cut at or behind the end cuts nothing.
    pub fn write(&mut self, slot: Slot, octets: &[u8], cut_after: Option<usize>) {
        let held = match slot {
            Slot::A => &mut self.a,
            Slot::B => &mut self.b,
        };
        match cut_after.and_then(|count| octets.get(..count)) {
            Some(written) if written.len() < octets.len() => {
                let overwritten = written.len().min(held.len());
                held.splice(..overwritten, written.iter().copied());
            }
            _ => *held = octets.to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_write_leaves_the_new_beginning_before_the_old_end() {
        let mut memory = TornMemory::new();
        memory.write(Slot::A, b"old record", None);
        memory.write(Slot::A, b"NEW RECORD", Some(3));
        assert_eq!(memory.read(Slot::A), b"NEW record");
        assert!(memory.read(Slot::A.other()).is_empty());
    }

    #[test]
    fn every_cut_of_a_longer_or_shorter_write_is_a_mixture_of_both() {
        for (old, new) in [("abc", "ABCDE"), ("abcde", "ABC"), ("", "ABC")] {
            for cut in 0..=new.len() {
                let mut memory = TornMemory::new();
                memory.write(Slot::B, old.as_bytes(), None);
                memory.write(Slot::B, new.as_bytes(), Some(cut));
                let rest = if cut < new.len() { old.get(cut..).unwrap_or("") } else { "" };
                let expected = [&new[..cut], rest].concat();
                assert_eq!(memory.read(Slot::B), expected.as_bytes(), "{old} {new} {cut}");
            }
        }
    }
}
