//! What slaves say of themselves.

use codewheel_commission::profibus::{Event, UnknownSlave};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::Bench;
use crate::scripted::Scripted;

const RATE: BaudRate = BaudRate::Mbit1_5;

#[test]
fn the_extended_octets_are_shown_even_without_the_bit_that_announces_them() {
    let mut slave = Scripted::new(7);
    slave.extended = vec![0x0A, 0, 1, 2, 3, 4, 5, 6, 7, 8];
    let mut bench = Bench::new(RATE, vec![slave]);
    bench.bring_up();
    let slave = bench.masters[0].slave(7).unwrap();
    let diagnosis = slave.diagnosis.unwrap();
    assert_eq!(diagnosis.status, [0x00, 0x0C, 0x00]);
    assert_eq!((diagnosis.master, diagnosis.ident_number), (Some(2), 0x059B));
    assert_eq!(diagnosis.extended, bench.slaves[0].extended);
}

#[test]
fn an_answer_of_high_priority_brings_the_diagnosis_once() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.events();
    bench.slaves[0].pending = true;
    bench.slaves[0].running_status = 0x08;
    bench.slaves[0].extended = vec![0x02, 0x01];
    bench.run(Duration::from_millis(10));
    assert_eq!(bench.events(), [Event::Diagnosis { address: 7 }]);
    let slave = bench.master().slave(7).unwrap();
    assert_eq!(slave.diagnosis.unwrap().extended, [0x02, 0x01]);
}

#[test]
fn a_diagnosis_asked_for_takes_the_place_of_one_data_exchange() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.events();
    let before = bench.slaves[0].requests.len();
    bench.master().request_diagnosis(7).unwrap();
    bench.run(Duration::from_millis(10));
    assert_eq!(bench.events(), [Event::Diagnosis { address: 7 }]);
    let asked = bench.slaves[0].requests[before..]
        .iter()
        .filter(|request| request.len() == 11 && request[7] == 0x3C)
        .count();
    assert_eq!(asked, 1);
    assert_eq!(bench.master().request_diagnosis(8), Err(UnknownSlave(8)));
}

#[test]
fn a_diagnosis_asked_for_while_an_answer_is_awaited_disturbs_nothing() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    for _ in 0..500 {
        bench.master().request_diagnosis(7).unwrap();
        bench.run_bits(37);
    }
    let slave = bench.master().slave(7).unwrap();
    assert_eq!((slave.repetitions, slave.losses), (0, 0));
    assert_eq!(bench.master().counters().unexpected, 0);
}

/// A block of no length ends profirust alone in a slice out of range where it is printed.
#[test]
fn blocks_of_no_length_are_octets_like_others() {
    let mut slave = Scripted::new(7);
    slave.running_status = 0x08;
    slave.extended = vec![0x00, 0x40];
    let mut bench = Bench::new(RATE, vec![slave]);
    bench.bring_up();
    assert_eq!(bench.master().slave(7).unwrap().diagnosis.unwrap().extended, [0x00, 0x40]);
    assert!(format!("{:?}", bench.master()).contains("extended: [0, 64]"));
}
