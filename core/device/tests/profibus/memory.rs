//! What survives without power, and how often it is written (encoder clauses 2 and 4).

use codewheel_device::{Event, MemoryState};
use codewheel_encoder::{RECORD_OCTETS, Slot, encode};
use codewheel_sim::memory::TornMemory;
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, EXAMPLE, FULL_RANGE, Hand, start};

/// 3600 steps in 256 turns, position 100 at code 8192.
fn preset() -> Bench {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.turn_to(8_192);
    bench.position("00000000");
    assert_eq!(bench.position("80000064"), 100);
    bench
}

#[test]
fn a_preset_is_written_at_once_and_survives_the_power() {
    let bench = preset();
    assert_eq!(bench.writes(), 1);
    assert_eq!(bench.snapshot().memory, MemoryState::Good);
    let mut bench = bench.power_cycled(16_384).running(EXAMPLE);
    assert_eq!(bench.position("00000000"), 100 + 3_600);
    assert_eq!(bench.writes(), 1, "a start writes nothing");
}

#[test]
fn the_offset_waits_for_the_parameters_it_was_made_under() {
    let mut bench = preset().power_cycled(8_192);
    for other in ["00", FULL_RANGE, "0B 00000E10 000E1000"] {
        bench.brings_up(other, 0xF1);
        assert_eq!(bench.device.encoder().offset(), 0, "{other}");
    }
    let mut bench = bench.power_cycled(8_192).running(EXAMPLE);
    assert_eq!(bench.position("00000000"), 100);
    assert_eq!(bench.writes(), 1);
}

#[test]
fn only_a_new_preset_overwrites_the_offset() {
    let mut bench = preset();
    bench.brings_up(FULL_RANGE, 0xF1);
    bench.position("00000000");
    assert_eq!(bench.position("80000007"), 7);
    assert_eq!(bench.writes(), 2);
    let mut bench = bench.power_cycled(8_192).running(EXAMPLE);
    assert_eq!(bench.position("00000000"), 3_600, "the first offset is gone");
    bench.brings_up(FULL_RANGE, 0xF1);
    assert_eq!(bench.position("00000000"), 7);
}

#[test]
fn every_preset_that_changes_the_offset_is_a_write_and_one_that_does_not_is_none() {
    let mut bench = preset();
    for (outputs, writes) in
        [("80000064", 1), ("80000065", 2), ("80000064", 3), ("80000064", 3), ("FFFFFFFF", 3)]
    {
        bench.position("00000000");
        bench.exchanges(outputs);
        assert_eq!(bench.writes(), writes, "{outputs}");
    }
}

#[test]
fn a_memory_that_fails_is_tried_again_after_a_minute() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.serves_memory = false;
    bench.turn_to(8_192);
    bench.position("00000000");
    assert_eq!(bench.position("80000064"), 100);
    assert!(bench.device.keep_due(bench.now));
    assert!(bench.device.keep(bench.now).is_some());
    assert!(!bench.device.keep_due(bench.now), "one record at a time");
    bench.device.kept(bench.now, Err("worn out"));
    assert!(bench.events().contains(&Event::KeepFailed));
    assert_eq!((bench.writes(), bench.snapshot().memory), (0, MemoryState::Fresh));
    // Meanwhile the offset is in force.
    assert_eq!(bench.position("00000000"), 100);
    bench.wait(Duration::from_secs(59));
    assert!(!bench.device.keep_due(bench.now));
    bench.wait(Duration::from_secs(1));
    assert!(bench.device.keep_due(bench.now));
    bench.serve_memory();
    assert_eq!(bench.writes(), 1);
    bench.serves_memory = true;
    let mut bench = bench.power_cycled(8_192).running(EXAMPLE);
    assert_eq!(bench.position("00000000"), 100);
}

#[test]
fn a_preset_during_a_write_is_written_after_it() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.serves_memory = false;
    bench.turn_to(8_192);
    bench.position("00000000");
    bench.position("80000064");
    let first = bench.device.keep(bench.now).expect("the first preset");
    bench.position("00000000");
    bench.position("80000065");
    assert!(bench.device.keep(bench.now).is_none());
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    let second = bench.device.keep(bench.now).expect("the second preset");
    assert_eq!((first.saved.preset, second.saved.preset), (0x64, 0x65));
    assert_eq!((first.writes, second.writes), (1, 2));
}

#[test]
fn both_slots_bad_is_told_until_a_preset_has_been_kept() {
    let mut memory = TornMemory::new();
    memory.write(Slot::A, b"nonsense", None);
    memory.write(Slot::B, b"nonsense", None);
    let mut bench = Bench::power_up_with("amg11-p29", memory, Hand::default());
    assert!(bench.events().contains(&Event::MemoryDamaged));
    // Settings that need their turns kept are written, and end nothing.
    bench.brings_up("0A 00000E10 00057E40", 0xF1);
    assert_eq!((bench.writes(), bench.snapshot().memory), (1, MemoryState::Damaged));
    let mut bench = bench.power_cycled(0);
    assert_eq!(bench.snapshot().memory, MemoryState::Damaged);
    assert!(bench.events().contains(&Event::MemoryDamaged));
    bench.brings_up(FULL_RANGE, 0xF1);
    bench.position("00000000");
    // A preset that finds its value in place is written all the same.
    assert_eq!(bench.position("80000000"), 0);
    assert_eq!((bench.writes(), bench.snapshot().memory), (2, MemoryState::Good));
    let bench = bench.power_cycled(0);
    assert_eq!(bench.snapshot().memory, MemoryState::Good);
}

#[test]
fn a_preset_whose_record_failed_ends_the_mark_when_it_is_kept_after_all() {
    let mut memory = TornMemory::new();
    memory.write(Slot::A, b"nonsense", None);
    memory.write(Slot::B, b"nonsense", None);
    let bench = Bench::power_up_with("amg11-p29", memory, Hand::default());
    let mut bench = bench.running(EXAMPLE);
    bench.serves_memory = false;
    bench.position("00000000");
    bench.position("80000005");
    assert!(bench.device.keep(bench.now).is_some());
    bench.device.kept(bench.now, Err("worn out"));
    assert_eq!(bench.snapshot().memory, MemoryState::Damaged);
    bench.wait(Duration::from_secs(60));
    bench.serve_memory();
    assert_eq!(bench.snapshot().memory, MemoryState::Good);
    assert_eq!(bench.power_cycled(0).snapshot().memory, MemoryState::Good);
}

#[test]
fn a_record_of_another_product_counts_as_damaged() {
    let bench = preset();
    let mut bench = Bench::power_up_with("hmg11-p29", bench.memory, Hand::default());
    assert_eq!(bench.snapshot().memory, MemoryState::Damaged);
    bench.brings_up(EXAMPLE, 0xF1);
    assert_eq!(bench.device.encoder().offset(), 0);
}

#[test]
fn a_power_cycle_starts_with_what_is_in_memory_or_on_its_way_there() {
    let mut bench = preset();
    bench.serves_memory = false;
    bench.position("00000000");
    assert_eq!(bench.position("80000065"), 101);
    let under_way = bench.device.keep(bench.now).is_some();
    assert!(under_way);
    bench.position("00000000");
    assert_eq!(bench.position("80000066"), 102);
    bench.device.power_cycle(bench.now);
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    assert!(bench.device.keep(bench.now).is_none(), "the third preset is lost");
    bench.brings_up(EXAMPLE, 0xF1);
    assert_eq!(bench.position("00000000"), 101);
    assert_eq!(bench.snapshot().saved.preset, 101);
}

#[test]
fn a_new_preset_after_a_failed_write_is_written_at_once() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.serves_memory = false;
    bench.position("00000000");
    bench.position("80000064");
    bench.device.keep(bench.now).expect("a record");
    bench.device.kept(bench.now, Err("busy"));
    bench.position("00000000");
    bench.position("80000065");
    assert!(bench.device.keep_due(bench.now), "the second preset waits for the retry of the first");
}

#[test]
fn of_two_presets_while_the_memory_is_busy_both_are_written_in_turn() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.serves_memory = false;
    bench.position("00000000");
    bench.position("80000064");
    let first = bench.device.keep(bench.now).expect("first");
    bench.brings_up(FULL_RANGE, 0xF1);
    bench.position("00000000");
    bench.position("80000009");
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    let second = bench.device.keep(bench.now).expect("second");
    assert_eq!((first.saved.preset, second.saved.preset), (0x64, 9));
    assert_ne!(first.saved.settings, second.saved.settings);
}

#[test]
fn a_failed_write_wakes_the_host() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.serves_memory = false;
    bench.position("00000000");
    bench.position("80000064");
    bench.device.keep(bench.now).expect("a record");
    bench.device.kept(bench.now, Err("busy"));
    bench.wait(Duration::from_secs(10));
    let deadline = bench.device.deadline().expect("a retry");
    assert!(deadline > bench.now && deadline.since(bench.now) <= Duration::from_secs(60));
}

#[test]
fn a_preset_that_goes_back_while_the_memory_is_busy_is_what_is_kept() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.serves_memory = false;
    bench.position("00000000");
    bench.position("80000064");
    bench.serve_memory();
    bench.position("00000000");
    bench.position("80000065");
    let under_way = bench.device.keep(bench.now).expect("101");
    bench.position("00000000");
    bench.position("80000064");
    let (slot, sequence) = start(&bench.memory).next();
    let octets: [u8; RECORD_OCTETS] = encode(&under_way, sequence);
    bench.memory.write(slot, &octets, None);
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    bench.serve_memory();
    let mut bench = bench.power_cycled(0).running(EXAMPLE);
    assert_eq!(bench.position("00000000"), 100);
}
