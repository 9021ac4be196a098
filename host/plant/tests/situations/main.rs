//! Plants as their users meet them: files, faults, ports.

mod commands;
mod complaints;
mod connections;
mod examples;
mod faults;
mod one_line;
mod one_port;
mod power_cuts;
mod profibus;
mod recording;
mod running;
mod watching;

use std::path::{Path, PathBuf};

use codewheel_plant::{
    AnyBusPlan, BusPlan, BusSnapshot, DeviceSnapshot, FieldBus, Plant, Profibus, VirtualBus,
};
use codewheel_station::{Duration, Instant};

/// The plant that `text` describes.
#[track_caller]
fn plant(text: &str) -> Plant {
    Plant::parse(text, "plant.toml", Path::new(""))
        .unwrap_or_else(|complaint| panic!("{complaint}"))
}

/// Its only bus, a DeviceNet.
#[track_caller]
fn only_bus(plant: Plant) -> BusPlan {
    match <[AnyBusPlan; 1]>::try_from(plant.buses) {
        Ok([AnyBusPlan::DeviceNet(bus)]) => bus,
        other => panic!("not one DeviceNet: {other:?}"),
    }
}

/// Its only bus, a PROFIBUS.
#[track_caller]
fn only_profibus(plant: Plant) -> BusPlan<Profibus> {
    match <[AnyBusPlan; 1]>::try_from(plant.buses) {
        Ok([AnyBusPlan::Profibus(bus)]) => bus,
        other => panic!("not one PROFIBUS: {other:?}"),
    }
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name)
}

fn millis(millis: u64) -> Instant {
    Instant::ZERO + Duration::from_millis(millis)
}

/// Runs a bus and gives its snapshot.
fn at<B: FieldBus>(bus: &mut VirtualBus<B>, millis_from_start: u64) -> BusSnapshot {
    bus.run_until(millis(millis_from_start), &mut |_| {});
    bus.snapshot()
}

#[track_caller]
fn device<'a>(snapshot: &'a BusSnapshot, name: &str) -> &'a DeviceSnapshot {
    snapshot.devices.iter().find(|device| device.name == name).expect("the device")
}

/// What a device has reported.
fn told(snapshot: &BusSnapshot, name: &str) -> Vec<String> {
    device(snapshot, name).reports.iter().map(|report| report.what.to_string()).collect()
}
