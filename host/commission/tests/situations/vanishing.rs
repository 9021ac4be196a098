//! Slaves that leave and come back.

use codewheel_commission::profibus::{Event, SlaveState};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::Bench;
use crate::scripted::Scripted;

const RATE: BaudRate = BaudRate::Mbit1_5;

#[test]
fn a_slave_that_vanishes_is_told_once_and_brought_up_when_it_returns() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7), Scripted::new(8)]);
    bench.bring_up();
    bench.events();
    bench.slaves[0].present = false;
    let answers = bench.master().slave(8).unwrap().answers;
    bench.run(Duration::from_millis(50));
    assert_eq!(bench.events(), [Event::Offline { address: 7 }]);
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::Absent);
    assert!(bench.master().slave(8).unwrap().answers > answers + 20);
    bench.slaves[0].present = true;
    bench.slaves[0].restart();
    bench.bring_up();
    assert_eq!(bench.events(), [Event::Online { address: 7 }, Event::Configured { address: 7 }]);
    assert_eq!(bench.master().slave(7).unwrap().losses, 1);
}

#[test]
fn a_slave_that_lost_its_power_for_a_moment_is_configured_anew() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.events();
    bench.slaves[0].restart();
    bench.run(Duration::from_millis(10));
    let events = bench.events();
    assert!(
        matches!(events[..], [Event::Refused { address: 7, .. }, Event::Configured { address: 7 }]),
        "{events:?}"
    );
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::DataExchange);
}

#[test]
fn a_bus_where_nobody_answers_costs_each_slave_one_question_a_cycle() {
    let mut slaves = vec![Scripted::new(7), Scripted::new(8)];
    slaves.iter_mut().for_each(|slave| slave.present = false);
    let mut bench = Bench::new(RATE, slaves);
    bench.run(Duration::from_millis(20));
    assert!(bench.events().is_empty());
    let asked = bench.conversation(7);
    assert!(asked.len() > 5);
    assert!(asked.iter().all(|line| line == "M 68 05 05 68 87 82 6C 3C 3E EF 16"), "{asked:?}");
}
