//! Power cut at every octet of every write: the device starts with the old record or the new one.

mod common;

use codewheel_encoder::{Kept, RECORD_OCTETS, Slot, Start, choose, encode};
use common::{cases, kept};
use proptest::prelude::*;

/// How a memory takes a write.
#[derive(Clone, Copy, Debug)]
enum Memory {
    /// Octet by octet over the old content, as an EEPROM does.
    OverOld,
    /// After the whole slot was erased, as flash does.
    Erased,
}

const SLOT_OCTETS: usize = 128;

/// The slot after `written` octets of `record`, and `garbage` in the octet after them, if any.
fn torn(
    memory: Memory,
    old: &[u8],
    record: &[u8; RECORD_OCTETS],
    written: usize,
    garbage: Option<u8>,
) -> Vec<u8> {
    let mut slot = match memory {
        Memory::OverOld => old.to_vec(),
        Memory::Erased => vec![0xFF; SLOT_OCTETS],
    };
    slot[..written].copy_from_slice(&record[..written]);
    if let (Some(garbage), Some(octet)) = (garbage, slot.get_mut(written)) {
        *octet = garbage;
    }
    slot
}

fn kept_of(start: &Start) -> Option<Kept> {
    match start {
        Start::Kept { kept, .. } => Some(*kept),
        Start::Fresh { .. } | Start::Damaged => None,
    }
}

proptest! {
    #![proptest_config(cases(128))]

    #[test]
    fn a_power_cut_at_any_octet_of_any_write_leaves_the_old_record_or_the_new_one(
        saves in prop::collection::vec(
            (kept(), any::<u8>(), prop::option::of(0..RECORD_OCTETS)),
            1..8,
        ),
        first_sequence in prop_oneof![Just(1), Just(u32::MAX - 2), any::<u32>()],
        memory in prop_oneof![Just(Memory::OverOld), Just(Memory::Erased)],
        blank in prop_oneof![Just(0xFF), Just(0)],
    ) {
        let mut slots = [vec![blank; SLOT_OCTETS], vec![blank; SLOT_OCTETS]];
        let mut old = None;
        for (new, garbage, cut) in saves {
            let (slot, sequence) = choose(&slots[0], &slots[1]).next();
            let sequence = if old.is_none() { first_sequence } else { sequence };
            let record = encode(&new, sequence);
            let place = usize::from(slot == Slot::B);
            let after = |written, garbage| {
                let mut after = slots.clone();
                after[place] = torn(memory, &slots[place], &record, written, garbage);
                after
            };
            for written in 0..=RECORD_OCTETS {
                for garbage in [None, Some(garbage), Some(0), Some(0xFF)] {
                    let [a, b] = after(written, garbage);
                    let found = choose(&a, &b);
                    if written == RECORD_OCTETS {
                        prop_assert_eq!(kept_of(&found), Some(new));
                    } else if [&a, &b][place].starts_with(&record) {
                        // The garbage happened to be the octet still missing.
                        prop_assert_eq!(kept_of(&found), Some(new));
                    } else {
                        prop_assert_eq!(kept_of(&found), old);
                        prop_assert_ne!(found, Start::Damaged);
                        prop_assert_eq!(found.next().0, slot, "the next write spares the good one");
                    }
                }
            }
            // Life goes on, with the new record or with the torn one.
            slots = after(cut.unwrap_or(RECORD_OCTETS), None);
            // A record whose last octets happened to lie there already is whole, however early its
            // write was cut.
            old = if slots[place].starts_with(&record) { Some(new) } else { old };
            prop_assert_eq!(kept_of(&choose(&slots[0], &slots[1])), old);
        }
    }
}
