//! Several telegrams in one piece, and one in several, as ports and networks deliver them.

use codewheel_profibus::State;
use codewheel_station::rs485::Input;

use crate::bench::{Bench, octets, telegram};

const FDL_STATUS: &str = "10 07 02 49 52 16";
const ANSWER: &str = "10 02 07 00 09 16";

#[test]
fn a_token_and_a_request_in_one_piece_are_both_taken() {
    let mut bench = Bench::on_a_pc();
    bench.says(&format!("DC 02 02 {FDL_STATUS}"), ANSWER);
    assert_eq!(bench.slave.counters().telegrams, 2);
}

#[test]
fn a_request_that_others_follow_in_the_same_piece_is_executed_and_not_answered() {
    let mut bench = Bench::parameterized();
    let request = bench.request(2, Some(62), "F1");
    bench.says(&format!("{request} DC 03 02"), "");
    assert_eq!(bench.slave.state(), State::DataExchange);
    let request = bench.request(2, None, "00 00 00 05");
    bench.says(&format!("{request} 10 07"), "");
}

#[test]
fn of_two_requests_in_one_piece_the_last_is_answered() {
    let mut bench = Bench::on_a_pc();
    let diagnosis = bench.request(2, Some(60), "");
    bench.says(&format!("{diagnosis} {FDL_STATUS}"), ANSWER);
    assert_eq!(bench.slave.counters().requests, 2);
}

#[test]
fn a_request_and_the_answer_of_another_slave_in_one_piece_are_both_taken() {
    let mut bench = Bench::on_a_pc();
    let others = format!("{} {}", telegram(8, 2, 0x7D, None, ""), telegram(2, 8, 8, None, "01 02"));
    bench.says(&format!("{others} E5 {FDL_STATUS}"), ANSWER);
    assert_eq!(bench.slave.counters().telegrams, 4);
}

#[test]
fn a_piece_may_end_the_telegram_before_and_begin_the_next() {
    let mut bench = Bench::on_a_pc();
    let stream = octets(&format!("DC 02 02 {} {FDL_STATUS}", telegram(8, 2, 0x7D, None, "01")));
    for pieces in 1..stream.len() {
        for piece in stream.chunks(pieces) {
            bench.slave.handle(bench.now, Input::Octets(piece), &mut bench.toy);
        }
        assert_eq!(bench.answer(), ANSWER, "{pieces} octets at a time");
    }
    assert_eq!(bench.slave.counters().broken, 0);
}

#[test]
fn with_bit_times_what_follows_without_a_pause_is_no_request() {
    let mut bench = Bench::power_up();
    bench.says(&format!("DC 02 02 {FDL_STATUS}"), "");
    assert_eq!((bench.slave.counters().telegrams, bench.slave.counters().broken), (2, 1));
    bench.says(FDL_STATUS, ANSWER);
}

#[test]
fn no_octets_at_all_are_nothing() {
    let mut bench = Bench::on_a_pc();
    bench.hears(FDL_STATUS);
    bench.slave.handle(bench.now, Input::Octets(&[]), &mut bench.toy);
    assert_eq!(bench.answer(), ANSWER);
}
