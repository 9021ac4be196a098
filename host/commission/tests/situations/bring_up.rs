//! From silence to data exchange.

use codewheel_commission::profibus::{Event, Master, MasterSettings, SlaveState};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant, Station};

use crate::bench::{Bench, octets};
use crate::scripted::Scripted;

const RATE: BaudRate = BaudRate::Mbit1_5;

#[test]
fn the_conversation_of_a_bring_up_is_the_printed_one() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    let printed = [
        "M 68 05 05 68 87 82 6C 3C 3E EF 16",
        "S 68 0B 0B 68 82 87 08 3E 3C 02 05 00 FF 05 9B 31 16",
        "M 68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00 A2 16",
        "S E5",
        "M 68 06 06 68 87 82 7C 3E 3E F1 F2 16",
        "S E5",
        "M 68 05 05 68 87 82 5C 3C 3E DF 16",
        "S 68 0B 0B 68 82 87 08 3E 3C 00 0C 00 02 05 9B 39 16",
        "M 68 07 07 68 07 02 7D 00 00 00 00 86 16",
        "S 68 07 07 68 02 07 08 00 00 12 34 57 16",
    ];
    assert_eq!(bench.conversation(7)[..printed.len()], printed);
    assert_eq!(bench.events(), [Event::Online { address: 7 }, Event::Configured { address: 7 }]);
}

#[test]
fn the_first_thing_said_is_the_token_to_itself_twice_after_silence() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.run_bits(5_000);
    assert_eq!(bench.log[0].octets, octets("DC 02 02"));
    assert_eq!(bench.log[1].octets, octets("DC 02 02"));
    // 6 + 2 × address slot times of 300 bits.
    let silence = RATE.bits(10 * 300);
    assert!(bench.log[0].at.since(Instant::ZERO) >= silence);
    assert!(bench.log[0].at.since(Instant::ZERO) <= silence + Duration::from_micros(1));
}

#[test]
fn inputs_come_and_outputs_go_in_each_cycle() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.bring_up();
    bench.master().set_outputs(7, &[0x80, 0, 0, 0x2A]).unwrap();
    bench.slaves[0].inputs = vec![0, 0, 0x1F, 0xFF];
    bench.run(Duration::from_millis(5));
    assert_eq!(bench.slaves[0].outputs, [0x80, 0, 0, 0x2A]);
    let now = bench.now;
    let slave = bench.master().slave(7).unwrap();
    assert_eq!(slave.inputs, [0, 0, 0x1F, 0xFF]);
    assert_eq!(slave.outputs, [0x80, 0, 0, 0x2A]);
    assert!(slave.answers > 5);
    assert!(now.since(slave.input_at.unwrap()) < Duration::from_millis(1));
}

#[test]
fn other_parameters_of_any_length_make_the_slave_ready_anew_and_the_rest_goes_on() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7), Scripted::new(8)]);
    bench.bring_up();
    bench.master().set_outputs(7, &[0, 0, 0, 42]).unwrap();
    for length in [2_usize, 10, 0, 18, 237] {
        bench.events();
        let losses = bench.master().slave(7).unwrap().losses;
        bench.master().set_user_parameters(7, vec![0x5A; length]).unwrap();
        assert!(bench.master().slave(7).unwrap().parameters_waiting);
        bench.run(Duration::from_millis(50));
        assert_eq!(bench.slaves[0].parameters[7..], vec![0x5A; length], "{length}");
        assert_eq!(bench.slaves[0].outputs, [0, 0, 0, 42], "outputs come with the first exchange");
        let slave = bench.master().slave(7).unwrap();
        assert_eq!((slave.state, slave.losses), (SlaveState::DataExchange, losses));
        assert!(!slave.parameters_waiting && slave.user_parameters.len() == length);
        assert_eq!(bench.events(), [Event::Configured { address: 7 }]);
    }
    assert_eq!(bench.master().slave(8).unwrap().losses, 0);
    assert_eq!(bench.slaves[1].parameters.len(), 17);
    assert!(bench.master().set_user_parameters(7, vec![0; 238]).is_err());
    assert!(bench.master().set_user_parameters(9, Vec::new()).is_err());
}

#[test]
fn parameters_configuration_and_groups_are_those_of_the_settings_whatever_their_length() {
    for (parameters, identifiers) in [(0, 1), (10, 6), (18, 2), (237, 244)] {
        let mut slave = Scripted::new(7);
        slave.configuration = (0..identifiers).map(|place| place as u8).collect();
        let mut told = crate::bench::slave_settings(7);
        told.user_parameters = (0..parameters).map(|place| 255 - place as u8).collect();
        told.configuration = slave.configuration.clone();
        told.groups = 0x81;
        told.freeze = false;
        let master = Master::new(MasterSettings::new(2, RATE), vec![told.clone()]).unwrap();
        let mut bench = Bench::of(RATE, vec![master], vec![slave]);
        bench.bring_up();
        let taken = &bench.slaves[0].parameters;
        assert_eq!(taken[..7], octets("A8 01 14 0B 05 9B 81"));
        assert_eq!(taken[7..], told.user_parameters);
    }
}

#[test]
fn the_watchdog_of_the_settings_reaches_the_slave_as_two_factors_or_is_off() {
    for (watchdog, expected) in [
        (None, [0xB0, 0, 0]),
        (Some(Duration::from_millis(10)), [0xB8, 1, 1]),
        (Some(Duration::from_millis(11)), [0xB8, 1, 2]),
        (Some(Duration::from_millis(300)), [0xB8, 1, 30]),
        (Some(Duration::from_millis(2_550)), [0xB8, 1, 255]),
        (Some(Duration::from_millis(2_560)), [0xB8, 2, 128]),
        (Some(Duration::from_secs(650)), [0xB8, 255, 255]),
    ] {
        let mut settings = MasterSettings::new(2, RATE);
        settings.watchdog = watchdog;
        let mut bench = Bench::with(settings, vec![Scripted::new(7)]);
        bench.bring_up();
        assert_eq!(bench.slaves[0].parameters[..3], expected, "{watchdog:?}");
    }
}

#[test]
fn a_master_without_slaves_keeps_the_token_going() {
    let mut bench = Bench::new(RATE, vec![]);
    bench.run(Duration::from_millis(20));
    let tokens = bench.log.iter().filter(|sent| sent.octets == octets("DC 02 02")).count();
    assert!(tokens > 10, "{tokens}");
    assert!(bench.master().is_in_ring());
}

#[test]
fn before_it_is_asked_the_first_time_it_is_due_and_knows_nobody() {
    let master = Master::new(MasterSettings::new(2, RATE), vec![crate::bench::slave_settings(7)]);
    let master = master.unwrap();
    assert_eq!(master.deadline(), Some(Instant::ZERO));
    assert_eq!(master.slave(7).unwrap().state, SlaveState::Absent);
    assert!(master.slave(8).is_none());
}
