//! An encoder on PROFIBUS-DP: the slave of the bus and the encoder, tied by the rows.

mod body;
pub mod configuration;
pub mod diagnosis;
mod keeping;
mod octets;
pub mod parameters;
mod refusal;
mod switches;

use codewheel_encoder::{Encoder, Kept, Model, Sensor, Start};
use codewheel_profibus::{Baud, Slave, Timing};
use codewheel_station::rs485::{self, BaudRate, Transmission};
use codewheel_station::{Deadline, Instant, Station};

use self::body::Body;
use crate::event::{Event, Happening};
use crate::instrument::Instrument;
use crate::snapshot::{Network, ProfibusState};
use crate::{Product, Snapshot};

pub use octets::Octets;
pub use refusal::{Refusal, Remark};
pub use switches::Switches;

/// The ident number of all products (PROFIBUS manual §3, "GSD file").
pub const IDENT_NUMBER: u16 = 0x059B;

/// The most octets of inputs, and of outputs.
pub const PROCESS_OCTETS: usize = 4;

/// What the factory and the port put into a device besides its product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Factory {
    /// What it measures with: that of the product, or of the encoder at the SSI line of a converter
    /// (a HEAG 162 SP 29 with a word of 25 bits).
    pub model: Model,
    /// The serial number; kept, but not told on this bus.
    pub serial: u32,
    /// How the slave comes to its rate.
    pub baud: Baud,
    /// What the link knows of time.
    pub timing: Timing,
}

/// A PROFIBUS encoder or converter with its sensor: firmware, simulated or played on a real bus.
///
/// Besides what [`Station`] asks, the host serves the memory: after each call it asks
/// [`keep`](Self::keep), writes what it gets, and reports with [`kept`](Self::kept).
#[derive(Clone, Debug)]
pub struct ProfibusEncoder<S> {
    slave: Slave<PROCESS_OCTETS>,
    body: Body<S>,
}

impl<S: Sensor> ProfibusEncoder<S> {
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
        let slave = body.slave();
        Self { slave, body }
    }

    /// Cycles the power: parameters and alarms are gone, the switches are read anew.
    pub fn power_cycle(&mut self, now: Instant) {
        self.body.restart(now);
        self.slave = self.body.slave();
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

    /// The slave inside.
    #[must_use]
    pub const fn slave(&self) -> &Slave<PROCESS_OCTETS> {
        &self.slave
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

    /// The value of a row of the diagnosis as of the newest sample.
    #[must_use]
    pub fn read(&self, row: &diagnosis::Row) -> diagnosis::Value {
        (row.read)(&self.body.view())
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
        self.body.keeping.kept(now, good);
        if !good {
            self.body.tell(now, Happening::KeepFailed);
        }
    }

    /// The oldest event that has not been fetched.
    pub fn take_event(&mut self) -> Option<(Instant, Event)> {
        self.body.instrument.events.take()
    }

    /// What the device shows of itself at `now`.
    #[must_use]
    pub fn snapshot(&self, now: Instant) -> Snapshot {
        let Self { slave, body } = self;
        let Instrument { product, encoder, powered_at, events, .. } = &body.instrument;
        let lamp = body.lamp(slave.state());
        Snapshot {
            product,
            serial: body.factory.serial,
            position: encoder.position(),
            code: encoder.code(),
            velocity: encoder.velocity(body.instrument.looked_at(now)),
            in_force: encoder.block(),
            saved: body.keeping.saved(),
            alarm: body.alarm(),
            warning: encoder.warning(),
            lamp,
            colour: lamp.colour(now.since(*powered_at)),
            network: Network::Profibus(ProfibusState {
                switches: body.switches,
                state: slave.state(),
                master: slave.master(),
                baud_rate: slave.has_baud_rate().then(|| slave.baud_rate()),
                watchdog: slave.watchdog(),
                faults: slave.faults(),
                class_2: body.class_2,
                configuration: body.configuration.identifier,
                sync: slave.is_in_sync_mode(),
                freeze: slave.is_in_freeze_mode(),
                preset_refused: body.preset_refused,
            }),
            memory: body.keeping.upkeep.memory,
            writes: body.keeping.upkeep.writes,
            events_lost: events.lost(),
        }
    }
}

impl<S: Sensor> Station for ProfibusEncoder<S> {
    type Input<'a> = rs485::Input<'a>;
    type Output = Transmission;

    #[inline]
    fn handle(&mut self, now: Instant, input: rs485::Input<'_>) {
        self.slave.handle(now, input, &mut self.body);
    }

    fn advance(&mut self, now: Instant) {
        self.body.advance(now);
        self.slave.advance(now, &mut self.body);
    }

    #[inline]
    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        self.slave.transmit(now, &mut self.body)
    }

    fn deadline(&self) -> Option<Instant> {
        Deadline::from(self.slave.deadline()).min(self.body.deadline()).instant()
    }
}

impl<S: Sensor> rs485::Node for ProfibusEncoder<S> {
    fn baud_rate(&self) -> BaudRate {
        self.slave.baud_rate()
    }
}
