//! Whatever comes, whenever it comes, the master neither panics nor stays away for good.

use codewheel_commission::profibus::SlaveState;
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Station};
use proptest::prelude::*;

use crate::bench::Bench;
use crate::scripted::{Scripted, long, short};

const RATE: BaudRate = BaudRate::Mbit1_5;
/// Fewer than usual: each may run for seconds of bus time.
const CASES: u32 = 128;

fn address() -> impl Strategy<Value = u8> {
    prop_oneof![4 => 0_u8..12, 1 => any::<u8>(), 1 => 124_u8..=129]
}

fn code() -> impl Strategy<Value = u8> {
    prop_oneof![
        prop::sample::select(vec![0x00, 0x03, 0x08, 0x0A, 0x20, 0x30, 0x49, 0x6C, 0x5D, 0x7D]),
        any::<u8>()
    ]
}

/// A whole telegram of somebody, about something.
fn telegram() -> impl Strategy<Value = Vec<u8>> {
    let data = prop::collection::vec(any::<u8>(), 0..20);
    prop_oneof![
        Just(vec![0xE5]),
        (address(), address()).prop_map(|(to, from)| vec![0xDC, to, from]),
        (address(), address(), code()).prop_map(|(to, from, code)| short(to, from, code)),
        (address(), address(), code(), data.clone())
            .prop_map(|(to, from, code, data)| { long(&[vec![to, from, code], data].concat()) }),
        // An answer to Slave_Diag, more or less.
        (7_u8..10, prop::sample::select(vec![0x3C, 0x3D]), data).prop_map(|(from, sap, data)| {
            long(&[vec![0x82, 0x80 | from, 0x08, 0x3E, sap], data].concat())
        }),
        prop::collection::vec(any::<u8>(), 1..40),
    ]
}

#[derive(Clone, Debug)]
enum Doing {
    /// Octets come after so many bits.
    Hear {
        bits: u32,
        octets: Vec<u8>,
    },
    BrokenCharacter {
        bits: u32,
    },
    /// A slave answers so from now on, or as it should.
    Answer {
        slave: usize,
        with: Option<Vec<u8>>,
    },
    Present {
        slave: usize,
        present: bool,
    },
    Lose {
        slave: usize,
        answers: u32,
    },
    Restart {
        slave: usize,
    },
    Diagnosis {
        slave: u8,
    },
    Parameters {
        slave: u8,
        length: usize,
    },
    Outputs {
        slave: u8,
        value: u8,
    },
    Run {
        bits: u32,
    },
}

fn doing() -> impl Strategy<Value = Doing> {
    let bits = prop_oneof![0_u32..60, 0_u32..4_000];
    let slave = 0_usize..3;
    prop_oneof![
        4 => (bits.clone(), telegram()).prop_map(|(bits, octets)| Doing::Hear { bits, octets }),
        1 => bits.clone().prop_map(|bits| Doing::BrokenCharacter { bits }),
        3 => (slave.clone(), prop::option::of(telegram()))
            .prop_map(|(slave, with)| Doing::Answer { slave, with }),
        1 => (slave.clone(), any::<bool>())
            .prop_map(|(slave, present)| Doing::Present { slave, present }),
        1 => (slave.clone(), 0_u32..5).prop_map(|(slave, answers)| Doing::Lose { slave, answers }),
        1 => slave.prop_map(|slave| Doing::Restart { slave }),
        1 => (7_u8..11).prop_map(|slave| Doing::Diagnosis { slave }),
        1 => (7_u8..11, any::<u8>()).prop_map(|(slave, value)| Doing::Outputs { slave, value }),
        1 => (7_u8..11, 0_usize..20)
            .prop_map(|(slave, length)| Doing::Parameters { slave, length }),
        2 => bits.prop_map(|bits| Doing::Run { bits }),
    ]
}

fn do_it(bench: &mut Bench, doing: Doing) {
    match doing {
        Doing::Hear { bits, octets } => {
            bench.run_bits(bits);
            bench.run(RATE.characters(u32::try_from(octets.len()).unwrap()));
            let now = bench.now;
            bench.master().handle(now, Input::Octets(&octets));
        }
        Doing::BrokenCharacter { bits } => {
            bench.run_bits(bits);
            let now = bench.now;
            bench.master().handle(now, Input::BrokenCharacter);
        }
        Doing::Answer { slave, with } => bench.slaves[slave].always = with,
        Doing::Present { slave, present } => bench.slaves[slave].present = present,
        Doing::Lose { slave, answers } => bench.slaves[slave].lose = answers,
        Doing::Restart { slave } => bench.slaves[slave].restart(),
        Doing::Diagnosis { slave } => drop(bench.master().request_diagnosis(slave)),
        Doing::Parameters { slave, length } => {
            let _ = bench.master().set_user_parameters(slave, vec![0; length]);
        }
        Doing::Outputs { slave, value } => drop(bench.master().set_outputs(slave, &[value; 4])),
        Doing::Run { bits } => bench.run_bits(bits),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(CASES) })]

    #[test]
    fn nothing_on_the_line_makes_the_master_panic_or_give_up(
        doings in prop::collection::vec(doing(), 0..60)
    ) {
        let mut bench = Bench::new(RATE, (7..10).map(Scripted::new).collect());
        // Slaves and strangers may speak at once here.
        bench.is_policed = false;
        for doing in doings {
            do_it(&mut bench, doing);
            prop_assert!(bench.master().deadline().is_some());
        }
        for slave in &mut bench.slaves {
            slave.always = None;
            slave.present = true;
            slave.lose = 0;
        }
        // A collision of addresses costs a second, a configuration that noise confirmed two.
        for _ in 0..80 {
            if bench.masters[0].slaves().all(|slave| slave.state == SlaveState::DataExchange) {
                break;
            }
            bench.run(Duration::from_millis(50));
        }
        for slave in bench.masters[0].slaves() {
            prop_assert_eq!(slave.state, SlaveState::DataExchange);
        }
    }
}
