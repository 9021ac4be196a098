//! Retries: what is repeated, and what only looks like a retry.

use codewheel_station::Duration;

use crate::bench::{Bench, SC, hex, octets, telegram};

const FIRST: &str = "68 07 07 68 07 02 7D 00 00 00 05 8B 16";

#[test]
fn a_retry_is_answered_with_the_stored_answer_and_executes_nothing() {
    let mut bench = Bench::exchanging();
    let answer = "68 07 07 68 02 07 08 00 00 12 34 57 16";
    bench.says(FIRST, answer);
    bench.toy.inputs = [9; 4];
    bench.says(FIRST, answer);
    bench.says(FIRST, answer);
    assert_eq!(bench.toy.told, ["00 00 00 05"], "taken once");
    assert_eq!(bench.slave.counters().retries, 2);
}

#[test]
fn a_toggled_frame_count_bit_makes_the_same_request_new() {
    let mut bench = Bench::exchanging();
    bench.says(FIRST, "68 07 07 68 02 07 08 00 00 12 34 57 16");
    bench.toy.inputs = [0; 4];
    bench.says(&telegram(7, 2, 0x5D, None, "00 00 00 05"), &telegram(2, 7, 8, None, "00 00 00 00"));
    assert_eq!(bench.toy.told.len(), 2);
}

/// A master that lost our answers gives up its Data_Exchange and falls back to Slave_Diag, with
/// the frame count bit as it was. A slave that goes by the bit alone answers it with inputs for
/// ever.
#[test]
fn another_request_with_an_unchanged_frame_count_bit_is_new() {
    let mut bench = Bench::exchanging();
    bench.says(FIRST, "68 07 07 68 02 07 08 00 00 12 34 57 16");
    let diagnosis = telegram(7, 2, 0x7D, Some((60, 62)), "");
    let expected = telegram(2, 7, 8, Some((62, 60)), "00 0C 00 02 05 9B 02 00");
    bench.says(&diagnosis, &expected);
    bench.says(&diagnosis, &expected);
    assert_eq!(bench.slave.counters().retries, 1, "the second one was a retry");
}

#[test]
fn the_same_octets_but_one_are_new_with_an_unchanged_bit() {
    let mut bench = Bench::exchanging();
    bench.says(FIRST, "68 07 07 68 02 07 08 00 00 12 34 57 16");
    bench.hears(&telegram(7, 2, 0x7D, None, "00 00 00 06"));
    assert_eq!(bench.toy.told, ["00 00 00 05", "00 00 00 06"]);
}

#[test]
fn a_first_request_is_executed_however_often_it_comes() {
    let mut bench = Bench::exchanging();
    for times in 1..=3 {
        bench.hears(&telegram(7, 2, 0x6D, None, "00 00 00 05"));
        assert_eq!(bench.toy.told.len(), times);
        bench.answer();
    }
}

#[test]
fn a_request_outside_the_count_is_executed_and_not_stored() {
    let mut bench = Bench::exchanging();
    let outside = telegram(7, 2, 0x4D, None, "00 00 00 06");
    for request in [FIRST, &outside, &outside, FIRST] {
        bench.hears(request);
        bench.answer();
    }
    assert_eq!(bench.toy.told.len(), 4, "each was executed");
    assert_eq!(bench.slave.counters().retries, 0);
}

#[test]
fn the_stored_answer_is_dropped_when_the_master_has_gone_on() {
    for (what, between) in [
        ("a token", "DC 02 02".to_owned()),
        ("FDL status", "10 07 02 49 52 16".to_owned()),
        ("a request to another station", telegram(8, 2, 0x7D, None, "")),
        ("SDN to another station", telegram(8, 2, 0x46, Some((58, 62)), "00 00")),
        ("another master's request", telegram(7, 3, 0x6D, Some((60, 62)), "")),
    ] {
        let mut bench = Bench::exchanging();
        bench.hears(FIRST);
        bench.answer();
        bench.hears(&between);
        bench.answer();
        bench.hears(FIRST);
        assert_eq!(bench.toy.told.len(), 2, "after {what} it is no retry");
    }
}

#[test]
fn what_is_no_request_of_a_master_leaves_the_stored_answer() {
    for (what, between) in [
        ("Global_Control", telegram(127, 2, 0x46, Some((58, 62)), "00 00")),
        ("another slave's answer", telegram(2, 8, 0x08, None, "01")),
        ("another slave's acknowledge", SC.to_owned()),
        ("garbage", "10 07 02 49 53 16".to_owned()),
    ] {
        let mut bench = Bench::exchanging();
        bench.hears(FIRST);
        bench.answer();
        bench.says(&between, "");
        bench.hears(FIRST);
        assert_eq!(bench.toy.told.len(), 1, "after {what} it is a retry");
    }
}

#[test]
fn a_retry_of_what_changed_the_state_is_not_executed_again() {
    let mut bench = Bench::parameterized();
    let request = bench.request(2, Some(62), "F1");
    bench.says(&request, SC);
    bench.says(&request, SC);
    assert_eq!(bench.toy.told, ["begin"]);
}

#[test]
fn an_answer_that_never_left_is_built_when_the_retry_comes() {
    let mut bench = Bench::exchanging();
    bench.hears(FIRST);
    // Noise before the slave could answer.
    bench.hears_after(2, &octets("00"));
    assert_eq!(bench.answer(), "");
    bench.toy.inputs = [1, 2, 3, 4];
    bench.says(FIRST, &telegram(2, 7, 8, None, "01 02 03 04"));
    assert_eq!(bench.toy.told, ["00 00 00 05"], "taken once");
}

#[test]
fn the_longest_request_is_remembered_whole() {
    let mut bench = Bench::power_up();
    let user = hex(&[0x55; 236]);
    let request = |last: &str| {
        telegram(7, 2, 0x7D, Some((61, 62)), &format!("80 0 0 0 5 9B 0 {user} {last}"))
    };
    bench.says(&request("01"), SC);
    bench.says(&request("01"), SC);
    bench.says(&request("02"), SC);
    assert_eq!(bench.slave.counters().retries, 1);
    assert_eq!(bench.toy.events.len(), 2, "parameterized twice");
}

#[test]
fn a_retry_after_the_watchdog_and_a_new_bring_up_is_new() {
    let mut bench = Bench::exchanging();
    let request = telegram(7, 2, 0x7D, None, "00 00 00 05");
    bench.says(&request, &telegram(2, 7, 8, None, "00 00 12 34"));
    bench.wait(Duration::from_millis(200));
    let mut bench = bench.then_exchanging();
    bench.says(&request, &telegram(2, 7, 8, None, "00 00 12 34"));
    assert_eq!(bench.toy.told, ["00 00 00 05"]);
    // A replay retriggers, and its DH is the stored one.
    for _ in 0..10 {
        bench.wait(Duration::from_millis(150));
        bench.says(&request, &telegram(2, 7, 8, None, "00 00 12 34"));
    }
}

#[test]
fn fdl_status_is_never_a_retry() {
    let mut bench = Bench::exchanging();
    for code in [0x49, 0x59, 0x69, 0x79] {
        let request = telegram(7, 2, code, None, "");
        bench.says(&request, "10 02 07 00 09 16");
        bench.says(&request, "10 02 07 00 09 16");
    }
    assert_eq!(bench.slave.counters().retries, 0);
}

#[test]
fn a_retry_with_frame_count_bit_0_executes_nothing_either() {
    let mut bench = Bench::exchanging();
    let request = telegram(7, 2, 0x5D, None, "00 00 00 05");
    bench.hears(&request);
    bench.answer();
    bench.hears(&request);
    assert_eq!(bench.toy.told, ["00 00 00 05"]);
    assert_eq!(bench.slave.counters().retries, 1);
}
