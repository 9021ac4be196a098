//! How much faster than life a full segment runs: 63 encoders and a scanner that polls them without
//! pause, on one simulated wire and one core.
//!
//! ```text
//! cargo bench -p codewheel-device --bench segment
//! ```
//!
//! Prints a table and judges nothing: wall time is only good for comparing rows of one run. The
//! wanted figure is 50 virtual seconds per wall second or more, with all shafts turning, at 500k.
//!
//! The last column holds the poll cycle against its worst case, in which every poll command takes
//! 55 bits and every response 95 (stuff bits and interframe space included): 18.9 ms at 500k.
//! Positions as they come need about 0.87 of that.

use std::time::Instant as WallInstant;

use codewheel_device::{DeviceNetEncoder, Factory, Product, Switches};
use codewheel_devicenet::scanner::{Scanner, ScannerIdentity, SlaveSettings, SlaveState};
use codewheel_devicenet::{MacId, Server};
use codewheel_encoder::{Encoder, Sensor, Start};
use codewheel_sim::can::{Either, NodeId, Wire};
use codewheel_sim::shaft::Shaft;
use codewheel_station::can::BitRate;
use codewheel_station::{Duration, Instant};

type Node = Either<Scanner, DeviceNetEncoder<Shaft>>;

const SLAVES: u8 = 63;
/// The longest poll exchange of four octets: an empty poll command and its response.
const EXCHANGE_BITS: u64 = 55 + 95;
/// What one measurement runs, and how many of them the median is taken of.
const RUN: Duration = Duration::from_secs(10);
const RUNS: usize = 7;

fn main() {
    println!("63 encoders and a scanner that polls them without pause:\n");
    println!(
        "shafts    rate  virtual s per wall s    frames/s  bus load      cycle  of worst case"
    );
    for rate in BitRate::ALL.into_iter().rev() {
        for shafts in ["turning", "resting"] {
            Segment::new(rate, shafts == "turning").measure(shafts);
        }
    }
    println!("\noctets of memory:\n");
    let sizes = [
        ("DeviceNetEncoder, 16 for its sensor", size_of::<DeviceNetEncoder<&mut dyn Sensor>>()),
        ("  Server", size_of::<Server>()),
        ("  Encoder", size_of::<Encoder>()),
        ("Scanner<63>", size_of::<Scanner<63>>()),
    ];
    for (name, octets) in sizes {
        println!("{name:<38}{octets:>8}");
    }
}

struct Segment {
    rate: BitRate,
    wire: Wire<Node>,
    scanner: NodeId,
}

impl Segment {
    /// A segment on which all encoders are polled.
    fn new(rate: BitRate, turning: bool) -> Self {
        let mut wire: Wire<Node> = Wire::new(rate, 1);
        let identity = ScannerIdentity { vendor: 1, serial: 1 };
        let mut scanner = Scanner::new(mac(0), identity, Duration::ZERO);
        // Explicit responses of high MAC IDs lose against every poll: while the slaves are
        // allocated, a pause lets them through.
        scanner.set_interscan_delay(Duration::from_millis(1));
        for address in 1..=SLAVES {
            scanner.add(SlaveSettings::poll(mac(address))).expect("room");
            let encoder = encoder(address, rate, turning);
            let filter = [encoder.filter()];
            wire.attach(format!("mac {address}"), Either::Right(encoder), &filter, false);
        }
        let filters = scanner.filters();
        let scanner = wire.attach("mac 0", Either::Left(scanner), &filters, true);
        let mut segment = Self { rate, wire, scanner };
        segment.run(Duration::from_secs(6));
        let running = (1..=SLAVES).filter_map(|address| segment.scanner().slave(mac(address)));
        let running = running.filter(|slave| slave.state == SlaveState::Running).count();
        assert_eq!(running, usize::from(SLAVES), "slaves that exchange data");
        if let Some(Either::Left(scanner)) = segment.wire.node_mut(segment.scanner) {
            scanner.set_interscan_delay(Duration::ZERO);
        }
        segment.run(Duration::from_secs(1));
        segment
    }

    fn run(&mut self, span: Duration) {
        self.wire.run_until(self.wire.now() + span, &mut |_| {});
    }

    fn scanner(&self) -> &Scanner {
        self.wire.node(self.scanner).and_then(Either::left).expect("it was never detached")
    }

    fn measure(&mut self, shafts: &str) {
        let (before, cycles) = (self.wire.statistics(), self.scanner().cycle_times().count);
        let mut walls: Vec<_> = (0..RUNS)
            .map(|_| {
                let begin = WallInstant::now();
                self.run(RUN);
                begin.elapsed()
            })
            .collect();
        walls.sort_unstable();
        let ratio = RUN.as_nanos() as f64 / walls[RUNS / 2].as_nanos() as f64;
        let after = self.wire.statistics();
        let nanos = after.at.since(before.at).as_nanos() as f64;
        let frames = (after.frames - before.frames) as f64 * 1e9 / nanos;
        let load = after.bus_load_since(&before);
        let cycle = nanos / (self.scanner().cycle_times().count - cycles) as f64;
        let worst = u64::from(SLAVES) * EXCHANGE_BITS * self.rate.bit_nanos();
        println!(
            "{shafts:<8}{:>6}{ratio:>22.0}{frames:>12.0}{:>9.1}%{:>8.2} ms{:>15.3}",
            self.rate.to_string(),
            load * 100.0,
            cycle / 1e6,
            cycle / worst as f64,
        );
    }
}

fn mac(address: u8) -> MacId {
    MacId::new(address).expect("0 … 63")
}

/// A multiturn encoder; each address turns at a speed of its own, half of them backwards.
fn encoder(address: u8, rate: BitRate, turning: bool) -> DeviceNetEncoder<Shaft> {
    let product = Product::find("amg11-d29").expect("in the catalogue");
    let (angle, rpm) = (u32::from(address) * 4_000_000, i32::from(address) * 40 - 1_270);
    let text = match turning {
        true => format!("turn rpm={rpm} angle={angle}"),
        false => format!("still angle={angle}"),
    };
    let geometry = product.encoder.geometry;
    let shaft = Shaft::parse(&text, geometry.singleturn_resolution(), geometry.revolutions());
    DeviceNetEncoder::power_up(
        Instant::ZERO,
        product,
        Factory::with_serial(u32::from(address)),
        Switches::set_to(address, rate),
        &Start::Fresh { interrupted: false },
        shaft.expect("a shaft"),
    )
}
