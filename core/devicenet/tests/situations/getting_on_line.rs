//! The duplicate MAC ID check (devicenet clause 2).

use codewheel_devicenet::{Event, Fault, NetworkStatus};
use codewheel_station::can::Input;
use codewheel_station::{Duration, Instant, Station};

use crate::bench::{Bench, frame};

const REQUEST: &str = "42F#0034120DF0FECA";
const RESPONSE: &str = "42F#8034120DF0FECA";

#[test]
fn two_requests_a_second_apart_then_on_line_after_two_seconds() {
    let mut bench = Bench::power_up();
    assert_eq!(bench.collect(), [REQUEST]);
    assert_eq!(bench.wait(Duration::from_millis(999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_millis(1)), [REQUEST]);
    bench.wait(Duration::from_nanos(999_999_999));
    assert_eq!(bench.node.server.status(), NetworkStatus::NotOnLine);
    bench.wait(Duration::from_nanos(1));
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
    assert_eq!(bench.now, Instant::ZERO + Duration::from_secs(2));
}

#[test]
fn a_request_that_nobody_acknowledges_leaves_the_node_off_line_for_ever() {
    let mut bench = Bench::power_up();
    let request = bench.node.transmit(bench.now).expect("the first request");
    assert_eq!(bench.node.transmit(bench.now), None, "the controller repeats it by itself");
    assert_eq!(bench.node.deadline(), None);
    bench.now = Instant::ZERO + Duration::from_secs(3_600);
    bench.node.handle(bench.now, Input::Sent(&request));
    assert_eq!(bench.node.deadline(), Some(bench.now + Duration::from_secs(1)));
}

#[test]
fn a_request_or_response_with_our_mac_during_the_check_is_a_fault() {
    for message in [REQUEST, RESPONSE] {
        let mut bench = Bench::power_up();
        bench.collect();
        bench.says(message, &[]);
        assert_eq!(bench.node.server.status(), NetworkStatus::Faulted(Fault::DuplicateMac));
        assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
        assert_eq!(bench.node.toy.events, [Event::Faulted(Fault::DuplicateMac)]);
    }
}

#[test]
fn on_line_a_request_with_our_mac_is_answered_and_the_node_stays() {
    let mut bench = Bench::on_line();
    bench.says("42F#00D40178563412", &[RESPONSE]);
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
}

#[test]
fn on_line_a_response_with_our_mac_silences_the_node_until_power_up() {
    let mut bench = Bench::polled();
    bench.says(RESPONSE, &[]);
    assert_eq!(bench.node.server.status(), NetworkStatus::Faulted(Fault::DuplicateMac));
    bench.says("42D#", &[]);
    bench.says("42E#0A4B0301030A", &[]);
    bench.says("42F#00D40178563412", &[]);
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
}

#[test]
fn before_the_node_is_on_line_no_service_is_answered() {
    let mut bench = Bench::power_up();
    bench.collect();
    bench.wait(Duration::from_millis(1_500));
    bench.says("42E#0A4B0301030A", &[]);
    bench.says("42C#0A0E010101", &[]);
    bench.says("42D#", &[]);
}

#[test]
fn a_check_message_of_another_length_or_another_mac_means_nothing() {
    let mut bench = Bench::power_up();
    bench.collect();
    for message in ["42F#", "42F#00341200000000 00", "42F#80", "437#8034120DF0FECA"] {
        bench.says(message, &[]);
    }
    bench.wait(Duration::from_secs(2));
    assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
}

#[test]
fn a_remote_frame_is_no_message() {
    let mut bench = Bench::on_line();
    let remote = codewheel_station::can::Frame::remote(frame("42E#").identifier(), 6).unwrap();
    bench.node.handle(bench.now, Input::Frame(&remote));
    assert_eq!(bench.collect(), [""; 0]);
}
