//! DH, the call for the diagnosis, from its cause to its reading.

use codewheel_station::Duration;

use crate::bench::{Bench, GOOD_PARAMETERS, SC, octets, telegram};

impl Bench {
    /// The function code of the answer to a Data_Exchange.
    fn exchange_code(&mut self) -> u8 {
        let request = self.request(2, None, "00 00 00 00");
        self.hears(&request);
        octets(&self.answer())[6]
    }
}

#[test]
fn a_change_calls_for_the_owner_until_it_has_read() {
    let mut bench = Bench::exchanging();
    assert_eq!(bench.exchange_code(), 0x08);
    bench.toy.set_alarm(1);
    assert_eq!((bench.exchange_code(), bench.exchange_code()), (0x0A, 0x0A));
    assert_eq!(bench.diagnosis(), "08 0C 00 02 05 9B 02 01");
    assert_eq!(bench.exchange_code(), 0x08, "read, though the alarm lasts");
    bench.toy.set_alarm(0);
    assert_eq!(bench.exchange_code(), 0x0A, "its end is a change as well");
    assert_eq!(bench.diagnosis(), "00 0C 00 02 05 9B 02 00");
    assert_eq!(bench.exchange_code(), 0x08);
}

#[test]
fn what_another_master_reads_leaves_the_owner_called() {
    let mut bench = Bench::exchanging();
    bench.toy.set_alarm(1);
    assert_eq!(bench.diagnosis_for(3), "08 0C 00 02 05 9B 02 01");
    assert_eq!(bench.exchange_code(), 0x0A);
}

#[test]
fn a_diagnosis_that_never_left_was_not_read() {
    let mut bench = Bench::exchanging();
    bench.toy.set_alarm(1);
    let request = bench.request(2, Some(60), "");
    bench.hears(&request);
    bench.hears_after(2, &octets("00"));
    assert_eq!(bench.answer(), "");
    assert_eq!(bench.exchange_code(), 0x0A);
}

#[test]
fn a_change_after_the_reading_calls_anew_though_the_reading_is_repeated() {
    let mut bench = Bench::exchanging();
    bench.toy.set_alarm(1);
    let request = bench.request(2, Some(60), "");
    bench.hears(&request);
    let answer = bench.answer();
    bench.toy.set_alarm(3);
    bench.says(&request, &answer);
    assert_eq!(bench.exchange_code(), 0x0A, "a repeated answer is no reading");
}

#[test]
fn a_change_since_the_last_reading_calls_at_the_entry_to_data_exchange() {
    let mut bench = Bench::exchanging();
    bench.diagnosis();
    bench.wait(Duration::from_millis(200));
    bench.toy.set_alarm(1);
    let mut bench = bench.then_exchanging();
    assert_eq!(bench.exchange_code(), 0x0A);
    bench.diagnosis();
    assert_eq!(bench.exchange_code(), 0x08);
}

#[test]
fn an_alarm_from_before_the_first_master_calls_for_it_and_no_alarm_does_not() {
    let mut bench = Bench::power_up();
    bench.toy.set_alarm(1);
    bench.toy.set_alarm(0);
    assert_eq!(bench.then_exchanging().exchange_code(), 0x08);
    let mut bench = Bench::power_up();
    bench.toy.set_alarm(1);
    assert_eq!(bench.then_exchanging().exchange_code(), 0x0A);
}

#[test]
fn a_reading_on_the_way_to_data_exchange_is_a_reading() {
    let mut bench = Bench::parameterized();
    bench.toy.set_alarm(1);
    bench.diagnosis();
    assert_eq!(bench.then_configured("F1").exchange_code(), 0x08);
}

#[test]
fn a_repeated_data_exchange_repeats_its_call_or_its_silence() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, None, "00 00 00 00");
    let answer = telegram(2, 7, 0x08, None, "00 00 12 34");
    bench.says(&request, &answer);
    bench.toy.set_alarm(1);
    bench.says(&request, &answer);
    assert_eq!(bench.exchange_code(), 0x0A);
}

#[test]
fn a_new_owner_is_called_for_an_alarm_that_only_the_old_one_has_read() {
    let mut bench = Bench::exchanging();
    bench.toy.set_alarm(1);
    bench.diagnosis();
    bench.wait(Duration::from_millis(200));
    bench.asks(3, Some(61), GOOD_PARAMETERS, SC);
    bench.asks(3, Some(62), "F1", SC);
    let request = bench.request(3, None, "00 00 00 00");
    bench.hears(&request);
    assert_eq!(octets(&bench.answer())[6], 0x0A);
}
