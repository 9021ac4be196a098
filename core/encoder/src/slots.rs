//! Two slots, so that an interrupted write leaves the old record or the new one, whole.
//!
//! A write always goes to the slot that is not in use. Whatever is left in it by a power cut, the
//! other one still holds what was kept before.

use crate::{Damage, Kept, decode};

/// One of the two places a record lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Slot {
    /// The first.
    A,
    /// The second.
    B,
}

impl Slot {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// What the two slots hold at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Nothing was ever kept: take the defaults.
    Fresh {
        /// The very first write was interrupted; what it was to keep is lost, and nothing else.
        interrupted: bool,
    },
    /// The newer of the whole records.
    Kept {
        /// What it keeps.
        kept: Kept,
        /// Its sequence.
        sequence: u32,
        /// Where it lies.
        slot: Slot,
        /// The other slot holds something that is no record: a write was interrupted, or the
        /// memory is worn.
        other_damaged: bool,
    },
    /// Something was kept and no record is whole: take the defaults, and never in silence.
    Damaged,
}

impl Start {
    /// Where the next record goes, and its sequence: the slot not in use, one further.
    #[must_use]
    pub const fn next(&self) -> (Slot, u32) {
        match self {
            Self::Fresh { .. } | Self::Damaged => (Slot::A, 1),
            Self::Kept { sequence, slot, .. } => (slot.other(), sequence.wrapping_add(1)),
        }
    }
}

/// What a device starts with, from the octets of slots A and B; call it once at power-up.
///
/// A slot is blank where it is empty, all FFh (erased EEPROM or flash) or all 00h. Of two whole
/// records the one with the higher sequence is taken, wrapping. Decision: one blank slot and one
/// that is no record are an interrupted very first write, unless it is a whole record of another
/// version, which is reported as damage.
#[must_use]
pub fn choose(a: &[u8], b: &[u8]) -> Start {
    let (first, second) = (Content::of(a), Content::of(b));
    let start = |content: &Whole, slot, other: &Content| Start::Kept {
        kept: content.0,
        sequence: content.1,
        slot,
        other_damaged: matches!(other, Content::Damaged(_)),
    };
    match (&first, &second) {
        (Content::Whole(whole_a), Content::Whole(whole_b)) => {
            if is_newer(whole_b.1, whole_a.1) {
                start(whole_b, Slot::B, &first)
            } else {
                start(whole_a, Slot::A, &second)
            }
        }
        (Content::Whole(whole), other) => start(whole, Slot::A, other),
        (other, Content::Whole(whole)) => start(whole, Slot::B, other),
        (Content::Blank, Content::Blank) => Start::Fresh { interrupted: false },
        (Content::Blank, Content::Damaged(damage)) | (Content::Damaged(damage), Content::Blank) => {
            match damage {
                Damage::Version(_) => Start::Damaged,
                _ => Start::Fresh { interrupted: true },
            }
        }
        (Content::Damaged(_), Content::Damaged(_)) => Start::Damaged,
    }
}

type Whole = (Kept, u32);

enum Content {
    Blank,
    Whole(Whole),
    Damaged(Damage),
}

impl Content {
    fn of(octets: &[u8]) -> Self {
        let all = |value| octets.iter().all(|octet| *octet == value);
        if all(0xFF) || all(0x00) {
            return Self::Blank;
        }
        match decode(octets) {
            Ok(whole) => Self::Whole(whole),
            Err(damage) => Self::Damaged(damage),
        }
    }
}

/// Whether sequence `a` comes after `b`, less than half the numbers away.
const fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b).cast_signed() > 0
}
