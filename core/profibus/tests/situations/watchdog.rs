//! The watchdog over the master.

use codewheel_profibus::{Baud, Event, Loss, State, Timing};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant};

use crate::bench::{Bench, RS, SC, octets, telegram};

const NANO: Duration = Duration::from_nanos(1);

impl Bench {
    /// Whether the watchdog expires `span` after `begin`, to the nanosecond.
    #[track_caller]
    fn expires(&mut self, begin: Instant, span: Duration) {
        let state = self.slave.state();
        self.wait((begin + span - NANO).since(self.now));
        assert_eq!(self.slave.state(), state, "not before");
        self.wait(NANO);
        assert_eq!(self.slave.state(), State::WaitPrm);
        assert_eq!(self.toy.events.last(), Some(&Event::Lost(Loss::Watchdog)));
    }

    /// A request that ends now, and its answer. Returns when it ended.
    fn hears_and_answers(&mut self, request: &str) -> Instant {
        self.hears(request);
        let end = self.now;
        self.answer();
        end
    }
}

#[test]
fn it_runs_from_the_parameters_on_in_units_of_ten_milliseconds_or_one() {
    for (octets, millis) in [
        ("88 02 03 00 05 9B 00 00", 60),
        ("88 02 03 00 05 9B 00 04", 6),
        ("88 02 03 00 05 9B 00", 60),
        ("88 FF FF 00 05 9B 00 00", 650_250),
    ] {
        let mut bench = Bench::power_up();
        let request = bench.request(2, Some(61), octets);
        let begin = bench.hears_and_answers(&request);
        bench.expires(begin, Duration::from_millis(millis));
    }
}

#[test]
fn any_request_for_data_by_the_owner_retriggers_it_retries_and_refused_ones_too() {
    let requests: [(&str, String); 6] = [
        ("Data_Exchange", telegram(7, 2, 0x5D, None, "00 00 00 00")),
        ("Slave_Diag", telegram(7, 2, 0x7C, Some((60, 62)), "")),
        ("a refused service", telegram(7, 2, 0x7C, Some((55, 62)), "")),
        ("half an extension", "68 04 04 68 87 02 6D 3C 32 16".into()),
        ("Chk_Cfg", telegram(7, 2, 0x7D, Some((62, 62)), "F1")),
        ("RD_Inp", telegram(7, 2, 0x4D, Some((56, 62)), "")),
    ];
    for (what, request) in requests {
        let mut bench = Bench::exchanging();
        bench.wait(Duration::from_millis(150));
        bench.hears_and_answers(&request);
        bench.wait(Duration::from_millis(150));
        assert_eq!(bench.slave.state(), State::DataExchange, "{what}");
        let retry = bench.hears_and_answers(&request);
        bench.expires(retry, Duration::from_millis(200));
    }
}

#[test]
fn nothing_else_retriggers_it() {
    for (what, telegram) in [
        ("Global_Control", telegram(127, 2, 0x46, Some((58, 62)), "00 00")),
        ("FDL status", telegram(7, 2, 0x49, None, "")),
        ("a token", "DC 02 02".into()),
        ("SDA", telegram(7, 2, 0x73, None, "00")),
        ("another master's Slave_Diag", telegram(7, 3, 0x6D, Some((60, 62)), "")),
        ("a request to another station", telegram(8, 2, 0x7D, None, "")),
        ("a broken request", "68 07 07 68 07 02 5D 00 00 00 00 67 16".into()),
    ] {
        let mut bench = Bench::power_up();
        let parameters = bench.request(2, Some(61), "88 01 14 0B 05 9B 00");
        bench.hears_and_answers(&parameters);
        let request = bench.request(2, Some(62), "F1");
        let last = bench.hears_and_answers(&request);
        bench.wait(Duration::from_millis(150));
        bench.hears_and_answers(&telegram);
        assert_eq!(bench.slave.state(), State::DataExchange, "{what}");
        bench.expires(last, Duration::from_millis(200));
    }
}

#[test]
fn expiry_takes_everything_of_the_master_but_the_station_delay() {
    let mut bench = Bench::power_up().then_parameterized("B8 01 14 64 05 9B 03 00");
    bench = bench.then_configured("F1");
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    bench.global_control(2, 0x28, 0);
    bench.toy.told.clear();
    bench.wait(Duration::from_millis(200));
    assert_eq!((bench.slave.state(), bench.slave.master()), (State::WaitPrm, None));
    assert_eq!(bench.slave.watchdog(), None);
    assert!(!bench.slave.is_in_sync_mode() && !bench.slave.is_in_freeze_mode());
    assert_eq!(bench.slave.station_delay(), 100);
    assert_eq!(bench.toy.told, [""; 0], "outputs 0 that no master sent are not told");
    assert_eq!(bench.diagnosis(), "02 05 00 FF 05 9B 02 00");
    bench.asks(2, None, "00 00 00 00", "10 02 07 03 0C 16");
    bench.wait(Duration::from_secs(10));
    let mut bench = bench.then_exchanging();
    bench.asks(2, Some(57), "", &telegram(2, 7, 8, Some((62, 57)), "00 00 00 00"));
}

#[test]
fn after_expiry_a_retry_is_a_new_request() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, None, "00 00 00 05");
    bench.hears_and_answers(&request);
    bench.wait(Duration::from_millis(200));
    bench.says(&request, "10 02 07 03 0C 16");
}

#[test]
fn an_answer_that_is_still_owed_when_it_expires_tells_what_is_then() {
    // 1 ms, and 255 bits at 500 kbit/s are 0.51 ms: a request 0.8 ms later is answered after it.
    let parameterized = || Bench::power_up().then_parameterized("88 01 01 FF 05 9B 00 04");
    let mut bench = parameterized();
    bench.hears(&telegram(7, 3, 0x7C, Some((60, 62)), ""));
    assert_eq!(bench.slave.state(), State::WaitCfg);
    let diagnosis = "02 05 00 FF 05 9B 02 00";
    assert_eq!(bench.answer(), telegram(3, 7, 8, Some((62, 60)), diagnosis));
    assert_eq!(bench.slave.state(), State::WaitPrm);
    let mut bench = parameterized();
    bench.hears("10 07 03 49 53 16");
    assert_eq!(bench.answer(), "10 03 07 00 0A 16", "FDL status, in every state");
    assert_eq!(bench.slave.state(), State::WaitPrm);
}

#[test]
fn process_data_that_is_still_owed_when_it_expires_is_refused() {
    let mut bench = Bench::power_up().then_parameterized("88 02 01 FF 05 9B 00 04");
    bench = bench.then_configured("F1");
    bench.wait(Duration::from_micros(900));
    bench.hears(&telegram(7, 3, 0x7C, Some((56, 62)), ""));
    assert_eq!(bench.slave.state(), State::DataExchange);
    assert_eq!(bench.answer(), "10 03 07 03 0D 16");
    assert_eq!(bench.slave.state(), State::WaitPrm);
}

#[test]
fn off_means_off() {
    let mut bench = Bench::power_up().then_parameterized("80 01 01 00 05 9B 00");
    bench = bench.then_configured("F1");
    assert_eq!(bench.slave.deadline(), None);
    bench.wait(Duration::from_secs(1_000_000));
    assert_eq!(bench.slave.state(), State::DataExchange);
    bench.asks(2, Some(61), "80 01 01 00 05 9B 00", SC);
}

#[test]
fn the_acknowledge_of_set_prm_leaves_though_its_own_watchdog_is_shorter_than_t_sdr() {
    let mut bench = Bench::new(Baud::Fixed(BaudRate::Kbit9_6), Timing::Exact);
    let request = bench.request(2, Some(61), "88 01 01 FF 05 9B 00 04");
    bench.says(&request, SC);
}

#[test]
fn a_request_that_ends_with_the_watchdog_time_is_too_late() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, None, "00 00 00 00");
    // Its end falls on the very instant of the expiry: too late.
    let length = bench.slave.baud_rate().characters(octets(&request).len() as u32);
    let due = bench.slave.deadline().expect("watchdog");
    let pause = due.since(bench.now).as_nanos() - length.as_nanos();
    bench.wait(Duration::from_nanos(pause));
    bench.hears_after(0, &octets(&request));
    assert_eq!(bench.answer(), RS);
}

#[test]
fn a_request_after_the_expiry_finds_the_watchdog_expired_without_a_call_of_advance() {
    let mut bench = Bench::exchanging();
    let request = octets(&bench.request(2, None, "00 00 00 05"));
    bench.now += Duration::from_millis(201);
    bench.slave.handle(bench.now, Input::Octets(&request), &mut bench.toy);
    assert_eq!(bench.answer(), RS);
    assert_eq!(bench.toy.told, [""; 0]);
}
