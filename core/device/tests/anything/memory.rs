//! Any memory whatever, as octets: two slots, writes that are cut, bits that flip, and a device that
//! has to start from it.
//!
//! | octet | then | what happens |
//! |---|---|---|
//! | 00 | a record, [`any_record`] | it is written whole |
//! | 01 | octets u8, a record | its write is cut after so many octets |
//! | 02 | slot u8, length u8, octets | anything stands in the slot |
//! | 03 | slot u8, bit u16 | one bit of the slot flips |
//! | 04 | sequence u32, slot u8, a record | a record from elsewhere stands in the slot |

use codewheel_device::product::DEVICENET;
use codewheel_device::{DeviceNetEncoder, Factory, MemoryState, Switches};
use codewheel_encoder::{
    Damage, Kept, RECORD_OCTETS, Sample, Sensor, Slot, Start, choose, decode, encode,
};
use codewheel_sim::memory::TornMemory;
use codewheel_station::can::BitRate;
use codewheel_station::{Instant, Reader};

use crate::any_record::any_record;

struct Still;

impl Sensor for Still {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: 4_711, ..Sample::default() }
    }
    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

/// Does what `octets` say and fails where a record is lost, made up or fatal.
pub(crate) fn body(octets: &[u8]) {
    let mut reader = Reader::new(octets);
    let product = &DEVICENET[usize::from(reader.u8().unwrap_or_default()) % DEVICENET.len()];
    let mut memory = TornMemory::new();
    let mut written = Vec::new();
    while let Ok(operation) = reader.u8() {
        let before = start(&memory);
        match operation {
            0 => {
                let kept = any_record(&mut reader, product.fingerprint);
                write(&mut memory, &kept, RECORD_OCTETS);
                written.push(kept);
                let Start::Kept { kept: now, .. } = start(&memory) else { panic!("not kept") };
                assert_eq!(now, kept);
            }
            1 => {
                let cut = usize::from(reader.u8().unwrap_or_default());
                let kept = any_record(&mut reader, product.fingerprint);
                write(&mut memory, &kept, cut);
                old_or_new(&before, &start(&memory), &kept, &written);
                written.push(kept);
            }
            2 => {
                let slot = slot(&mut reader);
                let length = usize::from(reader.u8().unwrap_or_default());
                let octets = (0..=length).rev().find_map(|length| reader.octets(length).ok());
                memory.write(slot, octets.unwrap_or_default(), None);
            }
            3 => {
                let slot = slot(&mut reader);
                let bit = usize::from(reader.u16_le().unwrap_or_default());
                let mut octets = memory.read(slot).to_vec();
                if let Some(octet) = octets.get_mut(bit / 8) {
                    *octet ^= 1 << (bit % 8);
                }
                memory.write(slot, &octets, None);
                one_bit_is_found(&before, slot, &memory, bit);
            }
            4 => {
                let sequence = reader.u32_le().unwrap_or_default();
                let slot = slot(&mut reader);
                let kept = any_record(&mut reader, product.fingerprint);
                let octets = encode(&kept, sequence);
                assert_eq!(decode(&octets), Ok((kept, sequence)));
                memory.write(slot, &octets, None);
                written.push(kept);
            }
            _ => {}
        }
        for slot in [Slot::A, Slot::B] {
            judge_slot(memory.read(slot));
        }
        let start = start(&memory);
        let switches = Switches::set_to(5, BitRate::Kbit125);
        let factory = Factory::with_serial(7);
        let mut device =
            DeviceNetEncoder::power_up(Instant::ZERO, product, factory, switches, &start, Still);
        judge_start(&mut device, &start);
    }
}

fn slot(reader: &mut Reader<'_>) -> Slot {
    if reader.u8().unwrap_or_default() & 1 == 0 { Slot::A } else { Slot::B }
}

fn start(memory: &TornMemory) -> Start {
    choose(memory.read(Slot::A), memory.read(Slot::B))
}

fn write(memory: &mut TornMemory, kept: &Kept, cut: usize) {
    let (slot, sequence) = start(memory).next();
    memory.write(slot, &encode(kept, sequence), Some(cut));
}

/// A write that is cut leaves what was in force before, or the new record. Where the slot it goes to
/// had a damaged head, the new head may also have healed the record that was in there.
fn old_or_new(before: &Start, after: &Start, new: &Kept, written: &[Kept]) {
    match (before, after) {
        (_, Start::Kept { kept, .. }) if kept == new => {}
        (Start::Kept { kept: old, .. }, Start::Kept { kept, .. }) if kept == old => {}
        (
            Start::Kept { other_damaged: true, .. }
            | Start::Fresh { interrupted: true }
            | Start::Damaged,
            Start::Kept { kept, .. },
        ) => assert!(written.contains(kept), "a record from nowhere"),
        (Start::Kept { .. }, _) | (_, Start::Kept { .. }) => {
            panic!("neither old nor new: {before:?} became {after:?}")
        }
        _ => {}
    }
}

/// One flipped bit spoils a whole record and leaves the other slot alone.
fn one_bit_is_found(before: &Start, flipped: Slot, memory: &TornMemory, bit: usize) {
    let whole = matches!(before, Start::Kept { slot, .. } if *slot == flipped);
    if whole && bit / 8 < RECORD_OCTETS {
        assert!(decode(memory.read(flipped)).is_err(), "bit {bit} went unnoticed");
    }
}

fn judge_slot(octets: &[u8]) {
    match decode(octets) {
        Ok((kept, sequence)) => assert_eq!(encode(&kept, sequence), octets[..RECORD_OCTETS]),
        Err(Damage::Short) => assert!(octets.len() < usize::from(u16::MAX)),
        Err(damage) => assert!(!damage.to_string().is_empty()),
    }
}

fn judge_start(device: &mut DeviceNetEncoder<Still>, start: &Start) {
    let model = device.product().encoder;
    let snapshot = device.snapshot(Instant::ZERO);
    assert_eq!(snapshot.in_force.check(model), Ok(()));
    assert!(snapshot.position < snapshot.in_force.settings.total_in_force(model));
    match (start, snapshot.memory) {
        (Start::Kept { kept, .. }, MemoryState::Good) => {
            assert_eq!(snapshot.saved, kept.saved);
            assert_eq!(snapshot.in_force, kept.saved);
        }
        // A record that cannot be run with, or one that says itself that both were damaged.
        (Start::Kept { .. } | Start::Damaged, MemoryState::Damaged) => {
            let told = std::iter::from_fn(|| device.take_event())
                .any(|(_, event)| event == codewheel_device::Event::MemoryDamaged);
            assert!(told, "the damage was passed over in silence");
        }
        (Start::Fresh { .. }, MemoryState::Fresh) => {}
        (start, memory) => panic!("{memory:?} from {start:?}"),
    }
}
