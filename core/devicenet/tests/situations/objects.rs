//! Identity, Message Router, DeviceNet and Assembly (devicenet clause 5).

use codewheel_devicenet::{NetworkSettings, Reset};
use codewheel_station::Duration;

use crate::bench::Bench;

#[test]
fn the_identity_reads_as_the_device_says() {
    let mut bench = Bench::allocated();
    for (attribute, value) in [
        ("01", "3412"),
        ("02", "0000"),
        ("03", "0B00"),
        ("04", "0102"),
        ("05", "0100"),
        ("06", "0DF0FECA"),
        ("07", "03546F79"),
        ("08", "03"),
        ("09", "0000"),
        ("0A", "00"),
    ] {
        bench.asks(&format!("0E 01 01 {attribute}"), &format!("8E {value}"));
    }
    for absent in ["00", "0B", "64"] {
        bench.asks(&format!("0E 01 01 {absent}"), "94 14 FF");
        bench.asks(&format!("10 01 01 {absent} 00"), "94 14 FF");
    }
    for read_only in 1..=9 {
        bench.asks(&format!("10 01 01 {read_only:02X} 00"), "94 0E FF");
    }
}

#[test]
fn the_message_router_has_no_attributes() {
    let mut bench = Bench::allocated();
    bench.asks("0E 02 01 01", "94 14 FF");
    bench.asks("10 02 01 01 00", "94 08 FF");
}

#[test]
fn the_devicenet_object_tells_address_rate_allocation_and_switches() {
    let mut bench = Bench::allocated();
    for (attribute, value) in [
        ("01", "05"),
        ("02", "02"),
        ("03", "00"),
        ("04", "00"),
        ("05", "030A"),
        ("06", "01"), // the toy's switches stand at 7 by now
        ("07", "00"),
        ("08", "07"),
        ("09", "02"),
    ] {
        bench.asks(&format!("0E 03 01 {attribute}"), &format!("8E {value}"));
    }
    for (attribute, refusal) in
        [("01", "0E"), ("02", "0E"), ("05", "0E"), ("09", "0E"), ("0A", "14"), ("00", "14")]
    {
        bench.asks(&format!("10 03 01 {attribute} 00"), &format!("94 {refusal} FF"));
    }
}

#[test]
fn bus_off_interrupt_is_a_kept_boolean_and_the_counter_can_be_cleared() {
    let mut bench = Bench::allocated();
    bench.asks("10 03 01 03 02", "94 09 FF");
    bench.asks("10 03 01 03", "94 13 FF");
    bench.asks("10 03 01 03 01 00", "94 15 FF");
    assert_eq!(bench.node.toy.kept, None);
    bench.asks("10 03 01 03 01", "90");
    let settings = NetworkSettings { bus_off_interrupt: true, ..NetworkSettings::default() };
    assert_eq!(bench.node.toy.kept, Some(settings));
    bench.asks("0E 03 01 03", "8E 01");
    bench.asks("10 03 01 04 55", "90");
    bench.asks("0E 03 01 04", "8E 00");
}

#[test]
fn assemblies_can_be_read_and_not_set() {
    let mut bench = Bench::allocated();
    bench.asks("0E 04 01 03", "8E 01000000");
    bench.asks("0E 04 02 03", "8E 0200000000");
    bench.asks("0E 04 01 04", "8E 0400");
    bench.asks("0E 04 02 04", "8E 0500");
    bench.asks("0E 04 02 01", "94 14 FF");
    bench.asks("10 04 02 03 00", "94 0E FF");
    bench.asks("10 04 02 02 00", "94 14 FF");
    bench.asks("0E 04 03 03", "94 16 FF");
}

#[test]
fn a_reset_is_answered_first_and_then_asks_for_a_power_cycle() {
    for request in ["05 01 01", "05 01 01 00"] {
        let mut bench = Bench::allocated();
        assert!(!bench.node.server.power_cycle_due());
        bench.asks(request, "85");
        assert_eq!(bench.node.toy.reset, Some(Reset::PowerCycle));
        assert!(bench.node.server.power_cycle_due());
    }
    let mut bench = Bench::allocated();
    bench.asks("05 01 01 02", "94 20 FF");
    bench.asks("05 01 01 00 00", "94 15 FF");
    assert!(!bench.node.server.power_cycle_due());
}

#[test]
fn a_reset_to_the_defaults_is_answered_when_they_are_written() {
    let mut bench = Bench::allocated();
    assert_eq!(bench.ask("05 01 01 01"), None);
    bench.wait(Duration::from_millis(20));
    assert!(!bench.node.server.power_cycle_due());
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), ["42B#0A85"]);
    assert!(bench.node.server.power_cycle_due());
}
