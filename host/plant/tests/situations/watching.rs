//! Several readers, commands from other threads, and traces, by the clock on the wall.

use std::sync::Arc;
use std::time::{Duration, Instant};

use codewheel_plant::{Cause, Command, Running, TraceLine, Watcher};

use super::plant;

const PATIENCE: Duration = Duration::from_secs(10);
const NEVER: Duration = Duration::from_secs(3_600);

/// A polled DeviceNet and a PROFIBUS, simulated, and a DeviceNet on a port.
const THREE_BUSES: &str = r#"
    [[bus]]
    name = "line"
    baud = "500k"
    [[bus]]
    name = "hall"
    kind = "profibus"
    baud = "500k"
    [[bus]]
    name = "port"
    uri = "slcan-listen:127.0.0.1:0"
    [[device]]
    name = "drive"
    bus = "line"
    model = "amg11-d29"
    address = 5
    shaft = "still angle=1000"
    [[device]]
    name = "crane"
    bus = "hall"
    model = "amg11-p29"
    address = 7
    [[device]]
    name = "gate"
    bus = "port"
    model = "amg11-d13"
    address = 6
    [[master]]
    bus = "line"
    address = 0
    interval = "10ms"
    slave = [{ address = 5 }]
    [[master]]
    bus = "hall"
    address = 2
    slave = [{ address = 7 }]
"#;

fn start(period: Duration) -> Arc<Running> {
    Arc::new(plant(THREE_BUSES).start(period).unwrap())
}

#[test]
fn each_watcher_is_told_everything_at_its_own_pace() {
    let running = start(NEVER);
    let slow = running.watch(Duration::from_millis(500));
    let fast = running.watch(Duration::from_millis(20));
    for on in [false, true].repeat(5) {
        for (bus, device) in [("line", "drive"), ("port", "gate")] {
            running.command(bus, device, Command::Power(on)).unwrap();
        }
        std::thread::sleep(Duration::from_millis(15));
    }
    for (bus, device) in [("line", "drive"), ("port", "gate")] {
        running.command(bus, device, Command::Preset(3)).unwrap();
    }
    let count =
        |told: &[String]| told.iter().filter(|text| *text == "the power is switched on").count();
    let (slowly, quickly) = (hears_both(&slow), hears_both(&fast));
    assert_eq!(slowly.map(|told| count(&told)), [5, 5]);
    assert_eq!(quickly.map(|told| count(&told)), [5, 5]);
}

/// What a watcher is told of both devices of DeviceNet until both have had a preset.
#[track_caller]
fn hears_both(watcher: &Watcher) -> [Vec<String>; 2] {
    let deadline = Instant::now() + PATIENCE;
    let mut told = [Vec::new(), Vec::new()];
    let presets =
        |told: &Vec<String>| told.iter().filter(|text| *text == "preset executed").count();
    while told.iter().any(|told| presets(told) < 1) {
        assert!(Instant::now() < deadline, "{told:?}");
        for (_, snapshot) in watcher.snapshots(PATIENCE) {
            for device in &snapshot.devices {
                let place = ["drive", "gate"].iter().position(|name| *name == device.name);
                let Some(place) = place else { continue };
                told[place].extend(device.reports.iter().map(|report| report.what.to_string()));
            }
        }
    }
    told
}

#[test]
fn without_a_fast_watcher_there_are_no_fast_snapshots() {
    let running = start(NEVER);
    let at_once = running.snapshots(PATIENCE);
    assert!(!at_once.is_empty(), "everybody gets the first one");
    let fast = running.watch(Duration::from_millis(20));
    let deadline = Instant::now() + PATIENCE;
    let mut seen = [0; 3];
    while seen.iter().any(|count| *count < 4) {
        assert!(Instant::now() < deadline, "{seen:?}");
        fast.snapshots(PATIENCE).iter().for_each(|(place, _)| seen[*place] += 1);
    }
    drop(fast);
    std::thread::sleep(Duration::from_millis(50));
    let _ = running.snapshots(Duration::ZERO);
    let later = running.snapshots(Duration::from_millis(300));
    assert!(later.is_empty(), "nobody wants one for an hour");
}

#[test]
fn commands_come_from_any_thread_and_are_answered_when_they_are_done() {
    let running = start(NEVER);
    let threads: Vec<_> = (0..8)
        .map(|_| {
            let running = Arc::clone(&running);
            std::thread::spawn(move || running.command("line", "drive", Command::TurnBy(10)))
        })
        .collect();
    for thread in threads {
        thread.join().unwrap().unwrap();
    }
    running.command("line", "drive", Command::Preset(0)).unwrap();
    running.command("line", "drive", Command::Save).unwrap();
    let objects = running.objects("line", "drive").unwrap();
    let preset = objects[0].objects.iter().find(|object| object.key == "preset").unwrap();
    assert_eq!(preset.saved, preset.value);
    let watcher = running.watch(Duration::from_millis(10));
    std::thread::sleep(Duration::from_millis(200));
    let snapshots = watcher.snapshots(PATIENCE);
    let (_, line) = snapshots.iter().find(|(place, _)| *place == 0).expect("the line");
    assert_eq!(line.devices[0].state.shaft.code, Some(1_080), "all eight turns");
    assert_eq!(line.devices[0].state.memory.as_ref().unwrap().writes, 1);
    let unknown = running.command("lane", "drive", Command::Stop).unwrap_err();
    assert!(unknown.text.contains("there is line, hall, port"), "{unknown}");
    running.stop().1.unwrap();
    let stopped = running.command("line", "drive", Command::Stop).unwrap_err();
    assert_eq!(stopped.cause, Cause::Stopped);
}

/// The first line that `wanted` takes.
#[track_caller]
fn line(running: &Running, bus: &str, wanted: impl Fn(&TraceLine) -> bool) -> TraceLine {
    let trace = running.trace(bus).unwrap();
    let deadline = Instant::now() + PATIENCE;
    loop {
        let traced = trace.lines(PATIENCE);
        if let Some(line) = traced.lines.iter().find(|line| wanted(line)) {
            return line.clone();
        }
        assert!(Instant::now() < deadline, "{:?}", traced.lines);
    }
}

#[test]
fn a_trace_names_what_a_bus_carries_while_somebody_listens() {
    let running = start(NEVER);
    let response = line(&running, "line", |line| line.name == "poll response");
    assert_eq!((response.from, response.identifier.as_str()), (Some(5), "3C5"));
    assert_eq!(response.octets, "E8 03 00 00");
    assert!(response.text.starts_with("position 1000 step"), "{}", response.text);
    let exchange = line(&running, "hall", |line| {
        line.name.contains("answer") && line.from == Some(7) || line.text.contains("position")
    });
    assert_eq!((exchange.from, exchange.to), (Some(7), Some(2)), "{exchange:?}");
    assert!(exchange.octets.starts_with("68 "), "{exchange:?}");
    let trace = running.trace("port").unwrap();
    running.command("port", "gate", Command::Power(false)).unwrap();
    running.command("port", "gate", Command::Power(true)).unwrap();
    let deadline = Instant::now() + PATIENCE;
    let is_check =
        |line: &TraceLine| line.name == "duplicate MAC ID check request" && line.from == Some(6);
    let mut lines = Vec::new();
    while !lines.iter().any(is_check) {
        assert!(Instant::now() < deadline, "{lines:?}");
        lines.extend(trace.lines(Duration::from_secs(2)).lines);
    }
}

#[test]
fn a_trace_that_nobody_reads_keeps_the_newest_and_counts_the_rest() {
    let text = "[[bus]]\nname = \"b\"\nkind = \"profibus\"\nbaud = \"1.5M\"\n\
                [[device]]\nmodel = \"amg11-p29\"\naddress = 7\n\
                [[master]]\naddress = 2\nslave = [{ address = 7 }]\n";
    let running = plant(text).start(NEVER).unwrap();
    let trace = running.trace("b").unwrap();
    std::thread::sleep(Duration::from_secs(3));
    let traced = trace.lines(PATIENCE);
    assert_eq!(traced.lines.len(), 4_096);
    assert!(traced.lost > 0);
    assert!(traced.lines.is_sorted_by_key(|line| line.at));
}

#[test]
fn a_plant_says_what_is_in_it() {
    let running = start(NEVER);
    let [line, hall, port] = running.descriptions() else { panic!("three buses") };
    assert_eq!((line.name.as_str(), line.bit_rate.as_str()), ("line", "500k"));
    assert!(port.uri.starts_with("slcan-listen:127.0.0.1:") && !port.uri.ends_with(":0"));
    let [drive] = &line.devices[..] else { panic!("one device") };
    assert_eq!((drive.singleturn_resolution, drive.revolutions, drive.serial), (8_192, 65_536, 5));
    assert_eq!(drive.bit_rates, ["125k", "250k", "500k"]);
    assert_eq!((drive.dip.len(), hall.devices[0].dip.len()), (3, 0));
    assert_eq!(hall.masters[0].address, 2);
    assert!(drive.settings_fixed.is_none() && drive.shaft_fixed.is_none());
    assert!(drive.faults.iter().any(|fault| fault.kind == "bus-off"));
}
