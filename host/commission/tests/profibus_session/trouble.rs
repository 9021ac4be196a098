//! What goes wrong on the way.

use codewheel_commission::profibus::{MasterSettings, SessionSettings};
use codewheel_commission::{Kind, Name, Reading, Seat, Session};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::{Bench, PLC, RATE, alone, quick};

#[test]
fn where_nobody_answers_it_is_said_what_to_look_at() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let trouble = bench.open(8, &alone()).unwrap_err();
    assert_eq!((trouble.kind, trouble.came.as_str()), (Kind::TimeOut, "no answer at 1.5M"));
    let said = bench.said;
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.said, said, "and the master is gone");
}

#[test]
fn an_encoder_that_its_master_left_is_let_go_by_its_watchdog_and_can_be_had() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]);
    bench.run(Duration::from_millis(500));
    bench.unplug_plc();
    let mut session = bench.open(7, &alone()).unwrap();
    let steps = session.value(&Name::Key("steps-per-turn".to_owned())).unwrap();
    assert_eq!((steps.reading, steps.writable), (Reading::Number(3_600), true));
}

#[test]
fn without_a_watchdog_it_stays_with_the_master_that_is_gone_until_its_power_is_cycled() {
    let plc = MasterSettings { watchdog: None, ..MasterSettings::new(PLC, RATE) };
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc_of(plc, &[7]);
    bench.run(Duration::from_millis(500));
    bench.unplug_plc();
    let mut session = bench.open(7, &alone()).unwrap();
    let steps = session.value(&Name::Key("steps-per-turn".to_owned())).unwrap();
    assert_eq!((steps.reading, steps.writable), (Reading::Number(3_600), false));
    let trouble = session.preset(0).unwrap_err();
    assert_eq!((trouble.kind, trouble.came.as_str()), (Kind::Refused, "it belongs to master 2"));
    assert!(trouble.remedy.contains("switch the encoder off and on"), "{trouble}");
}

#[test]
fn disturbances_on_the_line_stop_no_session() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    bench.disturb(0.01);
    let mut session = bench.open(7, &alone()).unwrap();
    for total in [1_000, 2_000, 3_000] {
        let name = Name::Key("total-resolution".to_owned());
        let value = session.write(&name, &Reading::Number(total)).unwrap();
        assert_eq!(value.reading, Reading::Number(total));
        assert_eq!(session.preset(500).unwrap().position, 500);
    }
    session.release().unwrap();
}

#[test]
fn an_encoder_that_dies_is_a_time_out_and_nothing_hangs() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    bench.unplug_after(Duration::from_secs(3), 7);
    let mut session = bench.open(7, &alone()).unwrap();
    let last = loop {
        match session.sample() {
            Ok(sample) => assert!(sample.cycle.is_some()),
            Err(trouble) => break trouble,
        }
    };
    assert_eq!(last.kind, Kind::TimeOut);
    let name = Name::Key("direction".to_owned());
    for trouble in [
        session.sample().unwrap_err(),
        session.values().unwrap_err(),
        session.write(&name, &Reading::Number(1)).unwrap_err(),
        session.preset(0).unwrap_err(),
    ] {
        assert_eq!(trouble.kind, Kind::TimeOut, "{trouble}");
    }
    assert!(session.take_notices().contains(&"slave 7 does not answer".to_owned()));
    session.release().unwrap();
    let said = bench.said;
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.said, said);
}

/// Its watchdog has nothing to do with it: that is the slave's.
#[test]
fn a_slave_that_says_no_more_is_told_after_two_seconds_or_longer_at_slow_rates() {
    for (rate, most) in [(RATE, 2_100), (BaudRate::Kbit187_5, 2_200), (BaudRate::Kbit9_6, 5_000)] {
        let mut bench = Bench::at(rate).with(7, "amg11-p29");
        bench.unplug_after(Duration::from_secs(10), 7);
        let settings = SessionSettings { master: quick(rate), ..alone() };
        let mut session = bench.open(7, &settings).unwrap();
        let mut heard = session.now();
        let trouble = loop {
            match session.sample() {
                Ok(sample) => heard = sample.at,
                Err(trouble) => break trouble,
            }
        };
        assert_eq!(trouble.kind, Kind::TimeOut, "{trouble}");
        let silence = session.now().since(heard);
        let (least, most) = (Duration::from_millis(1_900), Duration::from_millis(most));
        assert!(silence >= least && silence < most, "{silence} at {rate}");
        let told = session.now();
        session.release().unwrap();
        assert!(session.now().since(told) < Duration::from_millis(500), "{rate}");
    }
}

#[test]
fn whoever_is_interrupted_while_opening_lets_the_slave_go_and_falls_silent() {
    let mut interrupted = 0;
    for telegrams in 0.. {
        let mut bench = Bench::new().with(7, "amg11-p29");
        bench.interrupt_when(move |bench| bench.said > telegrams);
        let Err(trouble) = bench.open(7, &alone()).map(drop) else { break };
        assert_eq!(trouble.kind, Kind::Bus, "{trouble}");
        interrupted += 1;
        let said = bench.said;
        // Long before its watchdog would let it go.
        bench.run(Duration::from_millis(100));
        assert_eq!(bench.said, said, "{telegrams}");
        let snapshot = bench.device(7).snapshot(bench.now());
        let master = snapshot.profibus().and_then(|state| state.master);
        assert_eq!(master, None, "after {telegrams} telegrams");
    }
    assert!(interrupted > 5, "{interrupted}");
}

#[test]
fn whoever_is_interrupted_while_scanning_falls_silent() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    bench.interrupt_when(|bench| bench.said > 40);
    bench.scan(quick(RATE)).unwrap_err();
    let said = bench.said;
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.said, said);
}
