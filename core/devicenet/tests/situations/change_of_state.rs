//! Change of state: connection instance 4, allocated with bit 4 (devicenet clauses 3, 5 and 6).
//! What cyclic shares with it is here too.

use codewheel_devicenet::connection::State;
use codewheel_devicenet::{NetworkSettings, NetworkStatus, ProducedPath};
use codewheel_station::Duration;

use crate::bench::Bench;

/// Allocation choices: explicit together with a way to use instance 4.
const COS: u8 = 0x11;
const CYCLIC: u8 = 0x21;
const COS_UNACKNOWLEDGED: u8 = 0x51;
const CYCLIC_UNACKNOWLEDGED: u8 = 0x61;

/// An unacknowledged change of state connection with this expected packet rate, its first
/// production already out.
fn producing(rate: &str) -> Bench {
    let mut bench = Bench::with(COS_UNACKNOWLEDGED);
    bench.hears(&format!("42C#0A10050409{rate}"));
    assert_eq!(bench.collect(), ["345#01000000".to_owned(), format!("42B#0A90{rate}")]);
    bench
}

#[test]
fn every_way_to_use_instance_4_is_granted_and_read_back() {
    for choice in [0x11, 0x21, 0x51, 0x61, 0x13, 0x23, 0x53, 0x63] {
        let mut bench = Bench::with(choice);
        bench.asks("0E 03 01 05", &format!("8E {choice:02X} 0A"));
        bench.asks("0E 05 04 01", "8E 01");
        assert_eq!(bench.node.server.connection_state(4), Some(State::Configuring));
    }
}

#[test]
fn the_refusals_of_a_first_allocation_come_in_the_order_of_the_checks() {
    let mut free = Bench::on_line();
    for (choice, refusal) in [
        (0x41, "0902"), // 3: bit 6 without 4 or 5
        (0x43, "0902"),
        (0x45, "0902"), // 3 before 4
        (0xC1, "0902"),
        (0x15, "0202"), // 4: bit-strobe
        (0x19, "0202"), // 4: multicast poll
        (0x91, "0202"), // 4: bit 7
        (0x14, "0202"), // 4 before 5
        (0x35, "0202"), // 4 before 6
        (0x10, "0902"), // 5: no explicit connection
        (0x20, "0902"),
        (0x50, "0902"),
        (0x12, "0902"),
        (0x31, "0902"), // 6: together
        (0x71, "0902"),
        (0x33, "0902"),
    ] {
        free.says(&format!("42E#0A4B0301{choice:02X}0A"), &[&format!("42B#0A94{refusal}")]);
    }
    assert_eq!(free.node.server.master(), None);
}

#[test]
fn what_is_allocated_already_is_refused_and_takes_nothing_else_along() {
    for (choice, others) in [(COS, [0x10, 0x50, 0x20, 0x60]), (CYCLIC, [0x20, 0x60, 0x10, 0x50])] {
        let mut bench = Bench::with(choice);
        for again in others {
            bench.says(&format!("42E#0A4B0301{again:02X}0A"), &["42B#0A940B02"]);
        }
        bench.says("42E#0A4B0301300A", &["42B#0A940902"]); // 6 before 7
        bench.says("42E#0A4B0301120A", &["42B#0A940B02"]);
        assert_eq!(bench.node.server.connection_state(2), None, "nothing of it is granted");
        bench.says("42E#0B4B0301300B", &["42B#0B940C01"]); // 1 before 6
        bench.says("42E#0A4B0301020A", &["42B#0ACB00"]);
    }
}

#[test]
fn instance_4_reads_as_the_table_says_in_all_four_uses() {
    for (choice, transport, consumed_id, characteristics, consumed_path) in [
        (COS, "13", "2A04", "01", "202B2401"),
        (COS_UNACKNOWLEDGED, "10", "FFFF", "0F", ""),
        (CYCLIC, "03", "2A04", "01", "202B2401"),
        (CYCLIC_UNACKNOWLEDGED, "00", "FFFF", "0F", ""),
    ] {
        let mut bench = Bench::with(choice);
        let path_length = if consumed_path.is_empty() { "0000" } else { "0400" };
        for (attribute, value) in [
            ("01", "01"),
            ("02", "01"),
            ("03", transport),
            ("04", "4503"),
            ("05", consumed_id),
            ("06", characteristics),
            ("07", "0400"),
            ("08", "0000"),
            ("09", "0000"),
            ("0C", "00"),
            ("0D", "0400"),
            ("0E", "20042401"),
            ("0F", path_length),
            ("10", consumed_path),
            ("11", "0000"),
        ] {
            bench.asks(&format!("0E 05 04 {attribute}"), &format!("8E {value}"));
        }
        for absent in ["00", "0A", "0B", "12", "FF"] {
            bench.asks(&format!("0E 05 04 {absent}"), "94 14 FF");
            bench.asks(&format!("10 05 04 {absent} 00"), "94 14 FF");
        }
        for read_only in ["01", "02", "03", "04", "05", "06", "07", "08", "0D", "0F", "10"] {
            bench.asks(&format!("10 05 04 {read_only} 00"), "94 0E FF");
        }
        for (action, answer) in
            [("00", "90"), ("01", "90"), ("02", "90"), ("03", "94 09 FF"), ("FF", "94 09 FF")]
        {
            bench.asks(&format!("10 05 04 0C {action}"), answer);
        }
        bench.asks("08 05 04", "94 08 FF");
        bench.asks("09 05 04", "94 08 FF");
        bench.asks("05 05 04", "94 0C FF");
        let identifiers = format!("8D 4503 {consumed_id}");
        bench.hears("42C#0A0D0504");
        let expected = format!("42B#0A{}", identifiers.replace(' ', ""));
        assert_eq!(bench.collect(), ["345#01000000".to_owned(), expected]);
        bench.asks("0D 05 04", "94 0C FF");
        bench.asks("0E 05 04 01", "8E 03");
    }
}

#[test]
fn the_path_of_instance_4_is_chosen_while_configuring_and_kept_at_once() {
    let mut bench = Bench::with(COS_UNACKNOWLEDGED);
    for wrong in ["20 04 24 03", "20 04 24 00", "20 2F 24 01", "20 04 24 01 30 04", "20 04", "00"] {
        bench.asks(&format!("10 05 04 0E {wrong}"), "94 09 FF");
    }
    bench.asks("10 05 04 0E", "94 13 FF");
    assert_eq!(bench.node.toy.kept, None);
    bench.asks("10 05 04 0E 20 04 24 02 30 03", "90");
    let change_path = ProducedPath { assembly: 2, names_attribute: true };
    let settings = NetworkSettings { change_path, ..NetworkSettings::default() };
    assert_eq!(bench.node.toy.kept, Some(settings));
    bench.asks("0E 05 04 0D", "8E 0600");
    bench.asks("0E 05 04 0E", "8E 20042402 3003");
    bench.asks("0E 05 04 07", "8E 0500");
    bench.hears("42C#0A100504096400");
    assert_eq!(bench.collect(), ["345#0100000000", "42B#0A906400"]);
    bench.asks("10 05 04 0E 20 04 24 01", "94 0C FF");
    // The next allocation starts with what was kept, whichever way it uses the instance.
    bench.asks("4C 03 01 10", "CC");
    bench.asks("4B 03 01 20 0A", "CB 00");
    bench.asks("0E 05 04 0E", "8E 20042402 3003");
    // The poll connection has a path of its own.
    bench.asks("4B 03 01 02 0A", "CB 00");
    bench.asks("0E 05 02 0E", "8E 20042401");
}

#[test]
fn production_inhibit_is_set_before_the_rate_and_never_exceeds_it() {
    let mut bench = Bench::with(COS_UNACKNOWLEDGED);
    bench.asks("10 05 04 11 C8", "94 13 FF");
    bench.asks("10 05 04 11 C8 00 00", "94 15 FF");
    bench.asks("10 05 04 11 C8 00", "90 C800");
    bench.asks("10 05 04 09 C7 00", "94 09 11");
    bench.asks("0E 05 04 01", "8E 01");
    bench.asks("0E 05 04 09", "8E 0000");
    bench.hears("42C#0A10050409C800");
    assert_eq!(bench.collect(), ["345#01000000", "42B#0A90C800"]);
    bench.asks("10 05 04 11 01 00", "94 0C FF");
    bench.asks("10 05 04 09 C7 00", "94 09 11");
    bench.asks("0E 05 04 09", "8E C800");
    // Rate 0 means no rate, and no inhibit time exceeds that.
    bench.asks("10 05 04 09 00 00", "90 0000");
}

#[test]
fn nothing_is_produced_while_configuring() {
    let mut bench = Bench::with(COS);
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::from_secs(5)), [""; 0]);
    assert!(!bench.node.server.watches_changes());
}

#[test]
fn a_change_is_produced_and_no_change_is_not() {
    let mut bench = producing("0000");
    assert_eq!(bench.wait(Duration::from_secs(100_000)), [""; 0], "rate 0: never by time");
    for count in 2..5 {
        bench.node.toy.moved = true;
        assert_eq!(bench.wait(Duration::from_millis(1)), [format!("345#{count:02X}000000")]);
        assert_eq!(bench.wait(Duration::from_secs(60)), [""; 0]);
    }
}

#[test]
fn changes_that_wait_for_the_wire_make_one_frame() {
    let mut bench = producing("0000");
    for _ in 0..3 {
        bench.node.toy.moved = true;
        bench.node.server.advance(bench.now, &mut bench.node.toy);
    }
    assert_eq!(bench.collect(), ["345#02000000"]);
}

#[test]
fn a_production_comes_when_the_rate_elapses_and_each_one_starts_it_anew() {
    let mut bench = producing("6400");
    assert_eq!(bench.wait(Duration::from_nanos(99_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#02000000"]);
    bench.wait(Duration::from_millis(60));
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::ZERO), ["345#03000000"]);
    assert_eq!(bench.wait(Duration::from_nanos(99_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#04000000"]);
}

#[test]
fn a_rate_set_later_counts_from_then() {
    let mut bench = producing("6400");
    bench.wait(Duration::from_millis(50));
    bench.asks("10 05 04 09 0A 00", "90 0A00");
    assert_eq!(bench.wait(Duration::from_nanos(9_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#02000000"]);
    bench.asks("10 05 04 09 00 00", "90 0000");
    assert_eq!(bench.wait(Duration::from_secs(1_000)), [""; 0]);
}

#[test]
fn the_inhibit_time_is_the_shortest_gap_between_productions() {
    let mut bench = Bench::with(COS_UNACKNOWLEDGED);
    bench.asks("10 05 04 11 32 00", "90 3200");
    bench.hears("42C#0A100504090000");
    assert_eq!(bench.collect().len(), 2);
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::from_nanos(49_999_999)), [""; 0]);
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#02000000"]);
    // Later than the gap, a change is produced at once.
    bench.wait(Duration::from_millis(51));
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::ZERO), ["345#03000000"]);
    // Data that change all the time come at the inhibit time.
    let mut frames = Vec::new();
    for _ in 0..1_000 {
        bench.node.toy.moved = true;
        frames.extend(bench.log(Duration::from_millis(1)));
    }
    assert_eq!(frames.len(), 20, "in a second of 50 ms gaps");
    assert!(frames.windows(2).all(|two| two[1].0 == two[0].0 + Duration::from_millis(50)));
}

#[test]
fn without_acknowledges_the_connection_never_times_out() {
    let mut bench = producing("E803");
    bench.says("42A#", &[]);
    let frames = bench.log(Duration::from_secs(3_600));
    assert_eq!(frames.len(), 3_600);
    assert_eq!(bench.node.server.connection_state(4), Some(State::Established));
    assert_eq!(bench.node.server.status(), NetworkStatus::Connected);
}

#[test]
fn poll_and_change_of_state_live_side_by_side_the_lower_identifier_first() {
    let mut bench = Bench::with(0x53);
    bench.asks("10 05 02 0E 20 04 24 02", "90");
    bench.asks("10 05 02 09 00 00", "90 0000");
    bench.hears("42C#0A100504090000");
    bench.hears("42D#");
    let expected = ["345#01000000", "3C5#0200000000", "42B#0A900000"];
    assert_eq!(bench.collect(), expected);
    bench.node.toy.moved = true;
    bench.says("42D#", &["345#03000000", "3C5#0400000000"]);
    bench.asks("4C 03 01 02", "CC");
    bench.says("42D#", &[]);
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::ZERO), ["345#05000000"]);
}

#[test]
fn a_poll_that_reveals_a_change_has_it_produced_at_once() {
    // The device looks at its shaft when the poll response is built; no other look follows.
    let mut bench = Bench::with(0x53);
    bench.asks("10 05 02 09 00 00", "90 0000");
    bench.hears("42C#0A100504090000");
    bench.collect();
    bench.node.toy.moves_when_produced = true;
    bench.says("42D#", &["3C5#02000000", "345#03000000"]);
}

#[test]
fn a_released_connection_produces_nothing_more() {
    for (choice, wrong) in [(COS, "20"), (CYCLIC, "10")] {
        for release in [choice & 0x30, choice & 0x30 | 0x40] {
            let mut bench = Bench::with(choice);
            bench.hears("42C#0A100504090A00");
            bench.collect();
            bench.asks(&format!("4C 03 01 {wrong}"), "94 0B 02");
            bench.asks("4C 03 01 30", "94 0B 02");
            bench.asks("4C 03 01 40", "94 09 02");
            bench.asks(&format!("4C 03 01 {release:02X}"), "CC");
            bench.node.toy.moved = true;
            assert_eq!(bench.wait(Duration::from_secs(20)), [""; 0]);
            assert_eq!(bench.node.server.connection_state(4), None);
            bench.asks("0E 05 04 01", "94 16 FF");
            bench.says("42A#", &[]);
        }
    }
}

#[test]
fn a_production_that_waits_for_the_wire_goes_with_its_connection() {
    let mut bench = producing("0000");
    bench.node.toy.moved = true;
    bench.node.server.advance(bench.now, &mut bench.node.toy);
    bench.hears("42E#0A4C030110");
    assert_eq!(bench.collect(), ["42B#0ACC"]);
}

#[test]
fn without_the_explicit_connection_an_established_one_goes_on_and_a_configuring_one_is_gone() {
    let mut bench = producing("E803");
    bench.says("42E#0A4C030101", &["42B#0ACC"]);
    assert_eq!(bench.wait(Duration::from_secs(5)).len(), 5);
    assert!(bench.node.server.master().is_some());
    let mut bench = Bench::with(COS);
    bench.says("42E#0A4C030101", &["42B#0ACC"]);
    assert_eq!(bench.node.server.connection_state(4), None);
    assert_eq!(bench.node.server.master(), None);
}
