//! What the encoder's answers cost, in instructions: counted under valgrind, so the same on a busy
//! machine as on a quiet one.
//!
//! ```text
//! cargo install gungraun-runner --version 0.20.0      # once; as the gungraun in Cargo.lock
//! cargo bench -p codewheel-device --bench poll        # needs valgrind
//! ```
//!
//! The first figure is the one that is wanted: a poll command in and its response out, on a turning
//! shaft, in at most 400 instructions. Nothing is allocated: the crates below are `no_std` without
//! `alloc`, which `proofs/no-std` holds.

// The macros make public items without documentation.
#![allow(missing_docs)]

use std::hint::black_box;

use codewheel_device::{DeviceNetEncoder, Factory, Product, Switches};
use codewheel_encoder::{Sample, Sensor, Start};
use codewheel_sim::shaft::Shaft;
use codewheel_station::can::{BitRate, Frame, Input};
use codewheel_station::{Duration, Instant, Station};
use gungraun::{library_benchmark, library_benchmark_group, main};

/// A sensor that costs next to nothing: its code moves on from sample to sample, at 1 500 rpm or so.
struct Moving {
    code: u32,
}

impl Sensor for Moving {
    fn sample(&mut self, _: Instant) -> Sample {
        self.code += 100;
        Sample { code: self.code, ..Sample::default() }
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        Some(now)
    }
}

/// An encoder that master 10 has allocated, and what it is to be asked next.
struct Allocated<S> {
    device: DeviceNetEncoder<S>,
    now: Instant,
    requests: Vec<Frame>,
}

const POLL_COMMAND: u16 = 0x42D;
const EXPLICIT_REQUEST: u16 = 0x42C;
const UNCONNECTED_REQUEST: u16 = 0x42E;

impl<S: Sensor> Allocated<S> {
    /// MAC ID 5, on-line, polled with an expected packet rate of 100 ms, at the moment before
    /// `requests` come.
    fn new(sensor: S, requests: &[(u16, &[u8])]) -> Box<Self> {
        let start = Start::Fresh { interrupted: false };
        let device = DeviceNetEncoder::power_up(
            Instant::ZERO,
            Product::find("amg11-d29").expect("in the catalogue"),
            Factory::with_serial(1),
            Switches::set_to(5, BitRate::Kbit500),
            &start,
            sensor,
        );
        let mut allocated = Self { device, now: Instant::ZERO, requests: Vec::new() };
        allocated.collect();
        allocated.wait(Duration::from_secs(3));
        allocated.answer(&Frame::standard(UNCONNECTED_REQUEST, &[0x0A, 0x4B, 3, 1, 3, 10]));
        allocated.answer(&Frame::standard(EXPLICIT_REQUEST, &[0x0A, 0x10, 5, 2, 9, 100, 0]));
        allocated.answer(&Frame::standard(POLL_COMMAND, &[]));
        allocated.wait(Duration::from_millis(10));
        allocated.requests =
            requests.iter().map(|(identifier, data)| Frame::standard(*identifier, data)).collect();
        Box::new(allocated)
    }

    fn collect(&mut self) -> usize {
        let mut frames = 0;
        while let Some(frame) = self.device.transmit(self.now) {
            self.device.handle(self.now, Input::Sent(&frame));
            frames += 1;
        }
        frames
    }

    fn answer(&mut self, request: &Frame) {
        self.device.handle(self.now, Input::Frame(request));
        assert_eq!(self.collect(), 1, "frames in answer to {request}");
    }

    /// Lets time pass, from deadline to deadline.
    fn wait(&mut self, span: Duration) {
        let end = self.now + span;
        while let Some(deadline) = self.device.deadline().filter(|deadline| *deadline <= end) {
            self.now = deadline;
            self.device.advance(deadline);
            self.collect();
        }
        // Half a millisecond before the shaft is looked at again.
        self.now = end + Duration::from_micros(500);
    }
}

fn moving(requests: &[(u16, &[u8])]) -> Box<Allocated<Moving>> {
    Allocated::new(Moving { code: 1_000 }, requests)
}

fn nothing() -> Box<Allocated<Moving>> {
    moving(&[])
}

fn one_poll() -> Box<Allocated<Moving>> {
    moving(&[(POLL_COMMAND, &[])])
}

fn one_poll_of_a_simulated_shaft() -> Box<Allocated<Shaft>> {
    let shaft = Shaft::parse("turn rpm=1500", 8_192, 65_536).expect("a shaft");
    Allocated::new(shaft, &[(POLL_COMMAND, &[])])
}

fn get_position() -> Box<Allocated<Moving>> {
    moving(&[(EXPLICIT_REQUEST, &[0x0A, 0x0E, 0x2F, 1, 12])])
}

fn set_steps_per_turn() -> Box<Allocated<Moving>> {
    moving(&[
        (EXPLICIT_REQUEST, &[0x8A, 0x00, 0x10, 0x2F, 1, 7, 0x10, 0x0E]),
        (EXPLICIT_REQUEST, &[0x8A, 0x81, 0x00, 0x00]),
    ])
}

/// With an unacknowledged change of state connection beside the polls, at the moment the shaft is
/// looked at again.
fn changing() -> Box<Allocated<Moving>> {
    let mut allocated = nothing();
    let set_rate = [0x0A, 0x10, 5, 4, 9, 0, 0];
    allocated.answer(&Frame::standard(UNCONNECTED_REQUEST, &[0x0A, 0x4B, 3, 1, 0x50, 10]));
    // The first production comes with the response.
    allocated
        .device
        .handle(allocated.now, Input::Frame(&Frame::standard(EXPLICIT_REQUEST, &set_rate)));
    assert_eq!(allocated.collect(), 2);
    allocated.wait(Duration::from_millis(10));
    allocated.now = allocated.device.deadline().expect("the shaft turns");
    allocated
}

/// Each request in, and whatever is owed for it out. Returns the device, so that what it costs to
/// get rid of it is not counted.
fn serve<S: Sensor>(mut allocated: Box<Allocated<S>>) -> Box<Allocated<S>> {
    let Allocated { device, now, requests } = &mut *allocated;
    for request in requests {
        device.handle(*now, Input::Frame(request));
        black_box(device.transmit(*now));
    }
    allocated
}

#[library_benchmark]
#[bench::of_a_moving_sensor(one_poll())]
#[bench::of_a_simulated_shaft(one_poll_of_a_simulated_shaft())]
fn poll_in_response_out<S: Sensor>(allocated: Box<Allocated<S>>) -> Box<Allocated<S>> {
    serve(allocated)
}

// All that a driver must do for a poll: run what fell due, take the poll in, ask for the response,
// report it sent, ask whether that was all and when to come back.
#[library_benchmark]
#[bench::of_a_moving_sensor(one_poll())]
fn poll_with_its_driver(mut allocated: Box<Allocated<Moving>>) -> Box<Allocated<Moving>> {
    let Allocated { device, now, requests } = &mut *allocated;
    for request in requests {
        device.advance(*now);
        device.handle(*now, Input::Frame(request));
        while let Some(response) = device.transmit(*now) {
            device.handle(*now, Input::Sent(&response));
        }
        black_box(device.deadline());
    }
    allocated
}

#[library_benchmark]
#[bench::get_position(get_position())]
fn explicit(allocated: Box<Allocated<Moving>>) -> Box<Allocated<Moving>> {
    serve(allocated)
}

// Two fragments in, two acknowledges and the response out.
#[library_benchmark]
#[bench::set_steps_per_turn(set_steps_per_turn())]
fn explicit_in_fragments(mut allocated: Box<Allocated<Moving>>) -> Box<Allocated<Moving>> {
    let Allocated { device, now, requests } = &mut *allocated;
    for request in requests {
        device.handle(*now, Input::Frame(request));
        while let Some(response) = device.transmit(*now) {
            black_box(response);
        }
    }
    allocated
}

// The shaft is looked at, has moved, and the position goes out without being asked for.
#[library_benchmark]
#[bench::of_a_moving_sensor(changing())]
fn change_of_state_out(mut allocated: Box<Allocated<Moving>>) -> Box<Allocated<Moving>> {
    let Allocated { device, now, .. } = &mut *allocated;
    device.advance(*now);
    assert!(black_box(device.transmit(*now)).is_some());
    allocated
}

#[library_benchmark]
#[bench::nothing_due(nothing())]
fn advance(mut allocated: Box<Allocated<Moving>>) -> Box<Allocated<Moving>> {
    let Allocated { device, now, .. } = &mut *allocated;
    device.advance(*now);
    allocated
}

library_benchmark_group!(
    name = answers;
    benchmarks =
        poll_in_response_out,
        poll_with_its_driver,
        change_of_state_out,
        explicit,
        explicit_in_fragments,
        advance
);

main!(library_benchmark_groups = answers);
