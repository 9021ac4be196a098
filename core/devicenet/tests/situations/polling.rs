//! Polls and their time-outs (devicenet clauses 5 and 6).

use codewheel_devicenet::connection::State;
use codewheel_devicenet::{Event, NetworkStatus};
use codewheel_station::can::Input;
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, frame};

#[test]
fn a_poll_is_answered_with_the_chosen_assembly() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 02 0E 20 04 24 02", "90");
    bench.asks("10 05 02 09 64 00", "90 6400");
    bench.says("42D#", &["3C5#0100000000"]);
}

#[test]
fn a_poll_before_the_connection_is_established_is_not_answered() {
    let mut bench = Bench::allocated();
    bench.says("42D#", &[]);
    assert_eq!(bench.node.toy.produced, 0);
}

#[test]
fn a_poll_longer_than_the_consumed_size_is_dropped_and_feeds_no_watchdog() {
    let mut bench = Bench::polled();
    bench.says("42D#", &["3C5#01000000"]);
    bench.wait(Duration::from_millis(399));
    bench.says("42D#00", &[]);
    bench.wait(Duration::from_millis(1));
    assert_eq!(bench.node.server.connection_state(2), Some(State::TimedOut));
    assert!(bench.node.toy.events.contains(&Event::PollTooLong { length: 1 }));
}

#[test]
fn polls_that_wait_for_the_wire_are_answered_once_with_the_newest_data() {
    let mut bench = Bench::polled();
    for _ in 0..3 {
        bench.node.handle(bench.now, Input::Frame(&frame("42D#")));
    }
    assert_eq!(bench.collect(), ["3C5#01000000"]);
}

#[test]
fn a_poll_response_goes_before_an_explicit_response() {
    let mut bench = Bench::polled();
    bench.node.handle(bench.now, Input::Frame(&frame("42C#0A0E010103")));
    bench.node.handle(bench.now, Input::Frame(&frame("42D#")));
    assert_eq!(bench.collect(), ["3C5#01000000", "42B#0A8E0B00"]);
}

#[test]
fn the_first_inactivity_time_is_ten_seconds_then_four_times_the_rate() {
    let mut bench = Bench::polled();
    bench.asks("10 05 01 09 00 00", "90 0000");
    bench.wait(Duration::from_nanos(9_999_999_999));
    assert_eq!(bench.node.server.connection_state(2), Some(State::Established));
    bench.says("42D#", &["3C5#01000000"]);
    bench.wait(Duration::from_nanos(399_999_999));
    assert_eq!(bench.node.server.connection_state(2), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(bench.node.server.connection_state(2), Some(State::TimedOut));
    assert_eq!(bench.node.server.status(), NetworkStatus::TimedOut);
    bench.says("42D#", &[]);
}

#[test]
fn a_reset_revives_a_timed_out_connection() {
    let mut bench = Bench::polled();
    bench.asks("10 05 01 09 00 00", "90 0000");
    bench.says("42D#", &["3C5#01000000"]);
    bench.wait(Duration::from_millis(400));
    bench.asks("0E 05 02 01", "8E 04");
    bench.asks("05 05 02", "85");
    bench.asks("0E 05 02 01", "8E 03");
    bench.says("42D#", &["3C5#02000000"]);
    assert_eq!(bench.node.server.status(), NetworkStatus::Connected);
}

#[test]
fn auto_delete_and_auto_reset_do_as_they_say() {
    let mut deleted = Bench::polled();
    deleted.asks("10 05 01 09 00 00", "90 0000");
    deleted.asks("10 05 02 0C 01", "90");
    deleted.wait(Duration::from_secs(10));
    assert_eq!(deleted.node.server.connection_state(2), None);
    let mut reset = Bench::polled();
    reset.asks("10 05 01 09 00 00", "90 0000");
    reset.asks("10 05 02 0C 02", "90");
    reset.wait(Duration::from_secs(20));
    assert_eq!(reset.node.server.connection_state(2), Some(State::Established));
    reset.says("42D#", &["3C5#01000000"]);
}

#[test]
fn rate_zero_never_times_out() {
    let mut bench = Bench::allocated();
    bench.asks("10 05 02 09 00 00", "90 0000");
    bench.wait(Duration::from_secs(100_000));
    assert_eq!(bench.node.server.connection_state(1), None);
    bench.says("42D#", &["3C5#01000000"]);
}

#[test]
fn when_the_last_connection_times_out_the_master_is_forgotten() {
    let mut bench = Bench::polled();
    // The explicit connection goes first (10 s without a request), then the polls stop.
    for _ in 0..110 {
        bench.wait(Duration::from_millis(100));
        bench.node.handle(bench.now, Input::Frame(&frame("42D#")));
        bench.collect();
    }
    assert_eq!(bench.node.server.connection_state(1), None);
    assert_eq!(bench.node.server.connection_state(2), Some(State::Established));
    bench.wait(Duration::from_millis(400));
    assert_eq!(bench.node.server.master(), None);
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
}
