//! A scanner and encoders on a wire that the test holds in its hand.

use codewheel_device::{DeviceNetEncoder, Factory, Product, Switches};
use codewheel_devicenet::scanner::{
    Scanner, ScannerIdentity, SlaveSettings, SlaveState, SlaveView,
};
use codewheel_devicenet::{MacId, NetworkStatus};
use codewheel_encoder::Start;
use codewheel_sim::can::{Either, Event, NodeId, Wire, rules};
use codewheel_sim::shaft::Shaft;
use codewheel_station::can::BitRate;
use codewheel_station::{Duration, Instant};

pub(crate) type Encoder = DeviceNetEncoder<Shaft>;
pub(crate) type Node = Either<Scanner, Encoder>;

/// The expected packet rate of all poll connections.
pub(crate) const EXPECTED_PACKET_RATE: Duration = Duration::from_millis(200);

pub(crate) fn mac(address: u8) -> MacId {
    MacId::new(address).expect("0 to 63")
}

pub(crate) struct Segment {
    pub(crate) wire: Wire<Node>,
    pub(crate) rate: BitRate,
    /// What broke a rule.
    pub(crate) violations: Vec<String>,
}

impl Segment {
    pub(crate) fn new(rate: BitRate, seed: u64) -> Self {
        let mut wire = Wire::new(rate, seed);
        let own = |name: &str| name.split(' ').next()?.strip_prefix("mac")?.parse().ok();
        wire.add_rule(rules::source_mac(own));
        Self { wire, rate, violations: Vec::new() }
    }

    /// A scanner at MAC ID 0 that polls `slaves` and pauses for `pause` between two cycles.
    pub(crate) fn attach_scanner(&mut self, slaves: &[u8], pause: Duration) -> NodeId {
        let identity = ScannerIdentity { vendor: 1, serial: 1 };
        let mut scanner = Scanner::new(mac(0), identity, Duration::ZERO);
        scanner.set_interscan_delay(pause);
        for address in slaves {
            scanner.add(SlaveSettings::poll(mac(*address))).expect("room");
        }
        let filters = scanner.filters();
        self.wire.attach("mac0 scanner", Either::Left(scanner), &filters, true)
    }

    /// An encoder with a shaft that turns at a speed of its own, switched on now.
    pub(crate) fn attach_encoder(&mut self, address: u8, serial: u32) -> NodeId {
        let product = Product::find("amg11-d29").expect("in the catalogue");
        let (angle, rpm) =
            (u64::from(serial) * 7_654_321 % (1 << 29), i32::from(address) * 40 - 1_270);
        let text = format!("turn rpm={rpm} angle={angle}");
        let geometry = product.encoder.geometry;
        let shaft = Shaft::parse(&text, geometry.singleturn_resolution(), geometry.revolutions());
        let encoder = DeviceNetEncoder::power_up(
            self.wire.now(),
            product,
            Factory::with_serial(serial),
            Switches::set_to(address, self.rate),
            &Start::Fresh { interrupted: false },
            shaft.expect("a shaft"),
        );
        let filter = [encoder.filter()];
        let name = format!("mac{address} serial {serial}");
        self.wire.attach(name, Either::Right(encoder), &filter, false)
    }

    pub(crate) fn run(&mut self, span: Duration) {
        self.watch(span, |_| {});
    }

    pub(crate) fn watch(&mut self, span: Duration, mut see: impl FnMut(&Event)) {
        let end = self.wire.now() + span;
        let violations = &mut self.violations;
        self.wire.run_until(end, &mut |event| {
            if let Event::Violation { .. } = event {
                violations.push(event.to_string());
            }
            see(event);
        });
    }

    pub(crate) fn scanner(&self, id: NodeId) -> &Scanner {
        self.wire.node(id).and_then(Either::left).expect("a scanner that was not detached")
    }

    pub(crate) fn encoder(&self, id: NodeId) -> &Encoder {
        self.wire.node(id).and_then(Either::right).expect("an encoder that was not detached")
    }

    pub(crate) fn status(&self, id: NodeId) -> NetworkStatus {
        self.encoder(id).server().status()
    }

    pub(crate) fn slave(&self, scanner: NodeId, address: u8) -> SlaveView<'_> {
        self.scanner(scanner).slave(mac(address)).expect("a slave that was added")
    }

    pub(crate) fn is_running(&self, scanner: NodeId, address: u8) -> bool {
        self.slave(scanner, address).state == SlaveState::Running
    }

    /// Runs until `done`, looking every ten milliseconds; how long that took, or `None` where it did
    /// not come true within `limit`.
    pub(crate) fn run_until(
        &mut self,
        limit: Duration,
        done: impl Fn(&Self) -> bool,
    ) -> Option<Duration> {
        let begin: Instant = self.wire.now();
        while !done(self) {
            if self.wire.now().since(begin) >= limit {
                return None;
            }
            self.run(Duration::from_millis(10));
        }
        Some(self.wire.now().since(begin))
    }
}
