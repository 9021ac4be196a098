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

#[test]
fn an_empty_last_fragment_ends_the_message() {
    // A body of exactly 6·k octets whose sender ends it with nothing.
    let mut bench = Bench::allocated();
    bench.says("42C#8A001064010134 12", &["42B#8AC000"]);
    bench.says("42C#8A81", &["42B#8AC100", "42B#0A90"]);
    assert_eq!(bench.node.toy.value, 0x1234);
}

#[test]
fn another_transaction_or_another_master_does_not_go_on_with_a_message() {
    for stranger in ["42C#CA813412", "42C#8B813412"] {
        let mut bench = Bench::allocated();
        bench.says("42C#8A001064010134", &["42B#8AC000"]);
        bench.says(stranger, &[]);
        assert_eq!(bench.node.toy.value, 0);
    }
    // A first fragment of another transaction begins a message of its own.
    let mut bench = Bench::allocated();
    bench.says("42C#8A00106401013412", &["42B#8AC000"]);
    bench.says("42C#CA00106401017856", &["42B#CAC000"]);
    bench.says("42C#CA81", &["42B#CAC100", "42B#4A90"]);
    assert_eq!(bench.node.toy.value, 0x5678);
}

#[test]
fn a_first_and_only_fragment_repeated_while_its_answer_is_on_its_way_is_acknowledged_only() {
    let mut bench = Bench::allocated();
    bench.hears("42C#8A3F1064010134");
    bench.collect();
    // A long answer: the repeated request must not begin it anew.
    bench.says("42C#8A3F0E640102", &["42B#8AFF00", "42B#8A008E6120746578"]);
    bench.says("42C#8A3F0E640102", &["42B#8AFF00"]);
    bench.says("42C#8AC000", &["42B#8A41742074686174"]);
    // A service that is carried out later, likewise.
    let mut bench = Bench::allocated();
    bench.says("42C#8A3F166401", &["42B#8AFF00"]);
    bench.says("42C#8A3F166401", &["42B#8AFF00"]);
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), ["42B#0A96"]);
    // Once the answer is out, the same octets are a new request.
    bench.says("42C#8A3F166401", &["42B#8AFF00"]);
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), ["42B#0A96"]);
}

#[test]
fn the_last_fragment_of_a_release_is_acknowledged_although_its_connection_is_gone() {
    let mut bench = Bench::allocated();
    bench.says("42C#8A004C030101", &["42B#8AC000"]);
    bench.says("42C#8A81", &["42B#8AC100", "42B#0ACC"]);
    assert_eq!(bench.node.server.master(), None);
    let mut bench = Bench::allocated();
    bench.says("42C#CA3F4C030103", &["42B#CAFF00", "42B#4ACC"]);
    assert_eq!(bench.node.server.master(), None);
}

#[test]
fn other_frames_on_message_3_do_not_prolong_the_wait_for_an_acknowledge() {
    let mut bench = Bench::with(0x01);
    bench.asks("10 01 01 0A 01", "90");
    bench.says("42C#0A0E640102", &["42B#8A008E6120746578"]);
    let start = bench.now;
    bench.wait(Duration::from_millis(600));
    // A refusal to another master goes out under the same identifier, and so does the heartbeat.
    bench.says("42E#0B4B0301030B", &["42B#0B940C01"]);
    let frames = bench.log(Duration::from_millis(400));
    let after = start + Duration::from_secs(1);
    assert!(frames.contains(&(after, "42B#8A008E6120746578".to_owned())), "{frames:?}");
    bench.says("42E#0B4B0301030B", &["42B#0B940C01"]);
    bench.wait(Duration::from_secs(1));
    assert_eq!(bench.node.toy.events.last(), Some(&Event::ResponseGivenUp));
}

#[test]
fn the_wait_for_an_acknowledge_begins_when_the_fragment_is_on_the_wire() {
    let mut bench = Bench::with(0x01);
    bench.hears("42C#0A0E640102");
    let fragment = bench.hands_out().expect("the first fragment");
    bench.now += Duration::from_millis(700);
    bench.is_sent(&fragment);
    assert_eq!(bench.wait(Duration::from_nanos(999_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["42B#8A008E6120746578"]);
}
