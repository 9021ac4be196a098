//! Resets by the Identity object, down to the memory (devicenet clause 5; encoder clause 4).

use codewheel_device::Event;
use codewheel_devicenet::NetworkStatus;
use codewheel_station::can::Input;
use codewheel_station::{Duration, Station};

use crate::bench::Bench;

const CHECK: &str = "42F#00D401D2040000";

fn is_restarted(bench: &Bench) -> bool {
    bench.device.server().status() == NetworkStatus::NotOnLine
}

/// With settings saved that are not the defaults, and a memory that waits.
fn saved() -> Bench {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("10 03 01 03 01", "90");
    bench.asks("10 01 01 0A 00", "90");
    bench.asks("4B 03 01 10 0A", "CB 00");
    bench.asks("10 05 04 0E 20 04 24 02", "90");
    bench.asks("4C 03 01 10", "CC");
    bench.write(7, 3_600);
    bench.asks("16 2F 01", "96");
    bench.serves_memory = false;
    bench
}

/// What `saved` has set, as it reads.
fn reads_as_saved(bench: &mut Bench) {
    bench.asks("0E 03 01 03", "8E 01");
    assert_eq!(bench.read(7), 3_600);
    bench.asks("4B 03 01 10 0A", "CB 00");
    bench.asks("0E 05 04 0E", "8E 20042402");
    bench.asks("4C 03 01 10", "CC");
}

fn reads_as_new(bench: &mut Bench) {
    bench.asks("0E 03 01 03", "8E 00");
    assert_eq!(bench.read(7), 8_192);
    bench.asks("4B 03 01 10 0A", "CB 00");
    bench.asks("0E 05 04 0E", "8E 20042401");
    bench.asks("0E 01 01 06", "8E D2040000");
    bench.asks("0E 01 01 05", "8E 0100");
}

#[test]
fn the_defaults_are_written_then_answered_then_the_power_is_cycled() {
    let mut bench = saved();
    assert_eq!(bench.ask("05 01 01 01"), None);
    bench.says("42D#", &["3C5#00000000"]);
    bench.asks("05 05 02", "94 10 FF");
    let record = bench.device.keep(bench.now).expect("the defaults");
    assert_eq!(record.saved.settings.steps_per_turn, 8_192);
    assert_eq!(record.serial, crate::bench::SERIAL);
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.device.encoder().settings().steps_per_turn, 3_600, "still in force");
    bench.events();
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    let answer = bench.device.transmit(bench.now).expect("the answer");
    assert_eq!(answer.to_string(), "42B#0A85");
    assert!(!is_restarted(&bench), "not before the answer is on the wire");
    bench.hears("42D#");
    bench.device.handle(bench.now, Input::Sent(&answer));
    assert!(is_restarted(&bench));
    assert!(bench.events().contains(&Event::PowerUp));
    bench.serves_memory = true;
    let mut bench = bench.allocated();
    reads_as_new(&mut bench);
}

#[test]
fn it_is_carried_out_without_any_frame_once_its_connection_has_ended() {
    let mut released = saved();
    assert_eq!(released.ask("05 01 01 01"), None);
    released.says("42E#0A4C030103", &["42B#0ACC"]);
    let mut silent = saved();
    silent.asks("10 05 01 09 64 00", "90 6400");
    assert_eq!(silent.ask("05 01 01 01"), None);
    silent.wait(Duration::from_millis(400));
    for mut bench in [released, silent] {
        bench.device.keep(bench.now).expect("the defaults");
        assert!(!is_restarted(&bench));
        bench.device.kept(bench.now, Ok::<(), ()>(()));
        assert!(is_restarted(&bench), "no frame, no deadline was needed");
        assert_eq!(bench.collect(), [CHECK]);
        let mut bench = bench.allocated();
        reads_as_new(&mut bench);
    }
}

#[test]
fn a_failed_reset_to_the_defaults_changes_nothing() {
    let mut refused = saved();
    assert_eq!(refused.ask("05 01 01 01"), None);
    refused.device.keep(refused.now).expect("the defaults");
    refused.device.kept(refused.now, Err("worn out"));
    assert_eq!(refused.collect(), ["42B#0A9419FF"]);
    let mut unfetched = saved();
    assert_eq!(unfetched.ask("05 01 01 01"), None);
    assert_eq!(unfetched.wait(Duration::from_secs(5)), ["42B#0A9419FF"]);
    for mut bench in [refused, unfetched] {
        assert!(!is_restarted(&bench));
        assert!(!bench.device.keep_due(bench.now));
        reads_as_saved(&mut bench);
        bench.wait(Duration::from_secs(100));
        bench.serves_memory = true;
        let mut bench = bench.power_cycled();
        reads_as_saved(&mut bench);
    }
}

#[test]
fn a_reset_waits_for_an_automatic_write_and_loses_nothing_of_it() {
    let mut bench = saved();
    bench.asks("10 03 01 03 00", "90");
    bench.device.keep(bench.now).expect("an automatic write");
    bench.asks("05 01 01", "85");
    assert!(!is_restarted(&bench));
    // Nothing is answered between the answer and the restart.
    bench.says("42D#", &[]);
    bench.says("42C#0A0E010101", &[]);
    bench.says("42E#0B4B0301030B", &[]);
    assert_eq!(bench.wait(Duration::from_secs(3)), [""; 0]);
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    assert!(is_restarted(&bench));
    let mut bench = bench.allocated();
    bench.asks("0E 03 01 03", "8E 00");
}

#[test]
fn what_is_to_be_kept_at_once_is_fetched_before_the_restart() {
    let mut bench = saved();
    bench.asks("10 03 01 03 00", "90");
    bench.asks("05 01 01", "85");
    assert!(!is_restarted(&bench), "the record waits to be fetched");
    bench.serves_memory = true;
    bench.collect();
    assert!(is_restarted(&bench));
    let mut bench = bench.power_cycled();
    bench.asks("0E 03 01 03", "8E 00");
}

#[test]
fn a_memory_that_hangs_holds_a_reset_up_for_five_seconds() {
    let mut bench = saved();
    bench.asks("10 03 01 03 00", "90");
    bench.device.keep(bench.now).expect("an automatic write");
    bench.asks("05 01 01", "85");
    assert_eq!(bench.wait(Duration::from_nanos(4_999_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), [CHECK]);
    assert_eq!(bench.wait(Duration::from_secs(1)), [CHECK]);
}

#[test]
fn a_memory_that_has_failed_does_not_hold_a_reset_up() {
    let mut bench = saved();
    bench.asks("10 03 01 03 00", "90");
    bench.device.keep(bench.now).expect("an automatic write");
    bench.device.kept(bench.now, Err("worn out"));
    bench.hears("42C#0A050101");
    assert_eq!(bench.collect(), ["42B#0A85", CHECK]);
}

#[test]
fn a_preset_that_was_not_saved_is_lost_with_the_power() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.turn_to(500);
    bench.write(10, 77);
    assert_eq!(bench.read(12), 77);
    bench.asks("05 01 01 00", "85");
    let mut bench = bench.allocated();
    assert_eq!((bench.read(12), bench.read(91), bench.read(10)), (500, 0, 0));
}

#[test]
fn an_interval_of_the_heartbeat_and_the_bus_off_interrupt_survive_the_power_without_save() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    let before = bench.ask("0E 01 01 09");
    bench.asks("10 01 01 0A 3C", "90");
    bench.asks("10 03 01 03 01", "90");
    let after = bench.ask("0E 01 01 09");
    assert_ne!(before, after, "the consistency value changes with what is kept");
    let mut bench = bench.power_cycled();
    bench.asks("0E 01 01 0A", "8E 3C");
    bench.asks("0E 03 01 03", "8E 01");
    assert_eq!(bench.ask("0E 01 01 09"), after);
    // The counter of bus-offs is not among what is kept (encoder clause 4).
    bench.asks("0E 03 01 04", "8E 00");
}
