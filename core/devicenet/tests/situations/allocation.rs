//! The unconnected port, allocation and release (devicenet clause 3).

use codewheel_devicenet::connection::State;
use codewheel_devicenet::{Event, MacId, NetworkStatus};
use codewheel_station::Duration;

use crate::bench::Bench;

#[test]
fn allocate_is_answered_with_exactly_three_octets_and_echoes_mac_and_xid() {
    let mut bench = Bench::on_line();
    bench.says("42E#4A4B0301030A", &["42B#4ACB00"]);
    assert_eq!(bench.node.server.master(), MacId::new(10));
    assert_eq!(bench.node.server.connection_state(1), Some(State::Established));
    assert_eq!(bench.node.server.connection_state(2), Some(State::Configuring));
    assert_eq!(bench.node.server.status(), NetworkStatus::Connected);
}

#[test]
fn the_refusals_come_in_the_order_of_the_checks() {
    let mut free = Bench::on_line();
    // choice 0; acknowledge suppression alone; unsupported bits; no explicit connection
    free.says("42E#0A4B0301000A", &["42B#0A940902"]);
    free.says("42E#0A4B0301400A", &["42B#0A940902"]);
    free.says("42E#0A4B0301410A", &["42B#0A940902"]);
    free.says("42E#0A4B0301050A", &["42B#0A940202"]);
    free.says("42E#0A4B0301090A", &["42B#0A940202"]);
    free.says("42E#0A4B0301810A", &["42B#0A940202"]);
    free.says("42E#0A4B0301020A", &["42B#0A940902"]);
    assert_eq!(free.node.server.master(), None);
    let mut owned = Bench::allocated();
    // another master, whatever it asks for; then what exists already
    owned.says("42E#0B4B0301000B", &["42B#0B940C01"]);
    owned.says("42E#0B4B0301030B", &["42B#0B940C01"]);
    owned.says("42E#0A4B0301030A", &["42B#0A940B02"]);
    owned.says("42E#0A4B0301020A", &["42B#0A940B02"]);
    owned.says("42E#0A4B0301010A", &["42B#0A940B02"]);
    assert_eq!(owned.node.server.master(), MacId::new(10));
}

#[test]
fn an_allocator_address_above_63_owns_nothing() {
    let mut bench = Bench::on_line();
    bench.says("42E#0A4B03010340", &["42B#0A9409FF"]);
    assert_eq!(bench.node.server.master(), None);
}

#[test]
fn the_poll_connection_can_follow_the_explicit_one() {
    let mut bench = Bench::on_line();
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
    bench.says("42E#0A4B0301020A", &["42B#0ACB00"]);
    assert_eq!(bench.node.server.connection_state(2), Some(State::Configuring));
}

#[test]
fn allocate_and_release_work_over_the_explicit_connection_too() {
    let mut bench = Bench::on_line();
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
    bench.asks("4B 03 01 02 0A", "CB 00");
    bench.asks("4C 03 01 02", "CC");
    assert_eq!(bench.node.server.connection_state(2), None);
    bench.asks("4C 03 01 01", "CC");
    assert_eq!(bench.node.server.master(), None);
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
}

#[test]
fn anything_else_on_the_unconnected_port_is_refused_there() {
    let mut bench = Bench::on_line();
    for message in ["42E#0A0E010101", "42E#0A4B0302030A", "42E#0A4B0401030A", "42E#8A004B03010303"]
    {
        bench.says(message, &["42B#0A940203"]);
    }
}

#[test]
fn too_short_and_too_long_allocations_are_told_apart() {
    let mut bench = Bench::on_line();
    bench.says("42E#0A4B", &["42B#0A9413FF"]);
    bench.says("42E#0A4B03", &["42B#0A9413FF"]);
    bench.says("42E#0A4B030103", &["42B#0A9413FF"]);
    bench.says("42E#0A4B0301030A00", &["42B#0A9415FF"]);
    bench.says("42E#0A4C0301", &["42B#0A9413FF"]);
    assert_eq!(bench.node.server.master(), None);
}

#[test]
fn an_empty_frame_a_lone_header_and_a_response_get_no_answer() {
    let mut bench = Bench::on_line();
    for message in ["42E#", "42E#0A", "42E#0ACB00", "42E#0A94020F"] {
        bench.says(message, &[]);
    }
}

#[test]
fn the_refusals_of_release() {
    let mut bench = Bench::allocated();
    bench.says("42E#0A4C030100", &["42B#0A940902"]);
    bench.says("42E#0A4C030104", &["42B#0A940202"]);
    bench.says("42E#0B4C030103", &["42B#0B940C01"]);
    bench.says("42E#0A4C030102", &["42B#0ACC"]);
    bench.says("42E#0A4C030102", &["42B#0A940B02"]);
    bench.says("42E#0A4C030103", &["42B#0A940B02"]);
    assert_eq!(bench.node.server.connection_state(1), Some(State::Established));
}

#[test]
fn a_master_that_dies_before_it_sets_a_rate_locks_nobody_out() {
    let mut bench = Bench::allocated();
    bench.wait(Duration::from_secs(10));
    assert_eq!(bench.node.server.master(), None);
    assert_eq!(bench.node.server.connection_state(2), None);
    assert!(bench.node.toy.events.contains(&Event::Forgotten));
    bench.says("42E#0B4B0301030B", &["42B#0BCB00"]);
}

#[test]
fn releasing_the_explicit_connection_takes_a_configuring_poll_connection_along() {
    let mut bench = Bench::allocated();
    bench.says("42E#0A4C030101", &["42B#0ACC"]);
    assert_eq!(bench.node.server.connection_state(2), None);
    assert_eq!(bench.node.server.master(), None);
}

#[test]
fn releasing_the_explicit_connection_leaves_an_established_poll_connection() {
    let mut bench = Bench::polled();
    bench.says("42E#0A4C030101", &["42B#0ACC"]);
    bench.says("42D#", &["3C5#01000000"]);
    assert_eq!(bench.node.server.master(), MacId::new(10));
    bench.says("42E#0A4B0301010A", &["42B#0ACB00"]);
}

#[test]
fn requests_of_a_stranger_and_requests_without_a_connection_are_dropped() {
    let mut free = Bench::on_line();
    free.says("42C#0A0E010101", &[]);
    let mut owned = Bench::allocated();
    owned.says("42C#0B0E010101", &[]);
}

#[test]
fn a_timed_out_poll_connection_may_be_allocated_anew() {
    let mut bench = Bench::polled();
    // The explicit connection is kept alive while the poll connection starves.
    for _ in 0..11 {
        bench.wait(Duration::from_secs(1));
        bench.asks("0E 05 01 01", "8E 03");
    }
    assert_eq!(bench.node.server.connection_state(2), Some(State::TimedOut));
    bench.says("42E#0A4B0301020A", &["42B#0ACB00"]);
    assert_eq!(bench.node.server.connection_state(2), Some(State::Configuring));
}

#[test]
fn an_allocator_above_63_is_looked_at_after_the_owner() {
    let mut owned = Bench::allocated();
    owned.says("42E#0B4B03010340", &["42B#0B940C01"]);
    owned.says("42E#0A4B030103FF", &["42B#0A940C01"]);
    assert_eq!(owned.node.server.master(), MacId::new(10));
}

#[test]
fn a_refusal_to_another_master_does_not_overwrite_the_success_owed_to_the_first() {
    let mut bench = Bench::on_line();
    bench.hears("42E#0A4B0301030A");
    bench.hears("42E#0B4B0301030B");
    bench.hears("42E#0C0E010101");
    assert_eq!(bench.collect(), ["42B#0ACB00"]);
    // The release is good news as well.
    bench.hears("42E#0A4C030103");
    bench.hears("42E#0B4C030103");
    assert_eq!(bench.collect(), ["42B#0ACC"]);
    // A refusal that waits makes room for a success.
    bench.hears("42E#0B4B0301000B");
    bench.hears("42E#0A4B0301030A");
    assert_eq!(bench.collect(), ["42B#0ACB00"]);
}
