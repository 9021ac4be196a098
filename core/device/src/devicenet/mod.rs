//! An encoder on DeviceNet: the server of the bus and the encoder, tied by the rows.

mod body;
mod keeping;
mod local;
pub mod parameter;
pub mod rows;

use codewheel_devicenet::explicit::GeneralStatus;
use codewheel_devicenet::{MacId, Server, connection};
use codewheel_encoder::{Encoder, Kept, Sensor, Start};
use codewheel_station::can::{self, Filter, Frame};
use codewheel_station::{Deadline, Instant, Station};

use self::body::Body;
use self::keeping::{KEEP_TIME, Outcome};
use crate::event::{DeviceNetEvent, Event, Happening};
use crate::instrument::Instrument;
use crate::lamp::Lamp;
use crate::snapshot::{DeviceNetState, Network};
use crate::{Product, Snapshot, Switches};

pub use local::NotWritten;

/// What the factory puts into a device besides its product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factory {
    /// Identity attribute 1. Default 468, Baumer IVO, the one Baumer encoder entry in ODVA's list
    /// (decision).
    pub vendor: u16,
    /// Identity attribute 2. Default 0, generic: the encoder profile 22h would demand class 23h,
    /// and ours is the manufacturer's 2Fh (decision).
    pub device_type: u16,
    /// Identity attribute 6.
    pub serial: u32,
}

impl Factory {
    /// The defaults with a serial number.
    #[must_use]
    pub const fn with_serial(serial: u32) -> Self {
        Self { vendor: 468, device_type: 0, serial }
    }
}

/// A DeviceNet encoder with its sensor: firmware, simulated or played on a real bus.
///
/// Besides what [`Station`] asks, the host serves the memory: after each call it asks
/// [`keep`](Self::keep), writes what it gets, and reports with [`kept`](Self::kept); then it asks
/// [`transmit`](Station::transmit) again.
#[derive(Clone, Debug)]
pub struct DeviceNetEncoder<S> {
    server: Server,
    body: Body<S>,
}

impl<S: Sensor> DeviceNetEncoder<S> {
    /// Switches the device on at `now`, with what its memory holds.
    ///
    /// A record of another product, or one this product cannot run with, counts as damaged.
    #[must_use]
    pub fn power_up(
        now: Instant,
        product: &'static Product,
        factory: Factory,
        switches: Switches,
        memory: &Start,
        sensor: S,
    ) -> Self {
        let body = Body::new(now, product, factory, switches, memory, sensor);
        let server = body.server();
        Self { server, body }
    }

    /// Cycles the power: connections, unsaved settings and alarms are gone, the switches are read
    /// anew, the duplicate MAC ID check runs again.
    pub fn power_cycle(&mut self, now: Instant) {
        self.body.restart(now);
        self.server = self.body.server();
    }

    /// The product.
    #[must_use]
    pub const fn product(&self) -> &'static Product {
        self.body.product()
    }

    /// The encoder inside.
    #[must_use]
    pub const fn encoder(&self) -> &Encoder {
        self.body.encoder()
    }

    /// The server inside.
    #[must_use]
    pub const fn server(&self) -> &Server {
        &self.server
    }

    /// The sensor.
    #[must_use]
    pub const fn sensor(&self) -> &S {
        &self.body.instrument.sensor
    }

    /// The sensor, to be changed. Whoever changes it makes the device look at it at its next
    /// [`advance`](Station::advance).
    pub const fn sensor_mut(&mut self) -> &mut S {
        self.body.instrument.sensor_mut()
    }

    /// Sets the speed above which two samples are a position error, in turns a minute; 12 000 where
    /// it was never set (decision). A constant of the factory, so it outlasts the power.
    pub fn set_speed_limit(&mut self, rpm: u32) {
        self.body.instrument.set_speed_limit(rpm);
    }

    /// Where the switches stand.
    #[must_use]
    pub const fn switches(&self) -> Switches {
        self.body.switches
    }

    /// Turns the switches; they act at the next power-up.
    pub const fn set_switches(&mut self, switches: Switches) {
        self.body.switches = switches;
    }

    /// The address in force; `None` while the switches hold the device off the bus.
    #[must_use]
    pub const fn mac(&self) -> Option<MacId> {
        self.body.mac
    }

    /// The frames this device wants to see.
    #[must_use]
    pub const fn filter(&self) -> Filter {
        self.server.filter()
    }

    /// The record to write into memory at `now`, if there is one. Until [`kept`](Self::kept) has
    /// reported its end, there is no other.
    pub fn keep(&mut self, now: Instant) -> Option<Kept> {
        let Body { keeping, instrument, factory, .. } = &mut self.body;
        let fingerprint = instrument.product.fingerprint;
        keeping.next(now, fingerprint, factory.serial, &instrument.encoder)
    }

    /// Whether [`keep`](Self::keep) has a record at `now`.
    #[must_use]
    pub fn keep_due(&self, now: Instant) -> bool {
        self.body.keeping.is_due(now)
    }

    /// The write of the record that [`keep`](Self::keep) gave has ended, well or not.
    pub fn kept<E>(&mut self, now: Instant, result: Result<(), E>) {
        let good = result.is_ok();
        let outcome = self.body.keeping.kept(now, good);
        if !good {
            self.body.tell(now, Happening::KeepFailed);
        }
        match outcome {
            Outcome::Automatic => {}
            Outcome::Saved { answer } => {
                self.body.tell(now, DeviceNetEvent::Saved);
                if answer {
                    self.server.complete(Ok(()));
                }
            }
            Outcome::Failed { answer: true } => {
                self.server.complete(Err(GeneralStatus::STORE_FAILED.into()));
            }
            Outcome::Failed { answer: false } => {}
        }
        self.restart_if_due(now);
    }

    /// The oldest event that has not been fetched.
    pub fn take_event(&mut self) -> Option<(Instant, Event)> {
        self.body.instrument.events.take().map(|(at, event)| (at, event.into()))
    }

    /// What the device shows of itself at `now`.
    #[must_use]
    pub fn snapshot(&self, now: Instant) -> Snapshot {
        let Body { instrument, switches, factory, keeping, .. } = &self.body;
        let Instrument { product, encoder, powered_at, events, .. } = instrument;
        let since = now.since(*powered_at);
        let lamp = Lamp::of(self.server.status(), since);
        Snapshot {
            product,
            serial: factory.serial,
            position: encoder.position(),
            code: encoder.code(),
            velocity: encoder.velocity(instrument.looked_at(now)),
            in_force: encoder.block(),
            saved: keeping.saved,
            alarm: encoder.alarm(),
            warning: encoder.warning(),
            lamp,
            colour: lamp.colour(since),
            network: Network::DeviceNet(DeviceNetState {
                switches: *switches,
                master: self.server.master(),
                explicit: self.server.connection_state(connection::EXPLICIT),
                poll: self.server.connection_state(connection::POLL),
                change_of_state: self.server.connection_state(connection::CHANGE_OF_STATE),
            }),
            memory: keeping.upkeep.memory,
            writes: keeping.upkeep.writes,
            events_lost: events.lost(),
        }
    }

    /// Restarts the device where a reset was answered, once the memory has what it is to keep: it
    /// has as long as a Save.
    fn restart_if_due(&mut self, now: Instant) {
        if !self.server.power_cycle_due() {
            return;
        }
        if self.body.keeping.is_idle() || self.body.restart_by.is_due(now) {
            self.power_cycle(now);
        } else if self.body.restart_by.is_never() {
            self.body.restart_by = Deadline::at(now + KEEP_TIME);
        }
    }
}

impl<S: Sensor> Station for DeviceNetEncoder<S> {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: can::Input<'_>) {
        self.server.handle(now, input, &mut self.body);
        self.restart_if_due(now);
    }

    fn advance(&mut self, now: Instant) {
        if self.body.advance(now) {
            self.server.complete(Err(GeneralStatus::STORE_FAILED.into()));
        }
        self.server.advance(now, &mut self.body);
        self.restart_if_due(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        self.server.transmit(now, &mut self.body)
    }

    fn deadline(&self) -> Option<Instant> {
        Deadline::from(self.server.deadline()).min(self.body.deadline()).instant()
    }
}
