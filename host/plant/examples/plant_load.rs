//! What 100 encoders on four virtual buses cost, with and without somebody who watches closely.
//!
//! `cargo run --release -p codewheel-plant --example plant_load [SECONDS]` prints the share of one
//! processor that the plant takes: alone, with a watcher that wants 20 snapshots a second, and with a
//! trace besides. The processor time comes from Linux (`/proc/self/stat`).

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use codewheel_plant::Plant;

/// Encoders on each bus.
const DEVICES: u8 = 25;

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = std::env::args().nth(1).map_or(Ok(5), |seconds| seconds.parse())?;
    let phase = Duration::from_secs(seconds);
    let plant = Plant::parse(&plan(), "plant_load", Path::new(""))?;
    let running = plant.start(Duration::from_secs(1))?;
    // All masters have found their slaves.
    std::thread::sleep(Duration::from_secs(5));
    let alone = share(phase, || drop(running.snapshots(Duration::from_millis(100))))?;
    println!("alone: {:.1} % of a processor", alone * 100.0);
    let watcher = running.watch(Duration::from_millis(50));
    let (mut snapshots, mut devices) = (0, 0);
    let watched = share(phase, || {
        for (_, snapshot) in watcher.snapshots(Duration::from_millis(100)) {
            snapshots += 1;
            devices += snapshot.devices.len();
        }
    })?;
    println!(
        "with a watcher of 20 snapshots a second ({snapshots} came, of {devices} devices): {:.1} %, \
         {:.2} times as much",
        watched * 100.0,
        watched / alone
    );
    let traces: Vec<_> = running
        .descriptions()
        .iter()
        .map(|bus| running.trace(&bus.name))
        .collect::<Result<_, _>>()?;
    let mut lines = 0;
    let traced = share(phase, || {
        drop(watcher.snapshots(Duration::from_millis(100)));
        lines += traces.iter().map(|trace| trace.lines(Duration::ZERO).lines.len()).sum::<usize>();
    })?;
    println!(
        "with a trace of all buses besides ({lines} lines): {:.1} %, {:.2} times as much",
        traced * 100.0,
        traced / alone
    );
    running.stop().1?;
    Ok(())
}

/// Two DeviceNets whose scanners poll every 50 ms, and two PROFIBUS lines as fast as they go.
fn plan() -> String {
    let mut text = String::new();
    let buses = [
        ("left", "devicenet", "500k", "amg11-d29"),
        ("right", "devicenet", "500k", "amg11-d13"),
        ("upper", "profibus", "93.75k", "amg11-p29"),
        ("lower", "profibus", "93.75k", "amg11-p13"),
    ];
    for (bus, kind, baud, model) in buses {
        let _ = write!(text, "[[bus]]\nname = \"{bus}\"\nkind = \"{kind}\"\nbaud = \"{baud}\"\n");
        let mut slaves = String::new();
        for address in 10..10 + DEVICES {
            let _ = write!(
                text,
                "[[device]]\nbus = \"{bus}\"\nmodel = \"{model}\"\naddress = {address}\n\
                 shaft = \"turn rpm={address}\"\n"
            );
            let _ = write!(slaves, "{{ address = {address} }}, ");
        }
        let interval = if kind == "devicenet" { "interval = \"50ms\"\n" } else { "" };
        let _ = write!(
            text,
            "[[master]]\nbus = \"{bus}\"\naddress = 2\n{interval}slave = [{slaves}]\n"
        );
    }
    text
}

/// The share of one processor that this process takes for so long, while it does `what`.
fn share(lasts: Duration, mut what: impl FnMut()) -> Result<f64, Box<dyn Error>> {
    let (began, used) = (Instant::now(), processor_time()?);
    while began.elapsed() < lasts {
        what();
    }
    let used = processor_time()?.saturating_sub(used);
    Ok(used.as_secs_f64() / began.elapsed().as_secs_f64())
}

/// The processor time of this process in user and kernel mode, by `proc_pid_stat(5)`.
fn processor_time() -> Result<Duration, Box<dyn Error>> {
    let stat = std::fs::read_to_string("/proc/self/stat")
        .map_err(|error| format!("cannot read /proc/self/stat: {error}: this needs Linux"))?;
    // The name of the program stands in parentheses and may contain blanks.
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks: u64 = fields
        .split_whitespace()
        .skip(11)
        .take(2)
        .filter_map(|field| field.parse::<u64>().ok())
        .sum();
    // The kernel counts in hundredths of a second here, whatever its own tick is.
    Ok(Duration::from_millis(ticks * 10))
}
