//! Min T_SDR: when an answer leaves.

use codewheel_profibus::{Baud, Timing};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant};

use crate::bench::{Bench, SC, octets, telegram};

impl Bench {
    /// How long after the end of a request its answer leaves.
    fn delay_of(&mut self, request: &str) -> Duration {
        self.hears(request);
        let end = self.now;
        let sent = self.sends(self.slave.baud_rate().bits(300));
        assert_eq!(sent.len(), 1, "an answer to {request}");
        sent[0].0.since(end)
    }
}

const FDL_STATUS: &str = "10 07 02 49 52 16";

#[test]
fn before_any_parameters_it_is_eleven_bits_at_every_rate() {
    for rate in BaudRate::ALL {
        for timing in [Timing::Exact, Timing::Coarse] {
            let mut bench = Bench::new(Baud::Fixed(rate), timing);
            assert_eq!(bench.delay_of(FDL_STATUS), rate.bits(11), "{rate} {timing:?}");
        }
    }
}

#[test]
fn it_is_obeyed_from_11_to_255_and_only_after_the_acknowledge_of_its_own_set_prm() {
    let rate = BaudRate::Kbit500;
    for (given, bits) in [(0, 60), (1, 11), (10, 11), (11, 11), (12, 12), (100, 100), (255, 255)] {
        let mut bench = Bench::power_up();
        bench.asks(2, Some(61), "80 00 00 3C 05 9B 00", SC);
        let request = bench.request(2, Some(61), &format!("80 00 00 {given:02X} 05 9B 00"));
        assert_eq!(bench.delay_of(&request), rate.bits(60), "the acknowledge itself");
        assert_eq!(bench.delay_of(FDL_STATUS), rate.bits(bits), "min T_SDR {given}");
        assert_eq!(u32::from(bench.slave.station_delay()), bits);
    }
}

#[test]
fn it_is_not_taken_with_parameters_that_are_refused() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(61), "80 00 00 3C 12 34 00", SC);
    assert_eq!(bench.slave.station_delay(), 11);
}

#[test]
fn an_answer_is_never_early_and_is_due_at_the_deadline() {
    let mut bench = Bench::power_up();
    bench.hears(FDL_STATUS);
    let due = bench.now + BaudRate::Kbit500.bits(11);
    assert_eq!(bench.slave.deadline(), Some(due));
    let early = due - Duration::from_nanos(1);
    assert_eq!(bench.slave.transmit(early, &mut bench.toy), None);
    assert!(bench.slave.transmit(due, &mut bench.toy).is_some());
    assert_eq!(bench.slave.transmit(due, &mut bench.toy), None, "once");
    assert_eq!(bench.slave.deadline(), None);
}

#[test]
fn an_answer_that_waits_for_its_medium_is_sent_late_and_fresh() {
    for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
        bench = bench.then_exchanging();
        let request = bench.request(2, None, "00 00 00 00");
        bench.hears(&request);
        bench.now += Duration::from_millis(20);
        bench.toy.inputs = [1, 2, 3, 4];
        assert_eq!(bench.answer(), telegram(2, 7, 8, None, "01 02 03 04"));
    }
}

#[test]
fn an_octet_that_comes_before_the_answer_takes_it_away() {
    for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
        bench.hears(FDL_STATUS);
        bench.hears_after(5, &octets("DC"));
        assert_eq!(bench.slave.deadline(), None);
        assert_eq!(bench.answer(), "");
    }
    let mut bench = Bench::power_up();
    bench.hears(FDL_STATUS);
    bench.slave.handle(bench.now, Input::BrokenCharacter, &mut bench.toy);
    assert_eq!(bench.answer(), "");
}

#[test]
fn time_that_ends_does_not_matter() {
    let mut bench = Bench::on_a_pc();
    bench.now = Instant::from_nanos(u64::MAX);
    bench.slave.handle(bench.now, Input::Octets(&octets(FDL_STATUS)), &mut bench.toy);
    assert_eq!(bench.slave.transmit(bench.now, &mut bench.toy), None);
}
