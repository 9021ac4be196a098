//! A scanner and real encoders on a simulated CAN wire in virtual time.

use codewheel_device::{DeviceNetEncoder, Factory, Product, Switches};
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{Scanner, ScannerIdentity, SlaveSettings, SlaveState};
use codewheel_encoder::Start;
use codewheel_sim::can::{Either, Event, Faults, NodeId, Wire, rules};
use codewheel_sim::shaft::Shaft;
use codewheel_station::can::BitRate;
use codewheel_station::{Duration, Instant};

type Node = Either<Scanner, DeviceNetEncoder<Shaft>>;

struct Segment {
    wire: Wire<Node>,
    scanner: NodeId,
    encoders: Vec<NodeId>,
    violations: Vec<String>,
}

fn encoder(now: Instant, mac: u8, rate: BitRate) -> DeviceNetEncoder<Shaft> {
    let product = Product::find("amg11-d29").expect("in the catalogue");
    let text = format!("turn rpm={} angle={}", i32::from(mac) * 20 - 500, u32::from(mac) * 4_000);
    let geometry = product.encoder.geometry;
    let shaft = Shaft::parse(&text, geometry.singleturn_resolution(), geometry.revolutions());
    DeviceNetEncoder::power_up(
        now,
        product,
        Factory::with_serial(u32::from(mac)),
        Switches::set_to(mac, rate),
        &Start::Fresh { interrupted: false },
        shaft.expect("a shaft"),
    )
}

impl Segment {
    fn new(rate: BitRate, macs: impl Iterator<Item = u8>, seed: u64) -> Self {
        let mut wire = Wire::new(rate, seed);
        wire.add_rule(rules::source_mac(|name| name.strip_prefix("mac ")?.parse().ok()));
        let identity = ScannerIdentity { vendor: 1, serial: 1 };
        let master = MacId::new(0).expect("a MAC ID");
        let mut scanner = Scanner::new(master, identity, Duration::ZERO);
        scanner.set_interscan_delay(Duration::from_millis(1));
        let mut nodes = Vec::new();
        for mac in macs {
            scanner.add(SlaveSettings::poll(MacId::new(mac).expect("a MAC ID"))).expect("room");
            nodes.push((mac, encoder(Instant::ZERO, mac, rate)));
        }
        let filters = scanner.filters();
        let scanner = wire.attach("mac 0", Either::Left(scanner), &filters, true);
        let mut encoders = Vec::new();
        for (mac, node) in nodes {
            let filter = [node.filter()];
            encoders.push(wire.attach(format!("mac {mac}"), Either::Right(node), &filter, false));
        }
        if let Some(last) = encoders.last() {
            wire.set_terminated(*last, true);
        }
        assert_eq!(wire.warnings(), [""; 0]);
        Self { wire, scanner, encoders, violations: Vec::new() }
    }

    fn run(&mut self, span: Duration) {
        let end = self.wire.now() + span;
        let violations = &mut self.violations;
        self.wire.run_until(end, &mut |event| {
            if let Event::Violation { .. } = event {
                violations.push(event.to_string());
            }
        });
    }

    fn scanner(&self) -> &Scanner {
        match self.wire.node(self.scanner) {
            Some(Either::Left(scanner)) => scanner,
            _ => panic!("the scanner is gone"),
        }
    }

    fn running(&self) -> usize {
        (0..64)
            .filter_map(MacId::new)
            .filter_map(|mac| self.scanner().slave(mac))
            .filter(|slave| slave.state == SlaveState::Running)
            .count()
    }
}

#[test]
fn sixty_three_encoders_come_on_line_and_are_polled_at_every_rate() {
    for rate in BitRate::ALL {
        let mut segment = Segment::new(rate, 1..=63, 1);
        segment.run(Duration::from_secs(6));
        assert_eq!(segment.running(), 63, "at {rate}");
        assert_eq!(segment.violations, [""; 0]);
        // The frames themselves: worst case 55 + 95 bits a slave, less stuffing that is not there.
        let worst = Duration::from_nanos(63 * (55 + 95) * rate.bit_nanos());
        let cycle = segment.scanner().cycle_times().last;
        let ratio = cycle.as_nanos() as f64 / worst.as_nanos() as f64;
        assert!((0.80..=1.00).contains(&ratio), "{ratio:.3} of {worst} at {rate}");
    }
}

#[test]
fn what_the_scanner_reads_is_where_the_shaft_stood() {
    let mut segment = Segment::new(BitRate::Kbit500, 5..=5, 1);
    segment.run(Duration::from_secs(4));
    for _ in 0..100 {
        segment.run(Duration::from_micros(7_321));
        let mac = MacId::new(5).expect("a MAC ID");
        let slave = segment.scanner().slave(mac).expect("added");
        let position = u32::from_le_bytes(slave.input.try_into().expect("four octets"));
        let seen = slave.input_at.expect("polled");
        // The position was read when the frame was built, one frame time before it was heard.
        let shaft = Shaft::parse("turn rpm=-400 angle=20000", 8_192, 65_536).expect("a shaft");
        let latest = shaft.code(seen - Duration::from_micros(100));
        let earliest = shaft.code(seen - Duration::from_micros(500));
        assert!((latest..=earliest).contains(&position), "{latest} {position} {earliest}");
    }
}

#[test]
fn a_snapshot_at_any_moment_shows_the_speed_of_the_shaft() {
    let mut segment = Segment::new(BitRate::Kbit500, 5..=5, 1);
    segment.run(Duration::from_secs(1));
    for _ in 0..20 {
        segment.run(Duration::from_micros(777));
        let now = segment.wire.now();
        let Some(Either::Right(device)) = segment.wire.node(segment.encoders[0]) else {
            panic!("the encoder is gone");
        };
        // −400 rpm; the velocity comes in steps of 10.
        let off = device.snapshot(now).velocity - -400 * 8_192 / 60;
        assert!(off.abs() <= 20, "{off} steps/s off at {now}");
    }
}

#[test]
fn with_frames_lost_everywhere_and_nodes_that_lose_power_all_come_back() {
    let mut segment = Segment::new(BitRate::Kbit500, 1..=20, 7);
    segment.run(Duration::from_secs(5));
    segment.wire.set_faults(Faults { loss: 0.01, ..Faults::default() });
    for round in 0..5_u8 {
        let victim = segment.encoders[usize::from(round) * 3];
        let mac = round * 3 + 1;
        let now = segment.wire.now();
        if let Some(Either::Right(node)) = segment.wire.node_mut(victim) {
            *node = encoder(now, mac, BitRate::Kbit500);
        }
        segment.run(Duration::from_secs(15));
        assert_eq!(segment.running(), 20, "after node {mac} lost its power");
    }
    assert_eq!(segment.violations, [""; 0]);
}

#[test]
fn a_node_alone_on_the_wire_never_gets_on_line_until_another_acknowledges() {
    let mut wire: Wire<Node> = Wire::new(BitRate::Kbit125, 1);
    let node = encoder(Instant::ZERO, 5, BitRate::Kbit125);
    let filter = [node.filter()];
    let id = wire.attach("mac 5", Either::Right(node), &filter, false);
    wire.run_until(Instant::ZERO + Duration::from_secs(60), &mut |_| {});
    let is_on_line = |wire: &Wire<Node>| match wire.node(id) {
        Some(Either::Right(node)) => {
            node.server().status() != codewheel_devicenet::NetworkStatus::NotOnLine
        }
        _ => false,
    };
    assert!(!is_on_line(&wire));
    let now = wire.now();
    let other = encoder(now, 6, BitRate::Kbit125);
    let filter = [other.filter()];
    wire.attach("mac 6", Either::Right(other), &filter, false);
    wire.run_until(now + Duration::from_millis(2_010), &mut |_| {});
    assert!(is_on_line(&wire));
}
