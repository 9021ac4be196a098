//! A slave that must find the rate of its line.

use codewheel_profibus::{Baud, Event, State, Timing};
use codewheel_station::Duration;
use codewheel_station::rs485::{BaudRate, Input};

use crate::bench::{Bench, GOOD_PARAMETERS, SC, octets, telegram};

const FDL_STATUS: &str = "10 07 02 49 52 16";

fn dwell(rate: BaudRate) -> Duration {
    Duration::from_millis(50) + rate.bits(3_000)
}

impl Bench {
    fn searching() -> Self {
        let mut bench = Self::new(Baud::Search, Timing::Exact);
        bench.slave.advance(bench.now, &mut bench.toy);
        bench
    }

    /// Waits for the search to come to `rate`.
    fn until(mut self, rate: BaudRate) -> Self {
        while self.slave.baud_rate() != rate {
            let deadline = self.slave.deadline().expect("it searches");
            self.wait(deadline.since(self.now));
        }
        self
    }

    /// A telegram at the rate that the slave tries, after an idle line.
    fn hears_then(&mut self, hex: &str) -> bool {
        self.hears_after(40, &octets(hex));
        self.slave.has_baud_rate()
    }
}

#[test]
fn it_goes_from_the_highest_rate_down_and_round_again() {
    let mut bench = Bench::searching();
    for rate in BaudRate::ALL.into_iter().rev().cycle().take(25) {
        assert_eq!((bench.slave.baud_rate(), bench.slave.has_baud_rate()), (rate, false));
        bench.wait((bench.now + dwell(rate) - Duration::from_nanos(1)).since(bench.now));
        assert_eq!(bench.slave.baud_rate(), rate);
        bench.wait(Duration::from_nanos(1));
    }
}

#[test]
fn it_wants_its_first_call_at_once_and_dwells_from_there() {
    let mut bench = Bench::new(Baud::Search, Timing::Exact);
    assert!(bench.slave.deadline().is_some_and(|deadline| deadline <= bench.now));
    bench.slave.advance(bench.now, &mut bench.toy);
    assert_eq!(bench.slave.deadline(), Some(bench.now + dwell(BaudRate::Mbit12)));
}

#[test]
fn an_error_free_telegram_to_whomever_is_proof() {
    for hex in [
        FDL_STATUS.to_owned(),
        telegram(9, 3, 0x6D, Some((60, 62)), ""),
        telegram(3, 9, 0x08, None, "01 02"),
        "A2 07 02 08 01 02 03 04 05 06 07 08 35 16".to_owned(),
    ] {
        let mut bench = Bench::searching().until(BaudRate::Kbit187_5);
        assert!(bench.hears_then(&hex), "{hex}");
        assert_eq!(bench.slave.baud_rate(), BaudRate::Kbit187_5);
        assert_eq!(bench.toy.events, [Event::BaudRateFound(BaudRate::Kbit187_5)]);
    }
}

#[test]
fn what_has_no_checksum_and_what_is_broken_is_no_proof_and_not_counted() {
    for hex in ["DC 02 02", "E5", "10 07 02 49 53 16", "68 05 06", "FF"] {
        let mut bench = Bench::searching().until(BaudRate::Kbit187_5);
        assert!(!bench.hears_then(hex), "{hex}");
        assert_eq!(bench.slave.counters().broken, 0);
    }
    let mut bench = Bench::searching();
    bench.slave.handle(bench.now, Input::BrokenCharacter, &mut bench.toy);
    assert_eq!((bench.slave.has_baud_rate(), bench.slave.counters().broken), (false, 0));
}

#[test]
fn the_request_that_was_proof_is_answered() {
    let mut bench = Bench::searching().until(BaudRate::Mbit1_5);
    bench.hears_after(40, &octets(FDL_STATUS));
    let end = bench.now;
    let sent = bench.sends(Duration::from_millis(1));
    assert_eq!(sent, [(end + BaudRate::Mbit1_5.bits(11), "10 02 07 00 09 16".to_owned())]);
}

#[test]
fn a_telegram_that_ends_with_the_dwell_is_proof_of_the_rate_it_was_received_at() {
    let mut bench = Bench::searching().until(BaudRate::Mbit3);
    bench.now = bench.slave.deadline().expect("it searches");
    bench.slave.handle(bench.now, Input::Octets(&octets(FDL_STATUS)), &mut bench.toy);
    assert_eq!(bench.toy.events, [Event::BaudRateFound(BaudRate::Mbit3)]);
}

#[test]
fn after_a_change_of_rate_the_line_must_be_idle_first() {
    let mut bench = Bench::searching().until(BaudRate::Mbit3);
    bench.hears_after(10, &octets(FDL_STATUS));
    assert!(!bench.slave.has_baud_rate(), "it may be the middle of a telegram");
    assert!(bench.hears_then(FDL_STATUS));
}

#[test]
fn the_rate_is_lost_after_ten_dwells_of_silence_and_the_dp_state_is_kept() {
    let rate = BaudRate::Kbit500;
    let mut bench = Bench::searching().until(rate);
    bench.asks(2, Some(61), "80 00 00 0B 05 9B 00", SC);
    bench.asks(2, Some(62), "F1", SC);
    let request = bench.request(2, None, "00 00 00 00");
    bench.hears(&request);
    let last = bench.now;
    bench.answer();
    let lost = last + dwell(rate).times(10);
    bench.wait((lost - Duration::from_nanos(1)).since(bench.now));
    assert!(bench.slave.has_baud_rate());
    bench.wait(Duration::from_nanos(1));
    assert_eq!(bench.toy.events.last(), Some(&Event::BaudRateLost));
    assert_eq!((bench.slave.has_baud_rate(), bench.slave.baud_rate()), (false, BaudRate::Mbit12));
    assert_eq!(bench.slave.state(), State::DataExchange);
    let mut bench = bench.until(BaudRate::Kbit19_2);
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    assert_eq!(bench.toy.events.last(), Some(&Event::BaudRateFound(BaudRate::Kbit19_2)));
}

#[test]
fn only_proof_keeps_the_rate() {
    let rate = BaudRate::Kbit500;
    let mut bench = Bench::searching().until(rate);
    assert!(bench.hears_then(FDL_STATUS));
    bench.answer();
    for _ in 0..12 {
        bench.wait(dwell(rate));
        bench.hears("DC 02 02");
    }
    assert!(!bench.slave.has_baud_rate());
    let mut bench = Bench::searching().until(rate);
    for _ in 0..30 {
        assert!(bench.hears_then(FDL_STATUS));
        bench.answer();
        bench.wait(dwell(rate).times(9));
    }
}

#[test]
fn the_watchdog_runs_on_while_the_rate_is_lost() {
    let mut bench = Bench::searching().until(BaudRate::Mbit12);
    bench.asks(2, Some(61), &GOOD_PARAMETERS.replace("01 14", "0A 14"), SC);
    bench.asks(2, Some(62), "F1", SC);
    bench.wait(Duration::from_millis(1_900));
    assert_eq!((bench.slave.has_baud_rate(), bench.slave.state()), (false, State::DataExchange));
    bench.wait(Duration::from_millis(200));
    assert_eq!(bench.slave.state(), State::WaitPrm);
}
