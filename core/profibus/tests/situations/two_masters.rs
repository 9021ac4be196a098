//! Two masters on one line.

use codewheel_profibus::State;
use codewheel_station::Duration;

use crate::bench::{Bench, GOOD_PARAMETERS, SC, hex, telegram};

#[test]
fn a_slave_that_was_let_go_goes_to_the_next_master() {
    let mut bench = Bench::exchanging();
    bench.asks(3, Some(61), GOOD_PARAMETERS, "10 03 07 03 0D 16");
    bench.asks(2, Some(61), "40 00 00 00 05 9B 00", SC);
    bench.asks(3, Some(61), GOOD_PARAMETERS, SC);
    bench.asks(3, Some(62), "F1", SC);
    assert_eq!((bench.slave.state(), bench.slave.master()), (State::DataExchange, Some(3)));
    assert_eq!(bench.diagnosis_for(2), "00 0C 00 03 05 9B 02 00");
    bench.asks(2, None, "00 00 00 00", "10 02 07 03 0C 16");
}

#[test]
fn a_slave_whose_master_fell_silent_goes_to_the_next_one() {
    let mut bench = Bench::exchanging();
    bench.wait(Duration::from_millis(200));
    bench.asks(3, Some(61), GOOD_PARAMETERS, SC);
    assert_eq!(bench.slave.master(), Some(3));
}

#[test]
fn two_masters_that_take_turns_do_not_take_each_others_answers() {
    let mut bench = Bench::exchanging();
    // The frame count bits of both happen to be alike.
    for (turn, code) in [0x5D, 0x7D, 0x5D, 0x7D].into_iter().enumerate() {
        bench.toy.inputs = [turn as u8; 4];
        let inputs = hex(&bench.toy.inputs);
        bench.says(&telegram(7, 2, code, None, "00 00 00 00"), &telegram(2, 7, 8, None, &inputs));
        bench.says("DC 03 02", "");
        bench.says(
            &telegram(7, 3, code, Some((56, 62)), ""),
            &telegram(3, 7, 8, Some((62, 56)), &inputs),
        );
        bench.says("DC 02 03", "");
    }
    assert_eq!(bench.slave.counters().retries, 0);
}
