//! A bus in virtual time: a simulated wire with its devices and masters.

use codewheel_station::{Duration, Instant};

use crate::crew::{Crew, Medium, Member};
use crate::field_bus::{FieldBus, Line, PlannedMaster, Switches};
use crate::manned::{Manned, seed_at};
use crate::report::What;
use crate::{
    BusPlan, BusSnapshot, Command, DeviceNet, Done, ObjectGroup, Refusal, StartError, Ticket,
};

/// A bus in virtual time, which begins at zero. Whoever owns it moves the time on.
///
/// The same plan gives the same course of events, to the bit, as long as its devices have no memory
/// files that change it.
#[derive(Debug)]
pub struct VirtualBus<B: FieldBus = DeviceNet> {
    uri: String,
    segment: Segment<B>,
    crew: Crew<B>,
    /// What had been counted when the load was told last, and when that was.
    seen: <B::Line as Line<B>>::Statistics,
    seen_at: Instant,
    load: f64,
    window: Duration,
}

/// A wire whose stations have places and can lose their power.
#[derive(Debug)]
struct Segment<B: FieldBus> {
    wire: B::Line,
    places: Vec<Place<B>>,
}

#[derive(Debug)]
struct Place<B: FieldBus> {
    name: String,
    terminated: bool,
    /// `None` while it has no power.
    id: Option<<B::Line as Line<B>>::Id>,
    corruption: Option<f64>,
}

impl<B: FieldBus> VirtualBus<B> {
    /// Opens the memory files and switches everything on.
    ///
    /// # Errors
    /// [`StartError`]; nothing is left half started.
    pub fn power_up(plan: BusPlan<B>) -> Result<Self, StartError> {
        Ok(Self::begin(Manned::open(plan)?))
    }

    pub(crate) fn begin(manned: Manned<B>) -> Self {
        let plan = &manned.plan;
        // The seed of the wire itself is that of no place.
        let wire = B::Line::new(plan, seed_at(plan.seed, u32::MAX as usize));
        let devices = plan.devices.iter().map(|device| {
            let name = format!("{} at {}", device.product.title, device.switches.position());
            (name, device.switches.termination())
        });
        let masters = plan.masters.iter().map(|master| {
            let name = format!("{} at {}", B::MasterPlan::KIND, master.address());
            (name, master.termination())
        });
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
        Self { uri, segment, crew, seen, seen_at: Instant::ZERO, load: 0.0, window: Duration::ZERO }
    }

    /// Runs the bus up to `until`. `observer` sees what happens on the wire.
    pub fn run_until(
        &mut self,
        until: Instant,
        observer: &mut impl FnMut(&<B::Line as Line<B>>::Event),
    ) {
        while let Some(at) = self.crew.next_fault().filter(|at| *at <= until) {
            self.segment.wire.run_until(at, observer);
            self.crew.pull_levers(at, &mut self.segment);
        }
        self.segment.wire.run_until(until, observer);
        self.crew.follow_switches(&mut self.segment);
    }

    /// Averages rates and load over so long a time at least, however often snapshots are made.
    pub(crate) const fn set_window(&mut self, window: Duration) {
        self.window = window;
        self.crew.set_window(window);
    }

    /// The bus now. What it reports is taken out.
    pub fn snapshot(&mut self) -> BusSnapshot {
        let statistics = self.segment.wire.statistics();
        let at = self.segment.wire.now();
        if at.since(self.seen_at) >= self.window {
            self.load = B::Line::load(&statistics, &self.seen);
            (self.seen, self.seen_at) = (statistics, at);
        }
        self.crew.snapshot(at, self.uri.clone(), Some(self.load), &mut self.segment)
    }

    /// Does something to the device that the plan calls `device`, now. What became of it,
    /// [`take_answer`](Self::take_answer) says.
    pub fn command(&mut self, device: &str, command: &Command) -> Ticket {
        let now = self.segment.wire.now();
        self.crew.command(now, device, command, &mut self.segment)
    }

    /// What became of a command; `None` as long as it is under way, or when it was asked for already.
    pub fn take_answer(&mut self, ticket: Ticket) -> Option<Result<Done, Refusal>> {
        let now = self.segment.wire.now();
        self.crew.take_answer(now, ticket, &mut self.segment)
    }

    /// What can be read of a device and set, with the values of now.
    ///
    /// # Errors
    /// [`Refusal`] where there is no such device.
    pub fn objects(&self, device: &str) -> Result<Vec<ObjectGroup>, Refusal> {
        self.crew.objects(device, &self.segment)
    }

    /// Its time.
    pub(crate) fn now(&self) -> Instant {
        self.segment.wire.now()
    }

    /// What has been counted on the wire.
    #[must_use]
    pub fn statistics(&self) -> <B::Line as Line<B>>::Statistics {
        self.segment.wire.statistics()
    }

    /// Writes what the memories are still to take, at once.
    pub fn finish(&mut self) {
        let now = self.segment.wire.now();
        self.crew.finish_memories(now, &mut self.segment);
    }
}

impl<B: FieldBus> Segment<B> {
    fn id(&self, place: usize) -> Option<<B::Line as Line<B>>::Id> {
        self.places.get(place)?.id
    }
}

impl<B: FieldBus> Medium<B> for Segment<B> {
    fn plug_in(&mut self, place: usize, station: Member<B>) {
        let Some(Place { name, terminated, id, corruption }) = self.places.get_mut(place) else {
            return;
        };
        let node = self.wire.attach(name.clone(), station, *terminated);
        self.wire.set_corruption_at(node, *corruption);
        *id = Some(node);
    }

    fn unplug(&mut self, place: usize) -> Option<Member<B>> {
        let id = self.places.get_mut(place)?.id.take()?;
        self.wire.detach(id)
    }

    fn station(&self, place: usize) -> Option<&Member<B>> {
        self.wire.node(self.id(place)?)
    }

    fn station_mut(&mut self, place: usize) -> Option<&mut Member<B>> {
        let id = self.id(place)?;
        self.wire.node_mut(id)
    }

    fn label(&mut self, place: usize, label: String, termination: bool) {
        if let Some(place) = self.places.get_mut(place) {
            place.name = label;
            place.terminated = termination;
        }
    }

    fn set_terminated(&mut self, place: usize, terminated: bool) {
        let Some(known) = self.places.get_mut(place) else { return };
        known.terminated = terminated;
        if let Some(id) = known.id {
            self.wire.set_terminated(id, terminated);
        }
    }

    fn warnings(&self) -> Vec<String> {
        self.wire.warnings()
    }

    fn bus_off(&mut self, place: usize, _: Instant) {
        if let Some(id) = self.id(place) {
            self.wire.bus_off(id);
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
