//! One JSON object a line, for each device and second, and for each bus that has something to tell.

use std::io::{self, Write};

use codewheel_plant::{BusSnapshot, DeviceSnapshot, Report, SlaveSnapshot};
use serde::Serialize;

use super::{Show, cycle_ms, fresh, rpm, strangers, word};

pub(super) struct Json;

/// A device at one moment. What is `null` is not known: without power, without a master here.
#[derive(Serialize)]
struct Line<'a> {
    /// Seconds since the start.
    at: f64,
    bus: &'a str,
    uri: &'a str,
    device: &'a str,
    address: u8,
    model: &'a str,
    product: &'a str,
    position: Option<u32>,
    turns: Option<u32>,
    /// Steps a second.
    speed: Option<i64>,
    rpm: Option<f64>,
    alarm: Option<bool>,
    warning: Option<bool>,
    lamp: &'static str,
    connection: &'a str,
    polls_per_second: Option<f64>,
    cycle_ms: Option<f64>,
    bus_load: Option<f64>,
    events: Vec<Event>,
}

/// A slave that is no device of this plant, as its master sees it.
#[derive(Serialize)]
struct StrangerLine<'a> {
    at: f64,
    bus: &'a str,
    uri: &'a str,
    address: u8,
    position: Option<u32>,
    alarm: Option<bool>,
    warning: Option<bool>,
    connection: &'a str,
    polls_per_second: f64,
    cycle_ms: f64,
}

/// What happened on a bus itself.
#[derive(Serialize)]
struct BusLine<'a> {
    at: f64,
    bus: &'a str,
    uri: &'a str,
    events: Vec<Event>,
}

#[derive(Serialize)]
struct Event {
    at: f64,
    trouble: bool,
    text: String,
}

impl Show for Json {
    fn draw(&mut self, newest: &[Option<BusSnapshot>], places: &[usize]) -> io::Result<()> {
        let mut out = io::stdout().lock();
        for bus in fresh(newest, places) {
            for device in &bus.devices {
                write(&mut out, &line(bus, device))?;
            }
            for (address, slave) in strangers(bus) {
                write(&mut out, &stranger(bus, *address, slave))?;
            }
            if !bus.reports.is_empty() {
                let (at, events) = (seconds(bus.at), events(&bus.reports));
                write(&mut out, &BusLine { at, bus: &bus.name, uri: &bus.uri, events })?;
            }
        }
        out.flush()
    }
}

fn write(out: &mut impl Write, line: &impl Serialize) -> io::Result<()> {
    let text = serde_json::to_string(line).map_err(io::Error::from)?;
    writeln!(out, "{text}")
}

fn events(reports: &[Report]) -> Vec<Event> {
    let event = |report: &Report| Event {
        at: seconds(report.at),
        trouble: report.what.is_trouble(),
        text: report.what.to_string(),
    };
    reports.iter().map(event).collect()
}

fn seconds(at: codewheel_station::Instant) -> f64 {
    at.as_nanos() as f64 / 1e9
}

fn line<'a>(bus: &'a BusSnapshot, device: &'a DeviceSnapshot) -> Line<'a> {
    let snapshot = device.device.as_ref();
    Line {
        at: seconds(bus.at),
        bus: &bus.name,
        uri: &bus.uri,
        device: &device.name,
        address: device.address,
        model: device.product.model,
        product: device.product.title,
        position: snapshot.map(|device| device.position),
        turns: snapshot.map(codewheel_device::Snapshot::turns),
        speed: snapshot.map(|device| device.velocity),
        rpm: snapshot.map(rpm),
        alarm: snapshot.map(|device| device.alarm),
        warning: snapshot.map(|device| device.warning),
        lamp: device.state.lamp.text,
        connection: device.state.connection,
        polls_per_second: device.master.as_ref().map(|master| master.answers_per_second),
        cycle_ms: device.master.as_ref().map(cycle_ms),
        bus_load: bus.load,
        events: events(&device.reports),
    }
}

fn stranger<'a>(bus: &'a BusSnapshot, address: u8, slave: &SlaveSnapshot) -> StrangerLine<'a> {
    StrangerLine {
        at: seconds(bus.at),
        bus: &bus.name,
        uri: &bus.uri,
        address,
        position: slave.position,
        alarm: slave.diagnosis.map(|diagnosis| diagnosis.alarm),
        warning: slave.diagnosis.map(|diagnosis| diagnosis.warning),
        connection: word(slave.state),
        polls_per_second: slave.answers_per_second,
        cycle_ms: cycle_ms(slave),
    }
}
