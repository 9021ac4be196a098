//! Bus-off, recovery and silence (devicenet clauses 2 and 5).

use codewheel_devicenet::{Event, Fault, NetworkStatus, Server};
use codewheel_station::can::{BitRate, Input};
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, frame};

const CHECK: &str = "42F#0034120DF0FECA";
const BUS_OFF: NetworkStatus = NetworkStatus::Faulted(Fault::BusOff);

fn leaves_the_bus(bench: &mut Bench) {
    bench.node.handle(bench.now, Input::BusOff);
}

fn recovers(bench: &mut Bench) {
    bench.node.handle(bench.now, Input::Recovered);
}

#[test]
fn with_interrupt_0_a_bus_off_is_for_good() {
    let mut bench = Bench::polled();
    leaves_the_bus(&mut bench);
    assert_eq!(bench.node.server.status(), BUS_OFF);
    assert_eq!(bench.node.server.master(), None);
    assert!(bench.node.toy.events.contains(&Event::Faulted(Fault::BusOff)));
    recovers(&mut bench);
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
    for message in ["42D#", "42E#0A4B0301030A", "42C#0A0E010101", "42F#00D40178563412"] {
        bench.says(message, &[]);
    }
    assert_eq!(bench.node.server.status(), BUS_OFF);
}

#[test]
fn with_interrupt_1_the_node_checks_its_mac_id_anew_once_the_controller_is_back() {
    let mut bench = Bench::polled();
    bench.asks("10 03 01 03 01", "90");
    leaves_the_bus(&mut bench);
    assert_eq!(bench.wait(Duration::from_secs(1)), [""; 0]);
    recovers(&mut bench);
    assert_eq!(bench.node.server.status(), NetworkStatus::NotOnLine);
    assert_eq!(bench.collect(), [CHECK]);
    assert_eq!(bench.wait(Duration::from_millis(1_000)), [CHECK]);
    bench.says("42E#0A4B0301030A", &[]);
    bench.wait(Duration::from_millis(1_000));
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
    bench.says("42D#", &[]);
    bench.says("42E#0A4B0301030A", &["42B#0ACB00"]);
    bench.asks("0E 03 01 04", "8E 01");
}

#[test]
fn a_bus_off_during_the_check_begins_it_anew() {
    let mut bench = Bench::polled();
    bench.asks("10 03 01 03 01", "90");
    for _ in 0..3 {
        leaves_the_bus(&mut bench);
        recovers(&mut bench);
        assert_eq!(bench.collect(), [CHECK]);
        bench.wait(Duration::from_millis(1_500));
    }
    bench.wait(Duration::from_millis(500));
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
}

#[test]
fn the_counter_saturates_at_255_and_any_set_clears_it() {
    let mut bench = Bench::polled();
    bench.asks("10 03 01 03 01", "90");
    for count in 1..=300_u16 {
        leaves_the_bus(&mut bench);
        recovers(&mut bench);
        if [1, 2, 254, 255, 256, 300].contains(&count) {
            bench.collect();
            bench.wait(Duration::from_secs(2));
            bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
            bench.asks("0E 03 01 04", &format!("8E {:02X}", count.min(255)));
        }
    }
    for value in ["00", "07", "FF"] {
        bench.asks("10 03 01 04", "94 13 FF");
        bench.asks("10 03 01 04 00 00", "94 15 FF");
        bench.asks(&format!("10 03 01 04 {value}"), "90");
        bench.asks("0E 03 01 04", "8E 00");
    }
}

#[test]
fn a_bus_off_never_hides_a_duplicate_mac_id() {
    let mut bench = Bench::polled();
    bench.asks("10 03 01 03 01", "90");
    bench.says("42F#8034120DF0FECA", &[]);
    leaves_the_bus(&mut bench);
    recovers(&mut bench);
    let duplicate = NetworkStatus::Faulted(Fault::DuplicateMac);
    assert_eq!(bench.node.server.status(), duplicate);
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
    assert_eq!(bench.node.server.status(), duplicate);
}

#[test]
fn a_bus_off_never_hides_illegal_switches() {
    let mut bench = Bench::polled();
    let mut settings = bench.node.server.settings();
    settings.bus_off_interrupt = true;
    bench.node.server = Server::off_the_bus(BitRate::Kbit125, settings);
    leaves_the_bus(&mut bench);
    recovers(&mut bench);
    assert_eq!(bench.node.server.status(), NetworkStatus::Faulted(Fault::Switches));
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
}

#[test]
fn whatever_was_owed_is_dropped_when_the_node_falls_silent() {
    let owing = || {
        let mut bench = Bench::with(0x13);
        bench.asks("10 01 01 0A 01", "90");
        bench.asks("10 05 02 09 00 00", "90 0000");
        bench.now += Duration::from_secs(1);
        bench.hears("42C#0A10050409E803"); // a production, and the answer
        bench.hears("42D#"); // a poll response
        bench.hears("42E#0B4B0301030B"); // a refusal to another master
        bench.hears("42F#00D40178563412"); // an objection to another node
        bench
    };
    assert_eq!(owing().collect().len(), 6, "with the heartbeat");
    let mut bench = owing();
    bench.hears("42F#8034120DF0FECA");
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
    let mut bench = owing();
    leaves_the_bus(&mut bench);
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
    assert_eq!(bench.node.deadline(), None);
    // Nor does any of it come once the node is back.
    let mut bench = Bench::with(0x13);
    bench.asks("10 03 01 03 01", "90");
    bench.hears("42E#0B4B0301030B");
    bench.hears("42C#0A0E010101");
    leaves_the_bus(&mut bench);
    recovers(&mut bench);
    assert_eq!(bench.collect(), [CHECK]);
    assert_eq!(bench.wait(Duration::from_secs(100)), [CHECK]);
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
}

#[test]
fn a_fragmented_answer_is_not_taken_up_again_after_a_recovery() {
    let mut bench = Bench::with(0x01);
    bench.asks("10 03 01 03 01", "90");
    bench.says("42C#0A0E640102", &["42B#8A008E6120746578"]);
    leaves_the_bus(&mut bench);
    recovers(&mut bench);
    bench.collect();
    assert_eq!(bench.wait(Duration::from_secs(2)), [CHECK]);
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
    bench.node.handle(bench.now, Input::Frame(&frame("42C#8AC000")));
    assert_eq!(bench.wait(Duration::from_secs(5)), [""; 0]);
}

#[test]
fn a_node_that_is_plugged_in_again_checks_its_mac_id_whatever_the_interrupt_says() {
    for interrupt in ["10 03 01 03 00", "10 03 01 03 01"] {
        let mut bench = Bench::polled();
        bench.asks(interrupt, "90");
        bench.node.handle(bench.now, Input::Detached);
        assert_eq!(bench.node.server.status(), NetworkStatus::Faulted(Fault::Detached));
        assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
        bench.node.handle(bench.now, Input::Attached);
        assert_eq!(bench.collect(), [CHECK]);
        assert_eq!(bench.wait(Duration::from_millis(1_000)), [CHECK]);
        bench.wait(Duration::from_millis(1_000));
        assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
        bench.says("42D#", &[]);
        bench.says("42E#0A4B0301030A", &["42B#0ACB00"]);
        // It was no bus-off.
        bench.asks("0E 03 01 04", "8E 00");
    }
}

#[test]
fn a_bus_off_that_was_for_good_ends_with_the_plug() {
    let mut bench = Bench::polled();
    leaves_the_bus(&mut bench);
    bench.node.handle(bench.now, Input::Detached);
    bench.node.handle(bench.now, Input::Attached);
    assert_eq!(bench.collect(), [CHECK]);
}

#[test]
fn a_duplicate_mac_id_outlasts_the_plug() {
    let mut bench = Bench::polled();
    bench.says("42F#80341278563412", &[]);
    bench.node.handle(bench.now, Input::Detached);
    bench.node.handle(bench.now, Input::Attached);
    assert_eq!(bench.node.server.status(), NetworkStatus::Faulted(Fault::DuplicateMac));
    assert_eq!(bench.wait(Duration::from_secs(10)), [""; 0]);
}
