//! Answers that are lost.

use codewheel_commission::profibus::{MasterSettings, SlaveState};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::Bench;
use crate::scripted::Scripted;

const RATE: BaudRate = BaudRate::Kbit500;

#[test]
fn a_lost_answer_is_asked_for_again_with_the_same_octets_after_the_slot_time() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.slaves[0].lose = 1;
    let before = bench.log.len();
    bench.run(Duration::from_millis(5));
    let sent = &bench.log[before..];
    let place = sent
        .windows(2)
        .position(|pair| pair[0].octets == pair[1].octets && pair[0].octets[0] == 0x68)
        .expect("a repetition");
    let (first, again) = (&sent[place], &sent[place + 1]);
    let length = u32::try_from(first.octets.len()).unwrap();
    let pause = again.at.since(first.at + RATE.characters(length));
    assert!(pause >= RATE.bits(200) && pause <= RATE.bits(201), "{pause}");
    let slave = bench.master().slave(7).unwrap();
    assert_eq!((slave.repetitions, slave.losses), (1, 0));
    assert_eq!(slave.state, SlaveState::DataExchange);
}

#[test]
fn outputs_set_before_a_repetition_wait_until_it_is_answered() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.slaves[0].lose = 1;
    let heard = bench.slaves[0].requests.len();
    while bench.slaves[0].requests.len() == heard || bench.slaves[0].lose != 0 {
        bench.run_bits(11);
    }
    bench.master().set_outputs(7, &[9, 9, 9, 9]).unwrap();
    bench.master().request_diagnosis(7).unwrap();
    bench.run(Duration::from_millis(5));
    let slave = &bench.slaves[0];
    let lost = slave.requests.windows(2).position(|pair| pair[0] == pair[1]).expect("a repetition");
    assert!(lost >= heard - 1);
    assert_eq!(slave.outputs, [9, 9, 9, 9]);
    assert_eq!(bench.master().slave(7).unwrap().repetitions, 1);
}

#[test]
fn so_many_retries_as_the_settings_say_and_then_the_slave_is_absent() {
    for retries in [1, 3, 15] {
        let mut settings = MasterSettings::new(2, RATE);
        settings.retries = retries;
        let mut bench = Bench::with(settings, vec![Scripted::new(7)]);
        bench.bring_up();
        bench.slaves[0].lose = u32::from(retries);
        bench.run(Duration::from_millis(50));
        let slave = bench.master().slave(7).unwrap();
        assert_eq!((slave.repetitions, slave.losses), (u64::from(retries), 0));
        bench.slaves[0].lose = u32::from(retries) + 1;
        bench.run(Duration::from_millis(50));
        assert_eq!(bench.master().slave(7).unwrap().losses, 1);
    }
}

#[test]
fn a_broken_answer_is_no_answer() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.slaves[0].always = Some(vec![0x68, 7, 7, 0x68, 2, 7, 8, 0, 0, 0, 0, 0, 0x16]);
    bench.run(Duration::from_millis(10));
    let broken = bench.master().counters().broken;
    assert!(broken >= 2, "{broken}");
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::Absent);
    bench.slaves[0].always = None;
    bench.bring_up();
}
