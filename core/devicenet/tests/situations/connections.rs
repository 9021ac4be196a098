//! The Connection object, class 05 (devicenet clause 5).

use codewheel_devicenet::connection::State;
use codewheel_devicenet::{NetworkSettings, ProducedPath};
use codewheel_station::Duration;

use crate::bench::Bench;

#[test]
fn the_explicit_connection_reads_as_the_table_says() {
    let mut bench = Bench::allocated();
    for (attribute, value) in [
        ("01", "03"),
        ("02", "00"),
        ("03", "83"),
        ("04", "2B04"),
        ("05", "2C04"),
        ("06", "21"),
        ("07", "C000"),
        ("08", "4000"),
        ("09", "C409"),
        ("0C", "01"),
        ("0D", "0000"),
        ("0E", ""),
        ("0F", "0000"),
        ("10", ""),
    ] {
        bench.asks(&format!("0E 05 01 {attribute}"), &format!("8E {value}"));
    }
    for absent in ["00", "0A", "0B", "11", "12", "FF"] {
        bench.asks(&format!("0E 05 01 {absent}"), "94 14 FF");
    }
}

#[test]
fn the_poll_connection_reads_as_the_table_says() {
    let mut bench = Bench::allocated();
    for (attribute, value) in [
        ("01", "01"),
        ("02", "01"),
        ("03", "82"),
        ("04", "C503"),
        ("05", "2D04"),
        ("06", "01"),
        ("07", "0400"),
        ("08", "0000"),
        ("09", "0000"),
        ("0C", "00"),
        ("0D", "0400"),
        ("0E", "20042401"),
        ("0F", "0000"),
        ("10", ""),
        ("11", "0000"),
    ] {
        bench.asks(&format!("0E 05 02 {attribute}"), &format!("8E {value}"));
    }
    for absent in ["00", "0A", "0B", "12", "64"] {
        bench.asks(&format!("0E 05 02 {absent}"), "94 14 FF");
        bench.asks(&format!("10 05 02 {absent} 00"), "94 14 FF");
    }
}

#[test]
fn a_connection_that_is_not_allocated_does_not_exist_for_any_service() {
    let mut bench = Bench::on_line();
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
    for instance in ["02", "03", "04", "05", "FF"] {
        for service in ["05", "08", "09", "0D", "0E", "10", "16", "4B"] {
            bench.asks(&format!("{service} 05 {instance} 01"), "94 16 FF");
        }
    }
}

#[test]
fn read_only_attributes_are_not_settable() {
    let mut bench = Bench::allocated();
    for attribute in ["01", "02", "03", "04", "05", "06", "07", "08", "0D", "0F", "10"] {
        bench.asks(&format!("10 05 01 {attribute} 00"), "94 0E FF");
        bench.asks(&format!("10 05 02 {attribute} 00"), "94 0E FF");
    }
    bench.asks("10 05 01 0E 20 04 24 01", "94 0E FF");
    bench.asks("10 05 01 11 00 00", "94 0E FF");
}

#[test]
fn the_produced_path_is_chosen_while_configuring_and_kept_at_once() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 02 0E 20 04 24 02 30 03", "90");
    bench.asks("0E 05 02 0E", "8E 20 04 24 02 30 03");
    bench.asks("0E 05 02 0D", "8E 06 00");
    bench.asks("0E 05 02 07", "8E 05 00");
    let poll_path = ProducedPath { assembly: 2, names_attribute: true };
    let settings = NetworkSettings { poll_path, ..NetworkSettings::default() };
    assert_eq!(bench.node.toy.kept, Some(settings));
    bench.asks("10 05 02 09 64 00", "90 6400");
    bench.asks("10 05 02 0E 20 04 24 01", "94 0C FF");
    bench.asks("0E 05 02 0E", "8E 20 04 24 02 30 03");
    // The next allocation starts with what was kept.
    bench.asks("4C 03 01 02", "CC");
    bench.asks("4B 03 01 02 0A", "CB 00");
    bench.asks("0E 05 02 07", "8E 05 00");
}

#[test]
fn a_path_to_anything_but_an_assembly_of_ours_is_refused_and_changes_nothing() {
    let mut bench = Bench::allocated();
    for path in ["20 04 24 03", "20 04 24 00", "20 2F 24 01", "20 04 24 01 30 04", "20 04", "00"] {
        bench.asks(&format!("10 05 02 0E {path}"), "94 09 FF");
    }
    bench.asks("10 05 02 0E", "94 13 FF");
    bench.asks("0E 05 02 0E", "8E 20 04 24 01");
    assert_eq!(bench.node.toy.kept, None);
}

#[test]
fn the_watchdog_action_takes_what_the_connection_knows() {
    let mut bench = Bench::allocated();
    for (action, answer) in
        [("00", "94 09 FF"), ("01", "90"), ("02", "94 09 FF"), ("03", "90"), ("04", "94 09 FF")]
    {
        bench.asks(&format!("10 05 01 0C {action}"), answer);
    }
    for (action, answer) in
        [("00", "90"), ("01", "90"), ("02", "90"), ("03", "94 09 FF"), ("FF", "94 09 FF")]
    {
        bench.asks(&format!("10 05 02 0C {action}"), answer);
    }
    bench.asks("10 05 01 0C", "94 13 FF");
    bench.asks("10 05 01 0C 01 00", "94 15 FF");
}

#[test]
fn the_rate_granted_comes_back() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 02 09 01 00", "90 0100");
    bench.asks("10 05 02 09 FF FF", "90 FFFF");
    bench.asks("10 05 01 09 10 27", "90 1027");
    bench.asks("10 05 02 09 64", "94 13 FF");
    bench.asks("10 05 02 09 64 00 00", "94 15 FF");
    bench.asks("0E 05 02 09", "8E FFFF");
}

#[test]
fn production_inhibit_is_set_while_configuring_and_never_exceeds_the_rate() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 02 11 C8 00", "90 C800");
    bench.asks("10 05 02 09 C7 00", "94 09 11");
    bench.asks("0E 05 02 01", "8E 01");
    bench.asks("10 05 02 09 C8 00", "90 C800");
    bench.asks("10 05 02 11 01 00", "94 0C FF");
    bench.asks("0E 05 02 11", "8E C800");
}

#[test]
fn apply_establishes_a_configuring_connection_and_names_its_identifiers() {
    let mut bench = Bench::allocated();
    bench.asks("0D 05 02", "8D C503 2D04");
    bench.asks("0E 05 02 01", "8E 03");
    bench.asks("0D 05 02", "94 0C FF");
    bench.asks("0D 05 01", "94 0C FF");
    bench.asks("0D 05 02 00", "94 15 FF");
}

#[test]
fn a_reset_while_configuring_is_a_state_conflict() {
    let mut bench = Bench::allocated();
    bench.asks("05 05 02", "94 0C FF");
    bench.asks("05 05 01", "85");
    bench.asks("05 05 01 00", "94 15 FF");
    bench.asks("09 05 01", "94 08 FF");
}

#[test]
fn the_explicit_connection_ends_after_ten_silent_seconds() {
    let mut bench = Bench::allocated();
    bench.wait(Duration::from_secs(9));
    bench.asks("0E 01 01 01", "8E 3412");
    bench.wait(Duration::from_nanos(9_999_999_999));
    assert_eq!(bench.node.server.connection_state(1), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(bench.node.server.connection_state(1), None);
    bench.says("42C#0A0E010101", &[]);
}

#[test]
fn deferred_delete_lives_while_an_io_connection_is_established() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 01 0C 03", "90");
    bench.asks("10 05 02 09 00 00", "90 0000");
    bench.wait(Duration::from_secs(60));
    assert_eq!(bench.node.server.connection_state(1), Some(State::DeferredDelete));
    bench.asks("0E 05 01 01", "8E 03");
    bench.wait(Duration::from_secs(60));
    bench.asks("4C 03 01 02", "CC");
    bench.wait(Duration::from_secs(10));
    assert_eq!(bench.node.server.connection_state(1), None);
}

#[test]
fn a_deferred_explicit_connection_ends_with_the_last_io_connection() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 01 0C 03", "90");
    bench.asks("10 05 02 09 F4 01", "90 F401");
    for _ in 0..12 {
        bench.wait(Duration::from_secs(1));
        bench.says("42D#", &[&format!("3C5#{:02X}000000", bench.node.toy.produced + 1)]);
    }
    assert_eq!(bench.node.server.connection_state(1), Some(State::DeferredDelete));
    bench.wait(Duration::from_secs(2));
    assert_eq!(bench.node.server.connection_state(1), None);
    assert_eq!(bench.node.server.master(), None);
}
