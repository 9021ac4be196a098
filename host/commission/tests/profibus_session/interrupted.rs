//! A person wants an end in the midst of something.

use codewheel_commission::Seat;
use codewheel_commission::profibus::SlaveState;
use codewheel_profibus::State;
use codewheel_station::Duration;

use crate::bench::{Bench, PLC, RATE, alone, joining, quick, with_others};

type IsSo = fn(&Bench) -> bool;

/// At whatever step the opening is ended, the slave is free and the bus silent.
#[test]
fn an_encoder_whose_opening_is_interrupted_is_released_at_once() {
    let steps: [(&str, IsSo); 3] = [
        ("parameterized", |bench| bench.device(7).slave().state() == State::WaitCfg),
        ("configured", |bench| bench.device(7).slave().state() == State::DataExchange),
        ("asked for its diagnosis", |bench| bench.said > 4),
    ];
    for (step, is_so) in steps {
        let mut bench = Bench::new().with(7, "amg11-p29");
        bench.interrupt_when(is_so);
        let trouble = bench.open(7, &alone()).unwrap_err();
        assert!(trouble.came.contains("interrupted"), "{step}: {trouble}");
        let slave = bench.device(7).slave();
        assert_eq!((slave.state(), slave.master()), (State::WaitPrm, None), "{step}");
        assert!(bench.station().master().is_none(), "{step}");
        let said = bench.said;
        bench.run(Duration::from_secs(1));
        assert_eq!(bench.said, said, "{step}");
        assert_eq!(bench.complaints, [""; 0], "{step}");
    }
}

#[test]
fn whoever_is_interrupted_in_a_ring_hands_the_token_on() {
    let mut bench = Bench::new().with(7, "amg11-p29").with(8, "hmg10-p29").with_plc(&[7]);
    bench.run(Duration::from_millis(500));
    bench.interrupt_when(|bench| bench.said > 50);
    let trouble = bench.scan(joining(RATE)).unwrap_err();
    assert!(trouble.came.contains("interrupted"), "{trouble}");
    assert!(bench.station().master().is_none());
    bench.interrupt_when(|bench| bench.device(8).slave().state() == State::WaitCfg);
    let trouble = bench.open(8, &with_others()).unwrap_err();
    assert!(trouble.came.contains("interrupted"), "{trouble}");
    assert_eq!(bench.device(8).slave().master(), None);
    let before = bench.plc().slave(7).unwrap().answers;
    bench.run(Duration::from_millis(200));
    let slave = bench.plc().slave(7).unwrap();
    assert_eq!((slave.state, slave.losses), (SlaveState::DataExchange, 0));
    assert!(slave.answers > before + 100);
    assert_eq!(bench.device(7).slave().master(), Some(PLC));
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn who_is_interrupted_while_listening_says_nothing() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    bench.interrupt_when(|bench| bench.now().as_nanos() > 500_000_000);
    assert!(bench.scan(quick(RATE)).is_err());
    assert_eq!(bench.said, 0);
}
