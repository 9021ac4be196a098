//! A bus on a real port: all its devices and masters share the port.

use codewheel_link::{BusUri, CanPort, Clock, LinkError, Loop, Waker};
use codewheel_station::can::BitRate;
use codewheel_station::{Duration, Instant, earlier};
use thiserror::Error;

use crate::composite::Composite;
use crate::crew::{BusSnapshot, Crew, Manned, Medium, Member};
use crate::report::{Report, What};
use crate::{BusPlan, MemoryError};

/// Why a plant cannot be started.
#[derive(Debug, Error)]
pub enum StartError {
    /// A memory file.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// A bus.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// How many bits a controller stays off the bus, at least: 128 times 11.
const BUS_OFF_BITS: u64 = 128 * 11;

/// A bus on a real port, in the time of the clock it was given.
#[derive(Debug)]
pub struct PortBus {
    stations: Stations,
    port: Box<dyn CanPort>,
    drive: Loop,
    crew: Crew,
    uri: String,
}

#[derive(Debug)]
struct Stations {
    composite: Composite<Member>,
    bus_off_time: Duration,
}

impl PortBus {
    /// Opens the memory files and the port, and switches everything on.
    ///
    /// # Errors
    /// [`StartError`]; nothing is left half started.
    pub fn power_up(plan: BusPlan, clock: Clock) -> Result<Self, StartError> {
        let manned = Manned::open(plan)?;
        let port = open(&manned.plan.uri, manned.plan.bit_rate)?;
        Ok(Self::begin(manned, port, clock))
    }

    pub(crate) fn begin(manned: Manned, port: Box<dyn CanPort>, clock: Clock) -> Self {
        let bit_nanos = manned.plan.bit_rate.bit_nanos();
        let bus_off_time = Duration::from_nanos(BUS_OFF_BITS * bit_nanos);
        let mut stations = Stations { composite: Composite::new(), bus_off_time };
        let mut crew = Crew::power_up(manned.in_threads(&port.waker()), &mut stations);
        // What has no power at the beginning says nothing.
        crew.pull_levers(Instant::ZERO, &mut stations);
        let uri = port.describe();
        Self { stations, port, drive: Loop::new(clock), crew, uri }
    }

    /// Where the bus is, with the port it really got.
    #[must_use]
    pub fn uri(&self) -> &str {
        &self.uri
    }

    /// Ends a wait of [`turn`](Self::turn).
    #[must_use]
    pub fn waker(&self) -> Waker {
        self.port.waker()
    }

    /// One turn of the stations and the port: waits once, for input, a wake-up, a deadline, a fault
    /// or `until`.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost.
    pub fn turn(&mut self, until: Option<Instant>) -> Result<(), LinkError> {
        self.crew.pull_levers(self.now(), &mut self.stations);
        let until = earlier(until, self.crew.next_fault());
        let outcome = self.drive.turn(&mut self.stations.composite, &mut *self.port, until)?;
        let now = self.now();
        for notice in outcome.notices {
            self.crew.report(now, What::Port(notice));
        }
        Ok(())
    }

    /// The bus now. What it reports is taken out.
    pub fn snapshot(&mut self) -> BusSnapshot {
        self.crew.snapshot(self.now(), self.uri.clone(), None, &mut self.stations)
    }

    /// Everything that people may want to hear of since it was asked last, in order.
    pub fn take_reports(&mut self) -> Vec<Report> {
        self.crew.take_reports(&mut self.stations)
    }

    /// Waits until the memories have taken everything.
    pub fn finish(&mut self) {
        self.crew.finish_memories(self.now(), &mut self.stations);
    }

    fn now(&self) -> Instant {
        self.drive.clock().now()
    }
}

pub(crate) fn open(uri: &BusUri, rate: BitRate) -> Result<Box<dyn CanPort>, LinkError> {
    codewheel_link::open(uri, rate)
}

impl Medium for Stations {
    fn plug_in(&mut self, place: usize, station: Member) {
        self.composite.put(place, station);
    }

    fn unplug(&mut self, place: usize) -> Option<Member> {
        self.composite.take(place)
    }

    fn station(&self, place: usize) -> Option<&Member> {
        self.composite.station(place)
    }

    fn station_mut(&mut self, place: usize) -> Option<&mut Member> {
        self.composite.station_mut(place)
    }

    fn bus_off(&mut self, place: usize, now: Instant) {
        self.composite.bus_off(place, now, now + self.bus_off_time);
    }

    fn set_corruption(&mut self, _: usize, _: Option<f64>) {
        // A plan has this for virtual buses only.
    }
}
