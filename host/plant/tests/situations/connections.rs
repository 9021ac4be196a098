//! The ways a scanner fetches the data of its slaves, from the plant file to the wire.

use codewheel_devicenet::connection::State;
use codewheel_plant::{SlaveState, VirtualBus};

use super::{at, device, only_bus, plant};

const PLANT: &str = r#"
    [[bus]]
    name = "line"
    baud = "500k"
    [[device]]
    name = "polled"
    model = "amg11-d29"
    address = 5
    shaft = "turn rpm=60"
    [[device]]
    name = "changing"
    model = "amg11-d29"
    address = 6
    shaft = "turn rpm=60"
    [[device]]
    name = "resting"
    model = "amg11-d29"
    address = 7
    [[device]]
    name = "cyclic"
    model = "amg81-d29"
    address = 8
    shaft = "turn rpm=60"
    termination = true
    [[device]]
    name = "asked"
    model = "hmg10-d13"
    address = 9
    [[master]]
    address = 0
    slave = [
        { address = 5 },
        { address = 6, connection = "change-of-state", production_inhibit = "20ms" },
        { address = 7, connection = "change-of-state", expected_packet_rate = "500ms" },
        { address = 8, connection = "cyclic", expected_packet_rate = "50ms", acknowledged = false,
          assembly = 2 },
        { address = 9, connection = "explicit" },
    ]
"#;

#[test]
fn each_slave_exchanges_its_data_the_way_the_plan_says() {
    let mut bus = VirtualBus::power_up(only_bus(plant(PLANT))).unwrap();
    at(&mut bus, 4_000);
    let snapshot = at(&mut bus, 6_000);
    let rates = [("polled", 100.0), ("changing", 50.0), ("resting", 2.0), ("cyclic", 20.0)];
    for (name, rate) in rates {
        let device = device(&snapshot, name);
        let master = device.master.as_ref().unwrap();
        assert_eq!(master.state, SlaveState::Running, "{name}");
        let seen = master.answers_per_second;
        assert!((seen - rate).abs() <= 1.0 + rate * 0.05, "{name}: {seen} a second, not {rate}");
    }
    let state = |name| {
        let device = device(&snapshot, name).device.as_ref().unwrap();
        let network = device.devicenet().expect("a DeviceNet device");
        (network.poll, network.change_of_state, network.explicit.is_some())
    };
    assert_eq!(state("polled"), (Some(State::Established), None, true));
    assert_eq!(state("cyclic"), (None, Some(State::Established), true));
    assert_eq!(state("asked"), (None, None, true));
    let asked = device(&snapshot, "asked").master.as_ref().unwrap();
    assert_eq!((asked.state, asked.answers_per_second), (SlaveState::Running, 0.0));
}

#[test]
fn the_printed_plan_keeps_the_ways_of_exchange() {
    let before = plant(PLANT);
    let printed = before.to_text();
    assert_eq!(plant(&printed), before, "{printed}");
    assert!(printed.contains("change-of-state"), "{printed}");
}
