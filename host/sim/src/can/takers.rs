//! Which slots take which identifier.

use codewheel_station::can::Filter;

const IDENTIFIERS: usize = 0x800;

/// For each of the 2048 standard identifiers the set of slots whose filters let it through, so
/// that a frame visits its takers and nobody else.
#[derive(Clone, Debug)]
pub(super) struct Takers {
    /// Words of 64 slots kept for each identifier.
    words: usize,
    table: Vec<u64>,
}

impl Takers {
    pub(super) fn new() -> Self {
        Self { words: 1, table: vec![0; IDENTIFIERS] }
    }

    /// Gives `slot` the identifiers that one of `filters` lets through, and no others.
    pub(super) fn set(&mut self, slot: usize, filters: &[Filter]) {
        let (word, mask) = (slot / 64, 1 << (slot % 64));
        if word >= self.words {
            self.widen(word + 1);
        }
        for (identifier, words) in (0_u16..).zip(self.table.chunks_exact_mut(self.words)) {
            if filters.iter().any(|filter| filter.accepts(identifier)) {
                words[word] |= mask;
            } else {
                words[word] &= !mask;
            }
        }
    }

    /// The takers of `identifier` among the slots 64·`word` … 64·`word` + 63, lowest bit first;
    /// `None` behind the last slot.
    pub(super) fn word(&self, identifier: u16, word: usize) -> Option<u64> {
        if word >= self.words {
            return None;
        }
        self.table.get(usize::from(identifier) * self.words + word).copied()
    }

    fn widen(&mut self, words: usize) {
        let mut table = vec![0; IDENTIFIERS * words];
        for (to, from) in table.chunks_exact_mut(words).zip(self.table.chunks_exact(self.words)) {
            to[..self.words].copy_from_slice(from);
        }
        (self.words, self.table) = (words, table);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_beyond_the_first_word_leaves_the_others_alone() {
        let mut takers = Takers::new();
        takers.set(3, &[Filter { mask: 0x7F8, value: 0x428 }]);
        takers.set(130, &[Filter::ALL]);
        takers.set(64, &[]);
        assert_eq!(takers.word(0x42D, 0), Some(1 << 3));
        assert_eq!(takers.word(0x42D, 1), Some(0));
        assert_eq!(takers.word(0x42D, 2), Some(1 << 2));
        assert_eq!(takers.word(0x430, 0), Some(0));
        assert_eq!(takers.word(0x7FF, 2), Some(1 << 2));
        assert_eq!(takers.word(0x7FF, 3), None);
        takers.set(3, &[]);
        assert_eq!(takers.word(0x42D, 0), Some(0));
    }
}
