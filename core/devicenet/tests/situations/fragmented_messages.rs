//! Fragmented requests and responses (devicenet clause 4).

use codewheel_devicenet::Event;
use codewheel_station::Duration;

use crate::bench::{Bench, TEXT, to_hex};

#[test]
fn a_request_that_does_not_fit_a_frame_comes_in_acknowledged_fragments() {
    let mut bench = Bench::allocated();
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    // The response follows the acknowledge of the last fragment.
    bench.says("42C#8A8100 00", &["42B#8AC100", "42B#0A90"]);
    assert_eq!(bench.node.toy.value, 0x1234);
}

#[test]
fn a_first_fragment_with_count_3f_is_the_only_one() {
    let mut bench = Bench::allocated();
    bench.says("42C#CA3F0E640101", &["42B#CAFF00", "42B#4A8E0000"]);
}

#[test]
fn a_response_that_does_not_fit_a_frame_comes_in_fragments() {
    let mut bench = Bench::allocated();
    bench.says("42C#0A0E640102", &["42B#8A008E612074657874".get(..20).unwrap_or_default()]);
    let mut bench = Bench::allocated();
    bench.asks("0E 64 01 02", &format!("8E {}", to_hex(TEXT)));
}

#[test]
fn an_unacknowledged_fragment_is_repeated_after_a_second_then_given_up() {
    let mut bench = Bench::allocated();
    bench.says("42C#0A0E640102", &["42B#8A008E6120746578"]);
    assert_eq!(bench.wait(Duration::from_millis(999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_millis(1)), ["42B#8A008E6120746578"]);
    assert_eq!(bench.wait(Duration::from_secs(5)), [""; 0]);
    assert_eq!(bench.node.toy.events.last(), Some(&Event::ResponseGivenUp));
    bench.asks("0E 01 01 01", "8E 3412");
}

#[test]
fn an_acknowledge_with_a_wrong_count_is_ignored_and_one_with_an_error_ends_the_response() {
    let mut bench = Bench::allocated();
    bench.says("42C#0A0E640102", &["42B#8A008E6120746578"]);
    bench.says("42C#8AC100", &[]);
    bench.says("42C#8AC000", &["42B#8A417420746861 74".replace(' ', "").as_str()]);
    bench.says("42C#8AC101", &[]);
    assert_eq!(bench.wait(Duration::from_secs(3)), [""; 0]);
}

#[test]
fn a_repeated_fragment_is_acknowledged_again_and_not_appended() {
    let mut bench = Bench::allocated();
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    bench.says("42C#8A810000", &["42B#8AC100", "42B#0A90"]);
    bench.says("42C#8A810000", &["42B#8AC100"]);
}

#[test]
fn a_wrong_count_and_a_wrong_first_count_are_dropped_without_an_answer() {
    let mut bench = Bench::allocated();
    bench.says("42C#8A01106401013412", &[]);
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    bench.says("42C#8A820000", &[]);
    bench.says("42C#8A810000", &[]);
    assert_eq!(bench.node.toy.value, 0);
}

#[test]
fn an_unfragmented_message_ends_a_reassembly() {
    let mut bench = Bench::allocated();
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    bench.says("42C#0A0E640101", &["42B#0A8E0000"]);
    bench.says("42C#8A810000", &[]);
}

#[test]
fn a_request_longer_than_64_octets_is_acknowledged_with_too_much_data() {
    let mut bench = Bench::allocated();
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    for count in 1..10 {
        let fragment = format!("42C#8A{:02X}000000000000", 0x40 | count);
        bench.says(&fragment, &[&format!("42B#8A{:02X}00", 0xC0 | count)]);
    }
    bench.says("42C#8A4A000000000000", &["42B#8ACA01"]);
    bench.says("42C#8A8B00", &[]);
    bench.asks("0E 64 01 01", "8E 0000");
}
