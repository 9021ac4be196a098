//! A bus in virtual time: a simulated wire with its devices and masters.

use codewheel_sim::can::{Event, NodeId, Statistics, Wire};
use codewheel_station::Instant;

use crate::crew::{BusSnapshot, Crew, Manned, Medium, Member, seed_at};
use crate::report::What;
use crate::{BusPlan, MemoryError};

/// A bus in virtual time, which begins at zero. Whoever owns it moves the time on.
///
/// The same plan gives the same course of events, to the bit, as long as its devices have no memory
/// files that change it.
#[derive(Debug)]
pub struct VirtualBus {
    uri: String,
    segment: Segment,
    crew: Crew,
    seen: Statistics,
}

/// A wire whose stations have places and can lose their power.
#[derive(Debug)]
struct Segment {
    wire: Wire<Member>,
    places: Vec<Place>,
}

#[derive(Debug)]
struct Place {
    name: String,
    terminated: bool,
    /// `None` while it has no power.
    id: Option<NodeId>,
    corruption: Option<f64>,
}

impl VirtualBus {
    /// Opens the memory files and switches everything on.
    ///
    /// # Errors
    /// [`MemoryError`]; nothing is left half started.
    pub fn power_up(plan: BusPlan) -> Result<Self, MemoryError> {
        Ok(Self::begin(Manned::open(plan)?))
    }

    pub(crate) fn begin(manned: Manned) -> Self {
        let plan = &manned.plan;
        // The seed of the wire itself is that of no place.
        let mut wire = Wire::new(plan.bit_rate, seed_at(plan.seed, u32::MAX as usize));
        wire.set_faults(plan.faults);
        let devices = plan.devices.iter().map(|device| {
            let name = format!("{} at {}", device.product.title, device.switches.address());
            (name, device.switches.termination)
        });
        let masters = plan.masters.iter();
        let masters =
            masters.map(|master| (format!("scanner at {}", master.mac), master.termination));
        let places = devices
            .chain(masters)
            .map(|(name, terminated)| Place { name, terminated, id: None, corruption: None })
            .collect();
        let mut segment = Segment { wire, places };
        let uri = plan.uri.to_string();
        let mut crew = Crew::power_up(manned, &mut segment);
        // What has no power at the beginning says nothing.
        crew.pull_levers(Instant::ZERO, &mut segment);
        for warning in segment.wire.warnings() {
            crew.report(Instant::ZERO, What::Wiring(warning));
        }
        let seen = segment.wire.statistics();
        Self { uri, segment, crew, seen }
    }

    /// Runs the bus up to `until`. `observer` sees what happens on the wire.
    pub fn run_until(&mut self, until: Instant, observer: &mut impl FnMut(&Event)) {
        while let Some(at) = self.crew.next_fault().filter(|at| *at <= until) {
            self.segment.wire.run_until(at, observer);
            self.crew.pull_levers(at, &mut self.segment);
        }
        self.segment.wire.run_until(until, observer);
    }

    /// The bus now. What it reports is taken out.
    pub fn snapshot(&mut self) -> BusSnapshot {
        let statistics = self.segment.wire.statistics();
        let load = statistics.bus_load_since(&self.seen);
        self.seen = statistics;
        self.crew.snapshot(statistics.at, self.uri.clone(), Some(load), &mut self.segment)
    }

    /// What has been counted on the wire.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.segment.wire.statistics()
    }

    /// Writes what the memories are still to take, at once.
    pub fn finish(&mut self) {
        let now = self.segment.wire.now();
        self.crew.finish_memories(now, &mut self.segment);
    }
}

impl Segment {
    fn id(&self, place: usize) -> Option<NodeId> {
        self.places.get(place)?.id
    }
}

impl Medium for Segment {
    fn plug_in(&mut self, place: usize, station: Member) {
        let Some(Place { name, terminated, id, corruption }) = self.places.get_mut(place) else {
            return;
        };
        let filters = station.filters();
        let node = self.wire.attach(name.clone(), station, &filters, *terminated);
        self.wire.set_corruption_at(node, *corruption);
        *id = Some(node);
    }

    fn unplug(&mut self, place: usize) -> Option<Member> {
        let id = self.places.get_mut(place)?.id.take()?;
        self.wire.detach(id)
    }

    fn station(&self, place: usize) -> Option<&Member> {
        self.wire.node(self.id(place)?)
    }

    fn station_mut(&mut self, place: usize) -> Option<&mut Member> {
        let id = self.id(place)?;
        self.wire.node_mut(id)
    }

    fn bus_off(&mut self, place: usize, _: Instant) {
        if let Some(id) = self.id(place) {
            self.wire.bus_off(id, &mut |_| {});
        }
    }

    fn set_corruption(&mut self, place: usize, probability: Option<f64>) {
        let Some(known) = self.places.get_mut(place) else { return };
        known.corruption = probability;
        if let Some(id) = known.id {
            self.wire.set_corruption_at(id, probability);
        }
    }
}
