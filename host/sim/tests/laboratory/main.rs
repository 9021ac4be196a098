//! The laboratory as its users see it, situation by situation.

mod acknowledge;
mod arbitration;
mod bus_off;
mod deadlines;
mod faults;
mod frame_length;
mod police;
mod power;
mod sensors;
mod shafts;
mod troubled;

use codewheel_sim::can::{Event, Script, Wire, parse_frame};
use codewheel_station::can::{BitRate, Filter, Frame};
use codewheel_station::{Duration, Instant};

/// A wire of hand-played stations at 500k, where a bit lasts 2 µs.
fn wire() -> Wire<Script> {
    Wire::new(BitRate::Kbit500, 1)
}

fn frame(text: &str) -> Frame {
    parse_frame(text).unwrap()
}

fn micros(micros: u64) -> Instant {
    Instant::ZERO + Duration::from_micros(micros)
}

fn millis(millis: u64) -> Instant {
    micros(millis * 1_000)
}

/// A station that says `texts`, one after the other, from `at` on.
fn saying(at: Instant, texts: &[&str]) -> Script {
    texts.iter().fold(Script::new(), |script, text| script.sending(at, frame(text)))
}

fn exactly(identifier: u16) -> Filter {
    Filter { mask: 0x7FF, value: identifier }
}

/// Runs the wire and collects what happened.
fn events<N: codewheel_sim::can::Node>(wire: &mut Wire<N>, until: Instant) -> Vec<Event> {
    let mut events = Vec::new();
    wire.run_until(until, &mut |event| events.push(event.clone()));
    events
}

/// The frames that went out, in the order of the wire.
fn frames(events: &[Event]) -> Vec<String> {
    let frame = |event: &Event| match event {
        Event::Frame { frame, .. } => Some(frame.to_string()),
        _ => None,
    };
    events.iter().filter_map(frame).collect()
}

/// The violations, each as the name of the station and what it did.
fn violations(events: &[Event]) -> Vec<String> {
    let violation = |event: &Event| match event {
        Event::Violation { station, rule, .. } => Some(format!("{station} {rule}")),
        _ => None,
    };
    events.iter().filter_map(violation).collect()
}
