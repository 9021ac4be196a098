//! Memories, power cuts and a master played by hand, on a port of this process.

use std::path::Path;

use codewheel_device::MemoryState;
use codewheel_link::{BusUri, CanPort, Clock, Received};
use codewheel_plant::{DeviceSnapshot, PortBus, StartError};
use codewheel_sim::can::parse_frame;
use codewheel_station::Duration;
use codewheel_station::can::BitRate;

use super::{millis, only_bus, plant};

/// An encoder on a bus of this process, its Save answered or cut off, and a port beside it.
struct Bench {
    bus: PortBus,
    port: Box<dyn CanPort>,
    clock: Clock,
}

impl Bench {
    fn new(name: &str, more: &str) -> Self {
        let text = format!(
            "[[bus]]\nname = \"b\"\nuri = \"virtual:{name}\"\n\
             [[device]]\nmodel = \"amg11-d29\"\naddress = 5\n{more}\n"
        );
        let uri: BusUri = format!("virtual:{name}").parse().unwrap();
        let port = codewheel_link::open(&uri, BitRate::Kbit125).unwrap();
        let clock = Clock::new();
        let bus = PortBus::power_up(only_bus(plant(&text)), clock).unwrap();
        Self { bus, port, clock }
    }

    /// Says `text` again and again until `answer` is heard.
    fn ask(&mut self, text: &str, answer: &str) {
        loop {
            assert!(self.port.send(&parse_frame(text).unwrap()).unwrap());
            let again = self.clock.now() + Duration::from_millis(100);
            while self.clock.now() < again {
                self.bus.turn(Some(again)).unwrap();
                if self.heard().iter().any(|frame| frame == answer) {
                    return;
                }
            }
            assert!(self.clock.now() < millis(20_000), "no answer to {text}");
        }
    }

    fn run_until(&mut self, wanted: impl Fn(&DeviceSnapshot) -> bool) -> DeviceSnapshot {
        loop {
            self.bus.turn(Some(self.clock.now() + Duration::from_millis(20))).unwrap();
            let [device] = <[_; 1]>::try_from(self.bus.snapshot().devices).expect("one device");
            if wanted(&device) {
                return device;
            }
            assert!(self.clock.now() < millis(20_000), "{device:?}");
        }
    }

    fn heard(&mut self) -> Vec<String> {
        let mut heard = Vec::new();
        while let Some(received) = self.port.receive(Some(std::time::Duration::ZERO)).unwrap() {
            if let Received::Frame(frame) = received {
                heard.push(frame.to_string());
            }
        }
        heard
    }
}

#[test]
fn what_was_saved_in_ram_outlives_a_power_cut_on_a_real_port() {
    let cut = "fault = [{ at = \"5s\", kind = \"power-cut\", for = \"100ms\" }]";
    let mut bench = Bench::new("power-cut-ram", cut);
    bench.ask("42E#0A4B0301030A", "42B#0ACB00");
    bench.ask("42C#0A162F01", "42B#0A96");
    bench.run_until(|device| device.device.is_none());
    let snapshot = bench.run_until(|device| device.device.is_some());
    let device = snapshot.device.expect("it has power");
    assert_eq!(device.memory, MemoryState::Good);
    assert!(device.writes >= 1);
}

#[test]
fn a_memory_file_in_use_stops_the_whole_bus_before_it_begins() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("memory");
    let keeping = format!("memory = '{}'", path.display());
    let _first = Bench::new("in-use-1", &keeping);
    let text = format!(
        "[[bus]]\nname = \"b\"\nuri = \"virtual:in-use-2\"\n\
         [[device]]\nmodel = \"amg11-d29\"\naddress = 5\n{keeping}\n"
    );
    let plan = only_bus(plant(&text));
    let error = PortBus::power_up(plan, Clock::new()).unwrap_err();
    assert!(matches!(error, StartError::Memory(_)), "{error}");
    assert!(error.to_string().contains("in use by another encoder"), "{error}");
    assert!(Path::new(&path).exists());
}
