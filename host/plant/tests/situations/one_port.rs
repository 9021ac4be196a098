//! Several stations on one real port.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use codewheel_link::Clock;
use codewheel_plant::{BusSnapshot, PortBus, SlaveState};

use super::{device, millis, only_bus, plant};

const PLANT: &str = r#"
    [[bus]]
    name = "b"
    uri = "slcan-listen:127.0.0.1:0"
    baud = "500k"
    [[master]]
    address = 0
    interval = "20ms"
    [[device]]
    name = "first"
    model = "amg11-d29"
    address = 5
    shaft = "still angle=74565"
    [[device]]
    name = "second"
    model = "hmg10-d13"
    address = 6
    shaft = "still angle=100"
    fault = [{ at = "6s", kind = "bus-off" }]
    [[device]]
    name = "third"
    model = "amg11-d13"
    address = 7
    shaft = "still angle=200"
    [[device]]
    name = "twin"
    model = "amg11-d13"
    address = 7
    duplicate = true
    fault = [{ at = "0s", kind = "power-cut", for = "2500ms" }]
"#;

#[test]
fn three_encoders_and_a_scanner_share_a_port_with_each_other_and_with_clients() {
    let clock = Clock::new();
    let mut bus = PortBus::power_up(only_bus(plant(PLANT)), clock).unwrap();
    let address = bus.uri().strip_prefix("slcan-listen:").unwrap().to_owned();
    let client = std::thread::spawn(move || {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(b"O\r").unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let mut heard = String::new();
        let mut octets = [0; 4096];
        // Poll and answer of the first encoder, side by side, and so of the third.
        while !(heard.contains("t42D0\r")
            && heard.contains("t3C5445230100\r")
            && heard.contains("t3C74C8000000\r"))
        {
            let count = stream.read(&mut octets).unwrap();
            assert!(count > 0, "the port was closed");
            heard.push_str(&String::from_utf8_lossy(&octets[..count]));
        }
        heard
    });
    let all_polled = |snapshot: &BusSnapshot| {
        [("first", 74_565), ("second", 100), ("third", 200)].iter().all(|(name, position)| {
            let master = device(snapshot, name).master.as_ref().unwrap();
            master.state == SlaveState::Running && master.position == Some(*position)
        })
    };
    run_until(&mut bus, clock, all_polled);
    // The twin came later, so it is the one that stays silent.
    run_until(&mut bus, clock, |snapshot| lamp(snapshot, "twin") == "red" && all_polled(snapshot));
    let heard = client.join().unwrap();
    assert!(heard.contains("t42F7"), "the duplicate MAC ID checks go out too");
    // Only one is bus-off.
    run_until(&mut bus, clock, |snapshot| lamp(snapshot, "second") == "red");
    run_until(&mut bus, clock, |snapshot| lamp(snapshot, "first") == "green");
}

/// Runs the bus until it is as wanted, twenty seconds at most.
#[track_caller]
fn run_until(bus: &mut PortBus, clock: Clock, wanted: impl Fn(&BusSnapshot) -> bool) {
    loop {
        bus.turn(Some(clock.now() + codewheel_station::Duration::from_millis(20))).unwrap();
        let snapshot = bus.snapshot();
        if wanted(&snapshot) {
            return;
        }
        assert!(clock.now() < millis(20_000), "{snapshot:#?}");
    }
}

fn lamp(snapshot: &BusSnapshot, name: &str) -> String {
    device(snapshot, name).device.as_ref().map_or("off".into(), |device| device.lamp.to_string())
}
