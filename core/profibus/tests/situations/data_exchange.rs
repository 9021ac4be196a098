//! Data_Exchange, RD_Inp and RD_Outp.

use codewheel_profibus::{Event, Loss, State};

use crate::bench::{Bench, RS, telegram};

#[test]
fn inputs_are_those_of_the_moment_the_answer_leaves() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, None, "00 00 00 00");
    bench.hears(&request);
    bench.toy.inputs = [1, 2, 3, 4];
    assert_eq!(bench.answer(), telegram(2, 7, 0x08, None, "01 02 03 04"));
}

#[test]
fn outputs_come_to_the_device_before_the_answer_leaves() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, None, "80 00 00 05");
    bench.hears(&request);
    assert_eq!(bench.toy.told, ["80 00 00 05"]);
}

#[test]
fn without_outputs_the_request_is_sd1_and_the_answer_sd2() {
    let mut bench = Bench::parameterized().then_configured("D1");
    let request = bench.request(2, None, "");
    assert!(request.starts_with("10 "));
    bench.says(&request, "68 07 07 68 02 07 08 00 00 12 34 57 16");
    assert_eq!(bench.toy.told, [""; 0]);
}

#[test]
fn without_inputs_the_answer_is_an_acknowledge_or_a_call_for_the_diagnosis() {
    let mut bench = Bench::parameterized().then_configured("21");
    bench.asks(2, None, "00 05", "E5");
    bench.toy.set_alarm(1);
    bench.asks(2, None, "00 05", "10 02 07 0A 13 16");
}

#[test]
fn a_wrong_number_of_outputs_is_refused_and_ends_data_exchange() {
    for (identifiers, outputs, expected) in
        [("F1", "00 00 00", 4), ("F1", "00 00 00 00 00", 4), ("D1", "00", 0), ("F0", "01", 2)]
    {
        let mut bench = Bench::parameterized().then_configured(identifiers);
        bench.asks(2, None, outputs, RS);
        assert_eq!(bench.slave.state(), State::WaitPrm);
        let given = outputs.split(' ').count() as u8;
        let lost = Event::Lost(Loss::OutputLength { given, expected });
        assert_eq!(bench.toy.events.last(), Some(&lost));
        assert_eq!(bench.toy.told, [""; 0], "the outputs are not taken");
        assert_eq!(bench.diagnosis(), "02 05 00 FF 05 9B 02 00");
    }
}

#[test]
fn an_empty_data_exchange_is_a_clear() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    bench.exchanges("", "00 00 12 34", &["clear"]);
    assert_eq!(bench.slave.state(), State::DataExchange);
    bench.asks(2, Some(57), "", &telegram(2, 7, 0x08, Some((62, 57)), "00 00 00 00"));
}

#[test]
fn before_the_configuration_there_are_no_data() {
    for mut bench in [Bench::power_up(), Bench::parameterized()] {
        let state = bench.slave.state();
        bench.asks(2, None, "00 00 00 00", RS);
        bench.asks(2, Some(56), "", RS);
        bench.asks(2, Some(57), "", RS);
        assert_eq!(bench.slave.state(), state);
    }
}

#[test]
fn any_master_may_read_inputs_and_outputs() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    for master in [2, 3] {
        bench.asks(master, Some(56), "", &telegram(master, 7, 8, Some((62, 56)), "00 00 12 34"));
        bench.asks(master, Some(57), "", &telegram(master, 7, 8, Some((62, 57)), "00 00 00 05"));
    }
}

#[test]
fn where_there_is_nothing_to_read_no_data_are_ready() {
    let mut bench = Bench::parameterized().then_configured("D1");
    bench.asks(2, Some(57), "", "10 02 07 09 12 16");
    let mut bench = Bench::parameterized().then_configured("21");
    bench.asks(2, Some(56), "", "10 02 07 09 12 16");
}
