//! A two-wire adapter that hears itself.

use crate::bench::{Bench, octets, telegram};

#[test]
fn what_the_slave_hears_of_itself_is_dropped() {
    for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
        bench = bench.then_exchanging();
        let echoes = bench.slave.counters().telegrams;
        for _ in 0..10 {
            let request = bench.request(2, None, "00 00 00 00");
            bench.hears(&request);
            let answer = bench.answer();
            assert_eq!(answer, telegram(2, 7, 0x08, None, "00 00 12 34"));
            bench.hears_after(0, &octets(&answer));
            assert_eq!(bench.answer(), "");
        }
        assert_eq!(bench.slave.counters().telegrams, echoes + 20);
        assert_eq!(bench.slave.counters().broken, 0);
    }
}

#[test]
fn an_echo_does_not_make_the_slave_forget_its_answer() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, None, "00 00 00 00");
    bench.hears(&request);
    let answer = bench.answer();
    bench.hears(&answer);
    bench.toy.inputs = [9; 4];
    bench.says(&request, &answer);
}

#[test]
fn a_request_in_the_name_of_the_slave_itself_is_not_answered() {
    let mut bench = Bench::exchanging();
    bench.says(&telegram(7, 7, 0x6D, Some((60, 62)), ""), "");
}
