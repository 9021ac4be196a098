//! What a Data_Exchange costs, in instructions: counted under valgrind, so the same on a busy
//! machine as on a quiet one.
//!
//! ```text
//! cargo install gungraun-runner --version 0.20.0      # once; as the gungraun in Cargo.lock
//! cargo bench -p codewheel-device --bench exchange    # needs valgrind
//! ```
//!
//! The first figure is the one that is wanted: 13 octets of Data_Exchange with configuration F1h and
//! a new FCB in, 13 octets out, on a turning shaft, in at most 600 instructions. How long that lasts
//! on a machine is what `--bench exchange_time` measures.

// The macros make public items without documentation.
#![allow(missing_docs)]

#[path = "exchanging/mod.rs"]
mod exchanging;

use std::hint::black_box;

use codewheel_station::Station;
use codewheel_station::rs485::Input;
use gungraun::{library_benchmark, library_benchmark_group, main};

use self::exchanging::Exchanging;

/// At the moment when the request ends and its FCB is new.
fn fresh() -> Box<Exchanging> {
    let mut exchanging = Exchanging::new();
    exchanging.pause();
    exchanging
}

/// With the top bit of the preset seen 0 just before.
fn before_a_preset() -> Box<Exchanging> {
    let mut exchanging = Exchanging::new();
    exchanging.exchange(false);
    exchanging.pause();
    exchanging
}

// Request in, response out. Returns the device, so that what it costs to get rid of it is not
// counted.
#[library_benchmark]
#[bench::of_a_moving_sensor(fresh())]
fn data_exchange(mut exchanging: Box<Exchanging>) -> Box<Exchanging> {
    assert!(black_box(exchanging.exchange(false)));
    exchanging
}

#[library_benchmark]
#[bench::in_range(before_a_preset())]
fn preset(mut exchanging: Box<Exchanging>) -> Box<Exchanging> {
    assert!(black_box(exchanging.exchange(true)));
    exchanging
}

// A whole diagnosis of 57 octets, 68 on the line.
#[library_benchmark]
#[bench::of_class_2(fresh())]
fn slave_diagnosis(mut exchanging: Box<Exchanging>) -> Box<Exchanging> {
    assert!(black_box(exchanging.diagnosis()));
    exchanging
}

// The request of another station, which is heard and not answered.
#[library_benchmark]
#[bench::of_13_octets(fresh())]
fn telegram_of_others(mut exchanging: Box<Exchanging>) -> Box<Exchanging> {
    let Exchanging { device, now, .. } = &mut *exchanging;
    device.handle(*now, Input::Octets(&exchanging::OF_OTHERS));
    assert!(black_box(device.deadline()).is_some());
    exchanging
}

#[library_benchmark]
#[bench::nothing_due(fresh())]
fn advance(mut exchanging: Box<Exchanging>) -> Box<Exchanging> {
    let Exchanging { device, now, .. } = &mut *exchanging;
    device.advance(*now);
    exchanging
}

library_benchmark_group!(
    name = answers;
    benchmarks = data_exchange, preset, slave_diagnosis, telegram_of_others, advance
);

main!(library_benchmark_groups = answers);
