//! Many slaves on one real RS-485 port, and a master that comes from elsewhere.

use std::sync::atomic::{AtomicBool, Ordering};

use codewheel_link::Clock;
use codewheel_plant::{BusSnapshot, Plant, PortBus, Profibus, SlaveState};
use codewheel_station::Duration;

use super::{device, example, millis, only_profibus, plant};

#[test]
fn thirty_one_slaves_on_one_port_exchange_data_with_a_master_on_tcp() {
    let clock = Clock::new();
    let mut plan = only_profibus(Plant::load(&example("profibus.toml")).unwrap());
    plan.uri = "rs485-listen:127.0.0.1:0".parse().unwrap();
    assert_eq!(plan.devices.len(), 31);
    let mut line = PortBus::power_up(plan, clock).unwrap();
    let address = line.uri().strip_prefix("rs485-listen:").unwrap().to_owned();
    let slaves: String =
        (3..34).map(|slave| format!("{{ address = {slave}, scaling = false }}, ")).collect();
    let text = format!(
        "[[bus]]\nname = \"m\"\nkind = \"profibus\"\nuri = \"rs485:{address}\"\nbaud = \"1.5M\"\n\
         [[master]]\naddress = 2\nwatchdog = \"5s\"\nslave = [{slaves}]\n"
    );
    let mut master = PortBus::power_up(only_profibus(plant(&text)), clock).unwrap();
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(Ordering::Relaxed) {
                master.turn(Some(clock.now() + Duration::from_millis(20))).unwrap();
                let snapshot = master.snapshot();
                let running = |state| state == SlaveState::Running;
                if snapshot.masters[0].slaves.iter().all(|(_, slave)| running(slave.state)) {
                    stop.store(true, Ordering::Relaxed);
                }
                assert!(clock.now() < millis(60_000), "{snapshot:#?}");
            }
        });
        while !stop.load(Ordering::Relaxed) {
            line.turn(Some(clock.now() + Duration::from_millis(20))).unwrap();
        }
        let snapshot = line.snapshot();
        assert_eq!(snapshot.devices.len(), 31);
        for device in &snapshot.devices {
            let lamp = device.device.as_ref().unwrap().lamp.to_string();
            assert_eq!(lamp, "green", "{}", device.name);
        }
    });
}

#[test]
fn slaves_and_a_master_of_one_plant_share_a_port_and_hear_each_other() {
    let text = r#"
        [[bus]]
        name = "b"
        kind = "profibus"
        uri = "rs485-listen:127.0.0.1:0"
        baud = "187.5k"
        [[device]]
        name = "first"
        model = "amg11-p29"
        address = 7
        shaft = "still angle=1000"
        [[device]]
        name = "second"
        model = "hmg10-p13"
        address = 8
        shaft = "still angle=200"
        fault = [{ at = "0s", kind = "power-cut", for = "1s" }]
        [[master]]
        address = 2
        [[master.slave]]
        address = 7
        preset = [{ at = "1500ms", value = 42 }]
        [[master.slave]]
        address = 8
        configuration = "F0"
    "#;
    let clock = Clock::new();
    let mut bus = PortBus::power_up(only_profibus(plant(text)), clock).unwrap();
    let seen = |snapshot: &BusSnapshot, name: &str, position| {
        let master = device(snapshot, name).master.unwrap();
        master.state == SlaveState::Running && master.position == Some(position)
    };
    run_until(&mut bus, clock, |snapshot| seen(snapshot, "first", 1_000));
    run_until(&mut bus, clock, |snapshot| {
        seen(snapshot, "first", 42) && seen(snapshot, "second", 200)
    });
}

/// Runs the bus until it is as wanted, twenty seconds at most.
#[track_caller]
fn run_until(bus: &mut PortBus<Profibus>, clock: Clock, wanted: impl Fn(&BusSnapshot) -> bool) {
    loop {
        bus.turn(Some(clock.now() + Duration::from_millis(20))).unwrap();
        let snapshot = bus.snapshot();
        if wanted(&snapshot) {
            return;
        }
        assert!(clock.now() < millis(20_000), "{snapshot:#?}");
    }
}
