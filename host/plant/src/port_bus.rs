//! A bus on a real port: all its devices and masters share the port.

use std::sync::Arc;

use codewheel_commission::profibus::SettingsError;
use codewheel_encoder::ssi;
use codewheel_link::{Clock, LinkError, Waker};
#[cfg(target_os = "linux")]
use codewheel_spidev::CannotOpen;
use codewheel_spidev::SsiUri;
use codewheel_station::{Duration, Instant, earlier};
use thiserror::Error;

use crate::crew::Crew;
use crate::ears::Ears;
use crate::field_bus::{FieldBus, Shared};
use crate::manned::Manned;
use crate::report::{Report, What};
use crate::{
    BusPlan, BusSnapshot, Command, DeviceNet, Done, MemoryError, ObjectGroup, RecordError,
    Recording, Refusal, Ticket,
};

/// Why a plant cannot be started.
#[derive(Debug, Error)]
pub enum StartError {
    /// A memory file.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// A bus.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A DP master cannot be what its plan says.
    #[error(transparent)]
    Master(#[from] SettingsError),
    /// An SSI line cannot be read as its plan says.
    #[error(transparent)]
    Ssi(#[from] ssi::Refusal),
    /// An SPI controller cannot be an SSI line.
    #[cfg(target_os = "linux")]
    #[error(transparent)]
    Spidev(#[from] CannotOpen),
    /// This system has no such SSI lines.
    #[error("{0} cannot be opened here: SPI controllers are files on Linux only")]
    SsiNotHere(SsiUri),
    /// What the buses carry cannot be recorded.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// A bus on a real port, in the time of the clock it was given.
#[derive(Debug)]
pub struct PortBus<B: FieldBus = DeviceNet> {
    stations: B::Stations,
    port: B::Port,
    drive: B::Loop,
    clock: Clock,
    rate: B::Rate,
    crew: Crew<B>,
    uri: String,
}

impl<B: FieldBus> PortBus<B> {
    /// Opens the memory files and the port, and switches everything on.
    ///
    /// # Errors
    /// [`StartError`]; nothing is left half started.
    pub fn power_up(plan: BusPlan<B>, clock: Clock) -> Result<Self, StartError> {
        let manned = Manned::open(plan)?;
        let port = B::open(&manned.plan.uri, manned.plan.bit_rate)?;
        Ok(Self::begin(manned, port, clock))
    }

    pub(crate) fn begin(manned: Manned<B>, port: B::Port, clock: Clock) -> Self {
        let rate = manned.plan.bit_rate;
        let mut stations = B::Stations::new(rate);
        let mut crew = Crew::power_up(manned.in_threads(&B::waker(&port)), &mut stations);
        // What has no power at the beginning says nothing.
        crew.pull_levers(Instant::ZERO, &mut stations);
        let uri = B::describe(&port);
        Self { stations, port, drive: B::drive(clock), clock, rate, crew, uri }
    }

    /// Where the bus is, with the port it really got.
    #[must_use]
    pub fn uri(&self) -> &str {
        &self.uri
    }

    /// Ends a wait of [`turn`](Self::turn).
    #[must_use]
    pub fn waker(&self) -> Waker {
        B::waker(&self.port)
    }

    /// Records what the port carries from now on, as the bus at `place` of the recording, until
    /// [`finish`](Self::finish).
    pub fn record(&mut self, recording: &Recording, place: usize) {
        let recorder = recording.bus(place, self.now());
        self.listen(Some(Arc::new(Ears::new(Some(recorder)))));
    }

    pub(crate) fn listen(&mut self, ears: Option<Arc<Ears>>) {
        B::listen(&mut self.drive, ears, self.rate);
    }

    /// Does something to the device that the plan calls `device`. What became of it,
    /// [`take_answer`](Self::take_answer) says.
    pub fn command(&mut self, device: &str, command: &Command) -> Ticket {
        self.crew.command(self.now(), device, command, &mut self.stations)
    }

    /// What became of a command; `None` as long as it is under way, or when it was asked for already.
    pub fn take_answer(&mut self, ticket: Ticket) -> Option<Result<Done, Refusal>> {
        self.crew.take_answer(self.now(), ticket, &mut self.stations)
    }

    /// What can be read of a device and set, with the values of now.
    ///
    /// # Errors
    /// [`Refusal`] where there is no such device.
    pub fn objects(&self, device: &str) -> Result<Vec<ObjectGroup>, Refusal> {
        self.crew.objects(device, &self.stations)
    }

    /// One turn of the stations and the port: waits once, for input, a wake-up, a deadline, a fault
    /// or `until`.
    ///
    /// # Errors
    /// [`LinkError`] when the port is lost.
    pub fn turn(&mut self, until: Option<Instant>) -> Result<(), LinkError> {
        self.crew.pull_levers(self.now(), &mut self.stations);
        let until = earlier(until, self.crew.next_fault());
        let notices = self.stations.turn(&mut self.drive, &mut self.port, until)?;
        let now = self.now();
        for notice in notices {
            self.crew.report(now, What::Port(notice));
        }
        Ok(())
    }

    /// Averages rates over so long a time at least, however often snapshots are made.
    pub(crate) const fn set_window(&mut self, window: Duration) {
        self.crew.set_window(window);
    }

    /// The bus now. What it reports is taken out.
    pub fn snapshot(&mut self) -> BusSnapshot {
        self.crew.snapshot(self.now(), self.uri.clone(), None, &mut self.stations)
    }

    /// Everything that people may want to hear of since it was asked last, in order.
    pub fn take_reports(&mut self) -> Vec<Report> {
        self.crew.take_reports(&mut self.stations)
    }

    /// Waits until the memories have taken everything, and records no more.
    pub fn finish(&mut self) {
        self.listen(None);
        self.crew.finish_memories(self.now(), &mut self.stations);
    }

    fn now(&self) -> Instant {
        self.clock.now()
    }
}
