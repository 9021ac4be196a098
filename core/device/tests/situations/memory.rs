//! Save, Restore, power cuts and damaged memories (encoder clause 4).

use codewheel_device::{Event, MemoryState};
use codewheel_encoder::Slot;
use codewheel_sim::memory::TornMemory;
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, Hand};

fn settings(bench: &mut Bench) -> [i64; 5] {
    [7, 8, 10, 91, 12].map(|attribute| bench.read(attribute))
}

#[test]
fn saved_settings_survive_the_power_and_unsaved_ones_do_not() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.turn_to(100_000);
    bench.write(7, 3_600);
    bench.write(8, 921_600);
    bench.write(10, 1_000);
    bench.asks("16 2F 01", "96");
    let saved = settings(&mut bench);
    bench.asks("10 2F 01 03 01", "90");
    bench.write(11, 77);
    let mut bench = bench.power_cycled();
    assert_eq!(settings(&mut bench), saved);
    assert_eq!((bench.read(3), bench.read(11)), (0, 1));
}

#[test]
fn save_works_at_class_level_and_takes_no_data() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 1_000);
    bench.asks("16 2F 00", "96");
    bench.asks("16 2F 01 00", "94 15 FF");
    bench.asks("16 2F 02", "94 16 FF");
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(7), 1_000);
}

#[test]
fn restore_brings_the_saved_settings_and_offset_back_and_executes_no_preset() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.turn_to(100_000);
    bench.write(10, 1_000);
    bench.asks("16 2F 01", "96");
    bench.write(7, 3_600);
    bench.turn_to(100_500);
    bench.asks("15 2F 01", "95");
    assert_eq!(settings(&mut bench)[..3], [8_192, 1 << 29, 1_000]);
    assert_eq!(bench.read(12), 1_500);
}

#[test]
fn restore_on_a_fresh_device_gives_the_defaults() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 3_600);
    bench.asks("15 2F 00", "95");
    assert_eq!(bench.read(7), 8_192);
}

#[test]
fn save_is_answered_only_when_the_memory_has_the_record_and_polls_go_on_meanwhile() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.serves_memory = false;
    assert_eq!(bench.ask("16 2F 01"), None);
    bench.wait(Duration::from_secs(4));
    bench.says("42D#", &["3C5#00000000"]);
    bench.asks("0E 2F 01 07", "94 10 FF");
    bench.serve_memory();
    assert_eq!(bench.collect(), ["42B#0A96"]);
}

#[test]
fn a_failed_write_and_a_silent_memory_are_answered_with_store_failed() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.serves_memory = false;
    bench.write(7, 3_600);
    assert_eq!(bench.ask("16 2F 01"), None);
    assert!(bench.device.keep(bench.now).is_some());
    bench.device.kept(bench.now, Err("worn out"));
    assert_eq!(bench.collect(), ["42B#0A9419FF"]);
    assert!(bench.events().contains(&Event::KeepFailed));
    // What was not kept is not saved: a restore gives the defaults.
    bench.asks("15 2F 01", "95");
    assert_eq!(bench.read(7), 8_192);
    assert_eq!(bench.ask("16 2F 01"), None);
    assert_eq!(bench.wait(Duration::from_nanos(4_999_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["42B#0A9419FF"]);
    assert_eq!(bench.wait(Duration::from_secs(60)), [""; 0]);
}

#[test]
fn the_produced_path_is_kept_at_once_without_an_unsaved_setting() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 3_600);
    bench.asks("4C 03 01 02", "CC");
    bench.asks("4B 03 01 02 0A", "CB 00");
    bench.asks("10 05 02 0E 20 04 24 02", "90");
    let mut bench = bench.power_cycled();
    bench.says("42D#", &["3C5#0000000000"]);
    assert_eq!(bench.read(7), 8_192);
}

#[test]
fn the_consistency_value_changes_with_what_is_kept_and_only_then() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    let value = |bench: &mut Bench| bench.ask("0E 01 01 09").expect("an answer");
    let fresh = value(&mut bench);
    bench.asks("16 2F 01", "96");
    assert_eq!(value(&mut bench), fresh);
    bench.write(7, 3_600);
    assert_eq!(value(&mut bench), fresh);
    bench.asks("16 2F 01", "96");
    let changed = value(&mut bench);
    assert_ne!(changed, fresh);
    let mut bench = bench.power_cycled();
    assert_eq!(value(&mut bench), changed);
}

#[test]
fn identity_status_tells_owned_and_configured() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("0E 01 01 05", "8E 0100");
    bench.write(7, 3_600);
    bench.asks("0E 01 01 05", "8E 0100");
    bench.asks("16 2F 01", "96");
    bench.asks("0E 01 01 05", "8E 0500");
}

#[test]
fn with_both_records_damaged_the_defaults_run_and_it_is_never_silent() {
    let mut memory = TornMemory::new();
    memory.write(Slot::A, &[0x55; 92], None);
    memory.write(Slot::B, &[0xAA; 92], None);
    let mut bench = Bench::power_up_with("amg11-d29", memory, Hand::default());
    assert!(bench.events().contains(&Event::MemoryDamaged));
    let mut bench = bench.allocated();
    assert_eq!(bench.device.snapshot(bench.now).memory, MemoryState::Damaged);
    bench.asks("0E 01 01 05", "8E 0101");
    bench.asks("15 2F 01", "94 18 FF");
    assert_eq!(bench.read(7), 8_192);
    bench.asks("16 2F 01", "96");
    bench.asks("0E 01 01 05", "8E 0100");
    bench.asks("15 2F 01", "95");
}

#[test]
fn a_record_of_another_product_counts_as_damaged() {
    let mut bench = Bench::power_up("hmg11-d29").allocated();
    bench.asks("16 2F 01", "96");
    let mut bench = Bench::power_up_with("amg11-d29", bench.memory, Hand::default());
    assert!(bench.events().contains(&Event::MemoryDamaged));
}

#[test]
fn a_save_cut_at_any_octet_leaves_the_old_or_the_new_settings() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 1_000);
    bench.asks("16 2F 01", "96");
    bench.write(7, 2_000);
    bench.serves_memory = false;
    assert_eq!(bench.ask("16 2F 01"), None);
    let kept = bench.device.keep(bench.now).expect("a record");
    let start = codewheel_encoder::choose(bench.memory.read(Slot::A), bench.memory.read(Slot::B));
    let (slot, sequence) = start.next();
    let octets = codewheel_encoder::encode(&kept, sequence);
    for cut in 0..=octets.len() {
        let mut memory = bench.memory.clone();
        memory.write(slot, &octets, Some(cut));
        let mut again = Bench::power_up_with("amg11-d29", memory, Hand::default()).allocated();
        let expected = if cut == octets.len() { 2_000 } else { 1_000 };
        assert_eq!(again.read(7), expected, "cut after {cut} octets");
    }
}

#[test]
fn where_the_turns_do_not_come_out_even_the_position_survives_a_crossing_without_power() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 1_000);
    bench.write(8, 1_000 * 100);
    bench.asks("16 2F 01", "96");
    let quarter = 1_u32 << 27;
    // Turn on past the raw zero, look now and then, and cut the power just before it.
    let mut code = 0_u32;
    for _ in 0..9 {
        code = code.wrapping_add(quarter / 2 - 1) & ((1 << 29) - 1);
        bench.turn_to(code);
        bench.collect();
    }
    let before = bench.read(12);
    let turned = 8_192_u32 * 3;
    let mut bench = {
        let model = bench.device.product().model;
        let hand = Hand { code: (code + turned) & ((1 << 29) - 1), ..Hand::default() };
        Bench::power_up_with(model, bench.memory, hand).allocated()
    };
    assert_eq!(bench.read(12), (before + 3_000) % 100_000);
}

#[test]
fn crossing_references_are_written_at_most_once_in_a_quarter_of_the_range() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 1_000);
    bench.write(8, 1_000 * 100);
    bench.asks("16 2F 01", "96");
    let before = bench.records;
    let mut code = 0_u32;
    // Three times round, 200 turns at a time.
    for _ in 0..3 * 65_536 / 200 {
        code = (code + 200 * 8_192) & ((1 << 29) - 1);
        bench.turn_to(code);
        bench.collect();
    }
    let written = bench.records - before;
    assert!((11..=12).contains(&written), "{written} writes in twelve quarters");
}

#[test]
fn an_identity_reset_restarts_the_device_with_what_is_saved() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 3_600);
    bench.asks("16 2F 01", "96");
    bench.write(7, 1_800);
    bench.asks("05 01 01", "85");
    assert_eq!(bench.device.server().master(), None);
    let check = bench.wait(Duration::from_secs(2));
    assert!(check.iter().all(|frame| frame.starts_with("42F#")), "{check:?}");
    let mut bench = bench.allocated();
    assert_eq!(bench.read(7), 3_600);
}

#[test]
fn an_identity_reset_to_the_defaults_keeps_only_serial_number_and_crossings() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 3_600);
    bench.asks("16 2F 01", "96");
    bench.asks("10 03 01 03 01", "90");
    bench.asks("05 01 01 01", "85");
    bench.wait(Duration::from_secs(2));
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(7), 8_192);
    bench.asks("0E 03 01 03", "8E 00");
    bench.asks("0E 01 01 06", "8E D2040000");
}

#[test]
fn a_device_with_a_pending_save_can_still_be_advanced_for_ever() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.serves_memory = false;
    assert_eq!(bench.ask("16 2F 01"), None);
    bench.wait(Duration::from_secs(100));
    assert_eq!(bench.device.deadline(), None);
}

#[test]
fn the_heartbeat_tells_a_fault_until_it_is_over() {
    let mut memory = TornMemory::new();
    memory.write(Slot::A, &[0x55; 92], None);
    memory.write(Slot::B, &[0xAA; 92], None);
    let mut bench = Bench::power_up_with("amg11-d29", memory, Hand::default()).allocated();
    bench.asks("10 01 01 0A 01", "90");
    let beat = bench.wait(Duration::from_secs(1));
    assert!(beat[0].starts_with("42B#05CD01000302"), "{beat:?}");
    bench.asks("16 2F 01", "96");
    let beat = bench.wait(Duration::from_secs(1));
    assert!(beat[0].starts_with("42B#05CD01000300"), "{beat:?}");
}

#[test]
fn a_save_into_no_memory_succeeds_and_ends_with_the_process() {
    // Without a memory the host says "kept" at once and keeps nothing.
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.serves_memory = false;
    bench.write(7, 1_000);
    assert_eq!(bench.ask("16 2F 01"), None);
    assert!(bench.device.keep(bench.now).is_some());
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    assert_eq!(bench.collect(), ["42B#0A96"]);
    bench.write(7, 500);
    bench.asks("15 2F 01", "95");
    assert_eq!(bench.read(7), 1_000);
    bench.serves_memory = true;
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(7), 8_192);
}
