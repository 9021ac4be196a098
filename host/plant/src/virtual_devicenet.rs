//! A DeviceNet segment on a simulated wire, in real time: encoders on their shafts and a scanner
//! that polls them.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time;

use codewheel_device::{DeviceNetEncoder, Event, Factory, Product, Snapshot, Switches};
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{
    CycleTimes, Scanner, ScannerIdentity, SlaveSettings, SlaveState,
};
use codewheel_encoder::Start;
use codewheel_link::Clock;
use codewheel_sim::can::{NodeId, Statistics, Wire};
use codewheel_sim::shaft::{Faulty, Shaft};
use codewheel_station::can::{self, BitRate, Frame};
use codewheel_station::{Duration, Instant, Station};

/// An encoder of a segment.
#[derive(Clone, Debug)]
pub struct EncoderSettings {
    /// The product.
    pub product: &'static Product,
    /// The address.
    pub mac: MacId,
    /// The shaft.
    pub shaft: Shaft,
    /// The serial number.
    pub serial: u32,
}

/// A segment: its wire, its scanner, its encoders.
#[derive(Clone, Debug)]
pub struct SegmentSettings {
    /// Its name.
    pub name: String,
    /// Its bit rate.
    pub bit_rate: BitRate,
    /// The scanner's address.
    pub scanner: MacId,
    /// How often the scanner polls.
    pub interval: Duration,
    /// The encoders, at most 63, each at an address of its own.
    pub encoders: Vec<EncoderSettings>,
}

/// A segment at one moment.
#[derive(Clone, Debug)]
pub struct SegmentSnapshot {
    /// Its name.
    pub name: String,
    /// Its bit rate.
    pub bit_rate: BitRate,
    /// When.
    pub at: Instant,
    /// The share of the time since the snapshot before in which the wire was not idle, 0 … 1.
    pub bus_load: f64,
    /// The scanner's poll cycles.
    pub cycle: CycleTimes,
    /// The encoders, by address.
    pub encoders: Vec<EncoderSnapshot>,
}

/// An encoder at one moment, seen from both sides of the wire.
#[derive(Clone, Debug)]
pub struct EncoderSnapshot {
    /// The device itself.
    pub device: Snapshot,
    /// Its address.
    pub mac: MacId,
    /// Where it stands with the scanner.
    pub state: SlaveState,
    /// The position as the scanner polled it last; `None` before the first poll.
    pub polled: Option<u32>,
    /// Poll responses a second since the snapshot before.
    pub polls_per_second: f64,
    /// What happened to it since the snapshot before.
    pub events: Vec<(Instant, Event)>,
}

type Device = DeviceNetEncoder<Faulty<Shaft>>;

/// Who is on the wire. A scanner is many times larger than an encoder, so both are boxed.
#[derive(Debug)]
enum Node {
    Scanner(Box<Scanner>),
    Encoder(Box<Device>),
}

impl Station for Node {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: can::Input<'_>) {
        match self {
            Self::Scanner(scanner) => scanner.handle(now, input),
            Self::Encoder(device) => device.handle(now, input),
        }
    }

    fn advance(&mut self, now: Instant) {
        match self {
            Self::Scanner(scanner) => scanner.advance(now),
            Self::Encoder(device) => device.advance(now),
        }
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        match self {
            Self::Scanner(scanner) => scanner.transmit(now),
            Self::Encoder(device) => device.transmit(now),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Scanner(scanner) => scanner.deadline(),
            Self::Encoder(device) => device.deadline(),
        }
    }
}

/// A segment in virtual time. [`start`](Self::start) lets it run by the clock on the wall.
#[derive(Debug)]
pub struct VirtualDeviceNet {
    name: String,
    bit_rate: BitRate,
    wire: Wire<Node>,
    scanner: NodeId,
    encoders: Vec<(NodeId, MacId)>,
    seen: Statistics,
    /// Poll responses of each encoder at the snapshot before.
    responses: Vec<u64>,
}

impl VirtualDeviceNet {
    /// Switches the segment on at time zero. The scanner and the last encoder terminate the wire.
    ///
    /// # Errors
    /// A sentence where two stations have the same address, or there are too many.
    pub fn power_up(settings: SegmentSettings) -> Result<Self, String> {
        let SegmentSettings { name, bit_rate, scanner: mac, interval, encoders } = settings;
        let identity = ScannerIdentity { vendor: 0xFFFF, serial: 1 };
        let mut scanner = Box::new(Scanner::new(mac, identity, interval));
        let mut wire = Wire::new(bit_rate, 0);
        let mut places = Vec::new();
        let last = encoders.len().saturating_sub(1);
        for (place, encoder) in encoders.into_iter().enumerate() {
            let EncoderSettings { product, mac, shaft, serial } = encoder;
            scanner
                .add(SlaveSettings::poll(mac))
                .map_err(|_| format!("{name}: address {mac} is taken twice"))?;
            let codes = product.encoder.geometry.range();
            let mut switches = Switches::set_to(mac.value(), bit_rate);
            switches.termination = place == last;
            let device = Device::power_up(
                Instant::ZERO,
                product,
                Factory::with_serial(serial),
                switches,
                &Start::Fresh { interrupted: false },
                Faulty::new(shaft, codes),
            );
            let filter = [device.filter()];
            let title = format!("{} at {mac}", product.title);
            let node = Node::Encoder(Box::new(device));
            places.push((wire.attach(title, node, &filter, place == last), mac));
        }
        places.sort_by_key(|(_, mac)| *mac);
        let filters = scanner.filters();
        let scanner =
            wire.attach(format!("scanner at {mac}"), Node::Scanner(scanner), &filters, true);
        let responses = vec![0; places.len()];
        let seen = wire.statistics();
        Ok(Self { name, bit_rate, wire, scanner, encoders: places, seen, responses })
    }

    /// Runs the segment up to `now`.
    pub fn run_until(&mut self, now: Instant) {
        self.wire.run_until(now, &mut |_| {});
        for place in 0..self.encoders.len() {
            let id = self.encoders[place].0;
            let due = matches!(
                self.wire.node(id), Some(Node::Encoder(device)) if device.keep_due(now)
            );
            if due && let Some(Node::Encoder(device)) = self.wire.node_mut(id) {
                // Volatile memory: what is kept stays in the device.
                while device.keep(now).is_some() {
                    device.kept(now, Ok::<(), ()>(()));
                }
            }
        }
    }

    /// The segment now.
    pub fn snapshot(&mut self) -> SegmentSnapshot {
        let at = self.wire.now();
        let statistics = self.wire.statistics();
        let window = statistics.at.since(self.seen.at).as_nanos() as f64 / 1e9;
        let bus_load = statistics.bus_load_since(&self.seen);
        self.seen = statistics;
        let cycle = match self.wire.node(self.scanner) {
            Some(Node::Scanner(scanner)) => scanner.cycle_times(),
            _ => CycleTimes::default(),
        };
        let mut encoders = Vec::with_capacity(self.encoders.len());
        for (place, (id, mac)) in self.encoders.iter().copied().enumerate() {
            let (state, polled, responses) = match self.wire.node(self.scanner) {
                Some(Node::Scanner(scanner)) => scanner.slave(mac).map_or_else(
                    || (SlaveState::Absent, None, 0),
                    |slave| (slave.state, position(slave.input), slave.responses),
                ),
                _ => (SlaveState::Absent, None, 0),
            };
            let fresh = responses.saturating_sub(self.responses[place]);
            self.responses[place] = responses;
            let polls_per_second = if window > 0.0 { fresh as f64 / window } else { 0.0 };
            let mut events = Vec::new();
            if let Some(Node::Encoder(device)) = self.wire.node_mut(id) {
                events.extend(std::iter::from_fn(|| device.take_event()));
                let device = device.snapshot(at);
                encoders.push(EncoderSnapshot {
                    device,
                    mac,
                    state,
                    polled,
                    polls_per_second,
                    events,
                });
            }
        }
        let (name, bit_rate) = (self.name.clone(), self.bit_rate);
        SegmentSnapshot { name, bit_rate, at, bus_load, cycle, encoders }
    }

    /// Lets the segment run by the clock on the wall, in a thread of its own, with a snapshot
    /// every `period`; only the newest one is kept.
    #[must_use]
    pub fn start(mut self, period: time::Duration) -> Running {
        let shared = Arc::new(Shared::default());
        let thread_shared = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            let clock = Clock::new();
            let mut next = clock.now();
            while !thread_shared.lock().stop {
                let now = clock.now();
                self.run_until(now);
                if now >= next {
                    next = now + period.into();
                    thread_shared.lock().newest = Some(self.snapshot());
                    thread_shared.changed.notify_all();
                }
                std::thread::sleep(PACE);
            }
        });
        Running { shared, thread: Some(thread) }
    }
}

/// How often the wire catches up with the clock on the wall.
const PACE: time::Duration = time::Duration::from_millis(5);

/// The position in a poll response.
fn position(input: &[u8]) -> Option<u32> {
    input.first_chunk().map(|octets| u32::from_le_bytes(*octets))
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    newest: Option<SegmentSnapshot>,
    stop: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // A poisoned lock means that the other thread has panicked; its last state is still whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A segment that runs in a thread of its own; dropping it stops it.
#[derive(Debug)]
pub struct Running {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    /// Waits for a snapshot that has not been fetched yet, at most for `patience`; the newest one
    /// wins.
    #[must_use]
    pub fn snapshot(&self, patience: time::Duration) -> Option<SegmentSnapshot> {
        let state = self.shared.lock();
        let (mut state, _) = self
            .shared
            .changed
            .wait_timeout_while(state, patience, |state| state.newest.is_none() && !state.stop)
            .unwrap_or_else(PoisonError::into_inner);
        state.newest.take()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shared.lock().stop = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo;

    #[test]
    fn the_demo_polls_three_encoders_and_sees_what_their_shafts_do() {
        let mut segment = VirtualDeviceNet::power_up(demo()).unwrap();
        segment.run_until(Instant::ZERO + Duration::from_secs(3));
        let first = segment.snapshot();
        segment.run_until(Instant::ZERO + Duration::from_secs(4));
        let second = segment.snapshot();
        assert_eq!(second.encoders.len(), 3);
        for (before, after) in first.encoders.iter().zip(&second.encoders) {
            assert_eq!(after.state, SlaveState::Running);
            assert!((99.0..=101.0).contains(&after.polls_per_second));
            assert_ne!(before.polled, after.polled, "the shaft turns");
            assert_ne!(after.device.velocity, 0);
            let off = i64::from(after.device.position) - i64::from(after.polled.unwrap());
            assert!(off.unsigned_abs() < 2_000, "{off} steps in the 10 ms since the last poll");
        }
        assert!(second.bus_load > 0.01 && second.bus_load < 0.9);
        assert!(second.cycle.last > Duration::ZERO);
    }

    #[test]
    fn two_stations_at_one_address_are_refused() {
        let mut settings = demo();
        settings.encoders[1].mac = settings.encoders[0].mac;
        let error = VirtualDeviceNet::power_up(settings).unwrap_err();
        assert!(error.contains("taken twice"), "{error}");
    }

    #[test]
    fn in_real_time_snapshots_come_and_the_thread_ends_when_dropped() {
        let running =
            VirtualDeviceNet::power_up(demo()).unwrap().start(time::Duration::from_millis(20));
        let patience = time::Duration::from_secs(10);
        let first = running.snapshot(patience).expect("a snapshot");
        let second = running.snapshot(patience).expect("another one");
        assert!(second.at > first.at);
    }
}
