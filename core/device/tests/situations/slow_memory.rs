//! A memory that is slow, or fails (encoder clause 4).

use codewheel_device::{Event, MemoryState};
use codewheel_encoder::Slot;
use codewheel_sim::memory::TornMemory;
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, Hand};

const SAVE: &str = "16 2F 01";

/// A device whose memory does nothing by itself.
fn slow() -> Bench {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.serves_memory = false;
    bench
}

fn fetch(bench: &mut Bench) -> codewheel_encoder::Kept {
    bench.device.keep(bench.now).expect("a record to write")
}

fn written(bench: &mut Bench) -> Vec<String> {
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    bench.collect()
}

fn failed(bench: &mut Bench) -> Vec<String> {
    bench.device.kept(bench.now, Err("worn out"));
    bench.collect()
}

fn writes(bench: &Bench) -> u32 {
    bench.device.snapshot(bench.now).writes
}

#[test]
fn a_save_is_answered_by_its_own_record_and_by_no_earlier_one() {
    let mut bench = slow();
    bench.write(7, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    let first = fetch(&mut bench);
    assert_eq!(first.saved.settings.steps_per_turn, 1_000);
    assert_eq!(bench.wait(Duration::from_secs(5)), ["42B#0A9419FF"]);
    // The first record is still being written: a second Save has to be asked for again.
    bench.write(7, 2_000);
    bench.asks(SAVE, "94 10 FF");
    assert!(bench.device.keep(bench.now).is_none(), "one record at a time");
    bench.events();
    assert_eq!(written(&mut bench), [""; 0], "nobody waits for the first record");
    assert!(bench.events().contains(&Event::Saved), "its late success is told all the same");
    assert_eq!(bench.device.snapshot(bench.now).saved.settings.steps_per_turn, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    let second = fetch(&mut bench);
    assert_eq!(second.saved.settings.steps_per_turn, 2_000);
    assert_eq!(written(&mut bench), ["42B#0A96"]);
}

#[test]
fn the_end_of_an_automatic_write_is_no_answer_to_a_save() {
    let mut bench = slow();
    bench.asks("10 03 01 03 01", "90");
    let automatic = fetch(&mut bench);
    assert_eq!(automatic.saved.settings.steps_per_turn, 8_192);
    bench.write(7, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    assert_eq!(written(&mut bench), [""; 0]);
    bench.asks("0E 2F 01 07", "94 10 FF");
    let save = fetch(&mut bench);
    assert_eq!(save.saved.settings.steps_per_turn, 1_000);
    assert_eq!(written(&mut bench), ["42B#0A96"]);
    assert_eq!(writes(&bench), 2);
}

#[test]
fn a_failed_automatic_write_is_no_answer_to_a_save_either() {
    let mut bench = slow();
    bench.asks("10 03 01 03 01", "90");
    fetch(&mut bench);
    assert_eq!(bench.ask(SAVE), None);
    assert_eq!(failed(&mut bench), [""; 0]);
    fetch(&mut bench);
    assert_eq!(written(&mut bench), ["42B#0A96"]);
    assert!(!bench.device.keep_due(bench.now), "the Save took the network settings along");
}

#[test]
fn a_save_whose_connection_has_ended_answers_nobody_else() {
    let mut bench = slow();
    bench.write(7, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    fetch(&mut bench);
    bench.says("42E#0A4C030103", &["42B#0ACC"]);
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
    bench.asks(SAVE, "94 10 FF");
    bench.asks("05 01 01 01", "94 10 FF");
    assert_eq!(written(&mut bench), [""; 0]);
    bench.asks("0E 2F 01 07", "8E E8030000");
    assert_eq!(bench.ask(SAVE), None);
    fetch(&mut bench);
    assert_eq!(written(&mut bench), ["42B#0A96"]);
}

#[test]
fn a_save_that_nobody_fetched_gives_way_to_a_newer_one() {
    let mut bench = slow();
    bench.write(7, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    bench.wait(Duration::from_secs(3));
    bench.says("42E#0A4C030103", &["42B#0ACC"]);
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
    bench.write(7, 2_000);
    assert_eq!(bench.ask(SAVE), None);
    // The five seconds of the newer one count.
    assert_eq!(bench.wait(Duration::from_nanos(4_999_999_999)), [""; 0]);
    assert_eq!(fetch(&mut bench).saved.settings.steps_per_turn, 2_000);
    assert_eq!(written(&mut bench), ["42B#0A96"]);
}

#[test]
fn a_save_answered_as_failed_before_its_record_was_fetched_is_off() {
    let mut bench = slow();
    bench.write(7, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    assert_eq!(bench.wait(Duration::from_secs(5)), ["42B#0A9419FF"]);
    assert!(bench.device.keep(bench.now).is_none());
    assert_eq!(bench.device.deadline(), None);
}

#[test]
fn a_save_that_nobody_fetched_goes_with_the_power() {
    let mut bench = slow();
    bench.write(7, 1_000);
    assert_eq!(bench.ask(SAVE), None);
    bench.device.power_cycle(bench.now);
    assert!(bench.device.keep(bench.now).is_none(), "a setting of before the power cycle");
    assert_eq!(bench.device.snapshot(bench.now).in_force.settings.steps_per_turn, 8_192);
    bench.wait(Duration::from_secs(10));
    assert!(!bench.events().contains(&Event::KeepFailed));
}

#[test]
fn a_failing_memory_is_tried_again_after_a_minute_and_counted_only_when_it_is_good() {
    let mut bench = slow();
    bench.asks("10 03 01 03 01", "90");
    for _ in 0..3 {
        fetch(&mut bench);
        failed(&mut bench);
        assert!(bench.events().contains(&Event::KeepFailed));
        bench.wait(Duration::from_nanos(59_999_999_999));
        assert!(!bench.device.keep_due(bench.now));
        assert!(bench.device.keep(bench.now).is_none());
        bench.wait(Duration::from_nanos(1));
        assert!(bench.device.keep_due(bench.now));
        assert_eq!(writes(&bench), 0);
    }
    // A change of what is to be kept does not bring the next try forward.
    fetch(&mut bench);
    failed(&mut bench);
    bench.says("42E#0A4C030103", &["42B#0ACC"]);
    bench.says("42E#0A4B0301030A", &["42B#0ACB00"]);
    bench.asks("10 05 02 0E 20 04 24 02", "90");
    assert!(!bench.device.keep_due(bench.now));
    bench.wait(Duration::from_secs(60));
    fetch(&mut bench);
    assert_eq!(written(&mut bench), [""; 0]);
    assert_eq!(writes(&bench), 1);
    assert!(!bench.device.keep_due(bench.now));
    assert_eq!(bench.device.snapshot(bench.now).memory, MemoryState::Good);
}

#[test]
fn a_host_that_does_not_fetch_the_next_try_is_not_called_without_end() {
    let mut bench = slow();
    bench.asks("10 03 01 03 01", "90");
    fetch(&mut bench);
    failed(&mut bench);
    let retry = bench.device.deadline().expect("the next try");
    bench.now = retry;
    bench.device.advance(retry);
    assert_ne!(bench.device.deadline(), Some(retry));
    assert!(bench.device.keep_due(retry));
}

#[test]
fn a_failed_save_does_not_lose_what_is_kept_at_once() {
    let mut bench = slow();
    bench.asks("10 03 01 03 01", "90");
    assert_eq!(bench.ask(SAVE), None);
    fetch(&mut bench);
    assert_eq!(failed(&mut bench), ["42B#0A9419FF"]);
    assert!(!bench.device.keep_due(bench.now));
    bench.wait(Duration::from_secs(60));
    bench.serves_memory = true;
    bench.collect();
    assert_eq!(bench.records, 1);
    let mut bench = bench.power_cycled();
    bench.asks("0E 03 01 03", "8E 01");
}

#[test]
fn the_recoverable_fault_survives_automatic_writes_and_the_power_until_a_good_save() {
    let mut memory = TornMemory::new();
    memory.write(Slot::A, &[0x55; 92], None);
    memory.write(Slot::B, &[0xAA; 92], None);
    let mut bench = Bench::power_up_with("amg11-d29", memory, Hand::default()).allocated();
    for (boi, state) in [("01", "8E 01"), ("00", "8E 00"), ("01", "8E 01")] {
        bench.asks(&format!("10 03 01 03 {boi}"), "90");
        bench = bench.power_cycled();
        assert!(bench.events().contains(&Event::MemoryDamaged), "told at each power-up");
        bench.asks("0E 03 01 03", state);
        bench.asks("0E 01 01 05", "8E 0101");
        bench.asks("15 2F 01", "94 18 FF");
    }
    // A Save that fails ends nothing.
    bench.serves_memory = false;
    assert_eq!(bench.ask(SAVE), None);
    fetch(&mut bench);
    assert_eq!(failed(&mut bench), ["42B#0A9419FF"]);
    bench.asks("0E 01 01 05", "8E 0101");
    bench.serves_memory = true;
    bench.asks(SAVE, "96");
    bench.asks("0E 01 01 05", "8E 0100");
    let mut bench = bench.power_cycled();
    bench.asks("0E 01 01 05", "8E 0100");
    bench.asks("15 2F 01", "95");
}

#[test]
fn a_record_whose_paths_name_no_assembly_gives_assembly_1_and_everything_else_it_holds() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("10 03 01 03 01", "90");
    let start = codewheel_encoder::choose(bench.memory.read(Slot::A), bench.memory.read(Slot::B));
    let (slot, sequence) = start.next();
    let codewheel_encoder::Start::Kept { mut kept, .. } = start else { panic!("nothing kept") };
    // Octets 4 … 7 of the bus: assembly and form of the path, of the poll and of the other one.
    kept.bus[4..8].copy_from_slice(&[9, 1, 0, 0]);
    let octets: [u8; codewheel_encoder::RECORD_OCTETS] = codewheel_encoder::encode(&kept, sequence);
    bench.memory.write(slot, &octets, None);
    let mut bench = bench.power_cycled();
    bench.says("42D#", &["3C5#00000000"]);
    bench.asks("0E 05 02 0E", "8E 20042401");
    bench.asks("4B 03 01 50 0A", "CB 00");
    bench.asks("0E 05 04 0E", "8E 20042401");
    assert_eq!(bench.produces_when_asked("10 05 04 09 00 00"), ["345#00000000"]);
    bench.asks("0E 03 01 03", "8E 01");
}
