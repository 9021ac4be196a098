//! Slaves that answer, and do not want.

use codewheel_commission::profibus::{Event, Service, SlaveState};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::Bench;
use crate::scripted::{Scripted, State, long, short};

const RATE: BaudRate = BaudRate::Mbit1_5;

#[test]
fn a_parameter_error_is_told_once_tried_again_and_overcome() {
    let mut slave = Scripted::new(7);
    slave.ident_number = 0x1234;
    let mut bench = Bench::new(RATE, vec![slave]);
    bench.run(Duration::from_millis(50));
    assert_eq!(
        bench.events(),
        [Event::Online { address: 7 }, Event::ParameterError { address: 7 }]
    );
    let master = bench.master();
    let slave = master.slave(7).unwrap();
    assert_eq!(slave.state, SlaveState::ParameterError);
    assert_eq!(slave.diagnosis.unwrap().status, [0x42, 0x05, 0x00]);
    assert_eq!(slave.diagnosis.unwrap().ident_number, 0x1234);
    bench.slaves[0].ident_number = 0x059B;
    bench.bring_up();
    assert_eq!(bench.events(), [Event::Configured { address: 7 }]);
}

#[test]
fn a_configuration_error_is_told_once_tried_again_and_overcome() {
    let mut slave = Scripted::new(7);
    slave.configuration = vec![0xD1];
    let mut bench = Bench::new(RATE, vec![slave]);
    bench.run(Duration::from_millis(50));
    assert_eq!(
        bench.events(),
        [Event::Online { address: 7 }, Event::ConfigurationError { address: 7 }]
    );
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::ConfigurationError);
    bench.slaves[0].configuration = vec![0xF1];
    bench.bring_up();
    assert_eq!(bench.events(), [Event::Configured { address: 7 }]);
}

#[test]
fn a_slave_with_an_error_that_vanishes_is_absent() {
    let mut slave = Scripted::new(7);
    slave.ident_number = 0x1234;
    let mut bench = Bench::new(RATE, vec![slave]);
    bench.run(Duration::from_millis(50));
    bench.events();
    bench.slaves[0].present = false;
    bench.run(Duration::from_millis(50));
    assert_eq!(bench.events(), [Event::Offline { address: 7 }]);
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::Absent);
}

/// Two that refuse at once end profirust alone in an assertion.
#[test]
fn slaves_of_another_master_are_left_to_it_until_it_lets_them_go() {
    let mut slaves = vec![Scripted::new(7), Scripted::new(8), Scripted::new(9)];
    slaves.iter_mut().for_each(|slave| {
        slave.owner = Some(1);
        slave.state = State::DataExchange;
        slave.parameters = vec![0];
    });
    let mut bench = Bench::new(RATE, slaves);
    bench.run(Duration::from_millis(100));
    let service = Service::SetParameters;
    let told: Vec<_> = (7..=9)
        .flat_map(|address| [Event::Online { address }, Event::Refused { address, service }])
        .collect();
    let mut events = bench.events();
    events.sort_by_key(|event| match event {
        Event::Online { address } | Event::Refused { address, .. } => *address,
        _ => 0,
    });
    assert_eq!(events, told);
    for address in 7..=9 {
        let slave = bench.master().slave(address).unwrap();
        assert_eq!(slave.state, SlaveState::Configuring);
        assert_eq!(slave.diagnosis.unwrap().master, Some(1));
    }
    bench.slaves.iter_mut().for_each(|slave| slave.owner = None);
    bench.bring_up();
}

#[test]
fn inputs_of_a_wrong_length_are_told_once_and_not_taken() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.slaves[0].inputs = vec![1, 2];
    bench.run(Duration::from_millis(20));
    let told = Event::InputLength { address: 7, given: 2, expected: 4 };
    let events = bench.events();
    assert_eq!(events.iter().filter(|event| **event == told).count(), 1, "{events:?}");
    assert_eq!(bench.master().slave(7).unwrap().inputs, [0; 4]);
    bench.slaves[0].inputs = vec![1, 2, 3, 4];
    bench.bring_up();
}

#[test]
fn whatever_slaves_answer_to_everything_the_others_go_on() {
    let answers = [
        vec![0xE5],
        vec![0xDC, 2, 7],
        vec![0xDC, 3, 2],
        short(2, 7, 0x03),
        short(2, 7, 0x09),
        short(2, 7, 0x00),
        short(2, 9, 0x08),
        short(7, 2, 0x49),
        short(2, 7, 0x49),
        long(&[2, 7, 8]),
        long(&[2, 7, 8, 1, 2, 3]),
        long(&[0x82, 0x87, 8, 62, 60, 0, 4]),
        long(&[0x82, 0x87, 8, 62, 60, 8, 4, 0, 255, 5, 0x9B, 0, 0]),
        long(&[2; 249]),
    ];
    for answer in answers {
        let mut bench = Bench::new(RATE, (7..=9).map(Scripted::new).collect());
        bench.slaves[0].always = Some(answer.clone());
        bench.slaves[1].always = Some(answer.clone());
        bench.run(Duration::from_millis(400));
        bench.slaves[0].always = None;
        bench.slaves[1].always = None;
        bench.run(Duration::from_millis(1_200));
        for slave in bench.masters[0].slaves() {
            assert_eq!(slave.state, SlaveState::DataExchange, "{answer:02X?}");
        }
    }
}

/// profirust alone reads the diagnosis for ever.
#[test]
fn a_slave_that_does_not_get_ready_is_begun_anew_after_two_seconds() {
    let mut slave = Scripted::new(7);
    slave.deaf_to_configuration = 1;
    let mut bench = Bench::new(RATE, vec![slave]);
    bench.run(Duration::from_millis(1_990));
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::Configuring);
    assert_eq!(bench.slaves[0].state, State::WaitConfiguration);
    bench.run(Duration::from_millis(20));
    assert_eq!(bench.master().slave(7).unwrap().state, SlaveState::DataExchange);
    assert_eq!(bench.events(), [Event::Online { address: 7 }, Event::Configured { address: 7 }]);
}
