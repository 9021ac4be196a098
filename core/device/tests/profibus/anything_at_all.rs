//! Any master whatever: never a panic, always legal settings, and always a way back.

use codewheel_device::product::PROFIBUS;
use codewheel_encoder::Reading;
use codewheel_encoder::ssi::LineFault;
use codewheel_profibus::State;
use codewheel_station::Duration;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::bench::{Bench, EXAMPLE, FULL_RANGE, octets_of, variable};

#[derive(Clone, Debug)]
enum Deed {
    Octets(Vec<u8>),
    Telegram { function: u8, saps: Option<(u8, u8)>, data: Vec<u8> },
    Parameters { user: Vec<u8> },
    Configuration { identifiers: Vec<u8> },
    Outputs(u32),
    ShortOutputs(u16),
    Control(u8),
    BringUp { example: bool, identifier: u8 },
    Diagnosis,
    Turn(u32),
    Cell(bool),
    Line(bool),
    Moves(bool),
    Wait(u32),
    PowerCycle,
    Memory(bool),
    MemoryFails,
}

fn any_deed() -> impl Strategy<Value = Deed> {
    let user = prop_oneof![
        vec(any::<u8>(), 0..20),
        (0_u8..16, 0_u32..10_000, 0_u32..1 << 30).prop_map(|(flags, steps, total)| {
            [&[0, flags][..], &steps.to_be_bytes(), &total.to_be_bytes()].concat()
        }),
    ];
    prop_oneof![
        1 => vec(any::<u8>(), 0..40).prop_map(Deed::Octets),
        2 => (any::<u8>(), any::<Option<(u8, u8)>>(), vec(any::<u8>(), 0..30))
            .prop_map(|(function, saps, data)| Deed::Telegram { function, saps, data }),
        3 => user.prop_map(|user| Deed::Parameters { user }),
        2 => vec(prop_oneof![Just(0xF1), Just(0xD0), any::<u8>()], 0..3)
            .prop_map(|identifiers| Deed::Configuration { identifiers }),
        4 => any::<u32>().prop_map(Deed::Outputs),
        1 => any::<u16>().prop_map(Deed::ShortOutputs),
        2 => any::<u8>().prop_map(Deed::Control),
        3 => (any::<bool>(), prop::sample::select(&[0xD0_u8, 0xD1, 0xF0, 0xF1][..]))
            .prop_map(|(example, identifier)| Deed::BringUp { example, identifier }),
        1 => Just(Deed::Diagnosis),
        3 => any::<u32>().prop_map(Deed::Turn),
        1 => any::<bool>().prop_map(Deed::Cell),
        1 => any::<bool>().prop_map(Deed::Line),
        1 => any::<bool>().prop_map(Deed::Moves),
        1 => (0_u32..3_000_000).prop_map(Deed::Wait),
        1 => Just(Deed::PowerCycle),
        1 => any::<bool>().prop_map(Deed::Memory),
        1 => Just(Deed::MemoryFails),
    ]
}

/// A set of parameters that every product takes.
fn parameters(bench: &Bench, example: bool) -> &'static str {
    match (bench.device.product().encoder.geometry.is_multiturn(), example) {
        (true, true) => EXAMPLE,
        (true, false) => FULL_RANGE,
        (false, true) => "0A 00000E10 00000064",
        (false, false) => "02",
    }
}

fn does(bench: &mut Bench, deed: Deed) {
    match deed {
        Deed::Octets(octets) => {
            bench.hears(&octets);
        }
        Deed::Telegram { function, saps, data } => {
            let body = match saps {
                Some((to, from)) => [&[0x87, 0x82, function, to, from][..], &data].concat(),
                None => [&[7, 2, function][..], &data].concat(),
            };
            bench.hears(&variable(&body));
        }
        Deed::Parameters { user } => {
            let set_prm = [&octets_of("B8 01 C8 0B 05 9B 00")[..], &user].concat();
            bench.asks(0x3D, &set_prm);
        }
        Deed::Configuration { identifiers } => {
            bench.asks(0x3E, &identifiers);
        }
        Deed::Outputs(outputs) => {
            let body = [&[7, 2, 0x5D][..], &outputs.to_be_bytes()].concat();
            bench.hears(&variable(&body));
        }
        Deed::ShortOutputs(outputs) => {
            let body = [&[7, 2, 0x7D][..], &outputs.to_be_bytes()].concat();
            bench.hears(&variable(&body));
        }
        Deed::Control(command) => bench.controls(command),
        Deed::BringUp { example, identifier } => {
            let octets = parameters(bench, example);
            bench.parameterizes(octets);
            bench.configures(identifier);
        }
        Deed::Diagnosis => {
            let diagnosis = bench.diagnosis();
            assert!([16, 57].contains(&diagnosis.len()));
        }
        Deed::Turn(code) => bench.turn_to(code),
        Deed::Cell(low) => bench.device.sensor_mut().cell_low = low,
        Deed::Line(good) => {
            let fault = Reading::Failed(LineFault::NoLowAfterWord);
            bench.device.sensor_mut().reading = if good { Reading::Fresh } else { fault };
        }
        Deed::Moves(moves) => bench.device.sensor_mut().turning = moves,
        Deed::Wait(micros) => bench.wait(Duration::from_micros(micros.into())),
        Deed::PowerCycle => bench.device.power_cycle(bench.now),
        Deed::Memory(serves) => bench.serves_memory = serves,
        Deed::MemoryFails => {
            if bench.device.keep(bench.now).is_some() {
                bench.device.kept(bench.now, Err(()));
            }
        }
    }
}

fn is_legal(bench: &Bench) {
    let snapshot = bench.snapshot();
    let model = bench.factory.model;
    assert_eq!(snapshot.in_force.check(model), Ok(()));
    assert_eq!(snapshot.saved.check(model), Ok(()));
    assert!(snapshot.position < snapshot.in_force.settings.total_in_force(model));
    let state = bench.state();
    if state.state == State::DataExchange && !state.class_2 {
        assert_eq!((snapshot.in_force.offset, snapshot.in_force.settings.scaling), (0, false));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn whatever_a_master_does_a_proper_one_exchanges_data_afterwards(
        product in 0..PROFIBUS.len(),
        deeds in vec(any_deed(), 0..40),
    ) {
        let mut bench = Bench::power_up(PROFIBUS[product].model);
        for deed in deeds {
            does(&mut bench, deed);
            is_legal(&bench);
        }
        // The watchdog of whoever held it runs out, but not without one: it is told to let go.
        bench.device.sensor_mut().turning = false;
        bench.device.sensor_mut().reading = Reading::Fresh;
        bench.wait(Duration::from_secs(700));
        bench.serves_memory = true;
        if bench.state().master.is_none_or(|master| master == 2) {
            let octets = parameters(&bench, true);
            bench.brings_up(octets, 0xF1);
            bench.exchanges("00000000");
            prop_assert_eq!(bench.position("80000007"), 7);
            prop_assert_eq!(bench.state().state, State::DataExchange);
            let mut bench = bench.power_cycled(0);
            let octets = parameters(&bench, true);
            bench.brings_up(octets, 0xF1);
            is_legal(&bench);
        }
    }
}
