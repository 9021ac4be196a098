//! The device as the server sees it: an encoder dressed for DeviceNet.

use codewheel_devicenet::explicit::{Error, GeneralStatus, Path, Service};
use codewheel_devicenet::{
    Application, Class, Done, Identity, MacId, NetworkSettings, Request, Reset, Server,
    SwitchPositions,
};
use codewheel_encoder::{Block, Encoder, Sensor, Start};
use codewheel_station::can::BitRate;
use codewheel_station::{Deadline, Duration, Instant, Writer};

use super::Factory;
use super::rows::{ENCODER_POSITION, Row, View};
use crate::event::{Event, Events};
use crate::keeping::{Keeping, MemoryState, Wanted};
use crate::{Product, Switches};

/// How often a moving shaft is looked at between productions.
const SAMPLE_TIME: Duration = Duration::from_millis(1);

/// Identity attribute 5: bit 2, configured; bit 8, minor recoverable fault.
const CONFIGURED: u16 = 1 << 2;
const MINOR_RECOVERABLE_FAULT: u16 = 1 << 8;

/// Assembly 2, octet 4.
const ALARM_FLAG: u8 = 1 << 0;
const WARNING_FLAG: u8 = 1 << 1;

#[derive(Clone, Debug)]
pub(super) struct Body<S> {
    pub(super) product: &'static Product,
    pub(super) factory: Factory,
    pub(super) switches: Switches,
    /// The address in force, as the switches gave it at power-up.
    pub(super) mac: Option<MacId>,
    pub(super) sensor: S,
    pub(super) encoder: Encoder,
    pub(super) keeping: Keeping,
    pub(super) events: Events,
    pub(super) powered_at: Instant,
    /// When the shaft must be looked at; never while it rests.
    pub(super) next_sample: Deadline,
}

impl<S: Sensor> Body<S> {
    pub(super) fn new(
        now: Instant,
        product: &'static Product,
        factory: Factory,
        switches: Switches,
        memory: &Start,
        sensor: S,
    ) -> Self {
        let model = product.encoder;
        let defaults = Block::default_for(model);
        let mut events = Events::new();
        let mut keeping = match memory {
            Start::Fresh { interrupted } => {
                if *interrupted {
                    events.push(now, Event::FirstWriteInterrupted);
                }
                Keeping::new(defaults, None, MemoryState::Fresh)
            }
            Start::Kept { kept, other_damaged, .. } if kept.fingerprint == product.fingerprint => {
                if *other_damaged {
                    events.push(now, Event::RecordDamaged);
                }
                Keeping::new(kept.saved, Some(kept), MemoryState::Good)
            }
            Start::Kept { .. } | Start::Damaged => {
                Keeping::new(defaults, None, MemoryState::Damaged)
            }
        };
        let encoder =
            Encoder::power_up(model, keeping.saved, keeping.reference).unwrap_or_else(|_| {
                keeping = Keeping::new(defaults, None, MemoryState::Damaged);
                Encoder::with_defaults(model)
            });
        if keeping.memory == MemoryState::Damaged {
            events.push(now, Event::MemoryDamaged);
        }
        let mut body = Self {
            product,
            factory,
            switches,
            mac: switches.mac(),
            sensor,
            encoder,
            keeping,
            events,
            powered_at: now,
            next_sample: Deadline::NEVER,
        };
        body.wake(now);
        body
    }

    /// What every power-up does: read the switches, look at the shaft.
    fn wake(&mut self, now: Instant) {
        self.powered_at = now;
        self.mac = self.switches.mac();
        self.events.push(now, Event::PowerUp);
        if self.mac.is_none() {
            self.events.push(now, Event::IllegalAddress { switches: self.switches.address() });
        }
        self.sample(now);
    }

    /// The power is cycled: what is kept is in force again.
    pub(super) fn restart(&mut self, now: Instant) {
        let model = self.product.encoder;
        self.encoder = Encoder::power_up(model, self.keeping.saved, self.keeping.reference)
            .unwrap_or_else(|_| Encoder::with_defaults(model));
        self.wake(now);
    }

    /// A server for the switches as they are at power-up and the network settings as they are kept.
    pub(super) fn server(&self) -> Server {
        let bit_rate = self.switches.bit_rate();
        match self.mac {
            Some(mac) => Server::new(mac, bit_rate, self.keeping.network),
            None => Server::off_the_bus(bit_rate, self.keeping.network),
        }
    }

    /// Looks at the shaft.
    fn sample(&mut self, now: Instant) {
        let (alarm, warning) = (self.encoder.alarm(), self.encoder.warning());
        let sample = self.sensor.sample(now);
        self.encoder.sample(now, sample);
        let changes_at = self.sensor.changes_at(now);
        self.next_sample =
            changes_at.map_or(Deadline::NEVER, |at| Deadline::at(at.max(now + SAMPLE_TIME)));
        if (alarm, warning) != (self.encoder.alarm(), self.encoder.warning()) {
            self.flags_changed(now, alarm, warning);
        }
        if let Some(reference) = &self.keeping.reference
            && !self.keeping.is_writing()
            && self.encoder.reference_is_stale(reference)
        {
            self.keeping.refresh();
        }
    }

    fn flags_changed(&mut self, now: Instant, alarm: bool, warning: bool) {
        match (alarm, self.encoder.alarm()) {
            (false, true) => self.events.push(now, Event::PositionError),
            (true, false) => self.events.push(now, Event::PositionErrorEnded),
            _ => {}
        }
        match (warning, self.encoder.warning()) {
            (false, true) => self.events.push(now, Event::CellLow),
            (true, false) => self.events.push(now, Event::CellRight),
            _ => {}
        }
    }

    /// Runs what fell due; whether a pending Save has failed.
    pub(super) fn advance(&mut self, now: Instant) -> bool {
        if self.next_sample.is_due(now) {
            self.sample(now);
        }
        if self.encoder.deadline().is_some_and(|at| now >= at) {
            let (alarm, warning) = (self.encoder.alarm(), self.encoder.warning());
            self.encoder.advance(now);
            self.flags_changed(now, alarm, warning);
        }
        let overdue = self.keeping.overdue(now);
        if overdue {
            self.events.push(now, Event::KeepFailed);
        }
        overdue
    }

    pub(super) fn deadline(&self) -> Deadline {
        let flags = Deadline::from(self.encoder.deadline());
        flags.min(self.keeping.deadline()).min(self.next_sample)
    }

    fn view(&self) -> View<'_> {
        View { product: self.product, encoder: &self.encoder }
    }

    /// Save, Restore and Reset of class 2Fh.
    fn memory_service(&mut self, now: Instant, service: Service) -> Result<Done, Error> {
        match service {
            Service::SAVE => {
                self.keeping.save(now, Wanted::InForce);
                Ok(Done::Later)
            }
            Service::RESTORE => {
                if self.keeping.memory == MemoryState::Damaged {
                    return Err(GeneralStatus::NO_STORED_DATA.into());
                }
                self.load(self.keeping.saved)?;
                self.events.push(now, Event::Restored);
                Ok(Done::Now)
            }
            Service::RESET => {
                self.load(self.encoder.default_block())?;
                self.events.push(now, Event::Reset);
                Ok(Done::Now)
            }
            _ => Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into()),
        }
    }

    fn load(&mut self, block: Block) -> Result<(), Error> {
        self.encoder.load(block).map_err(|_| GeneralStatus::NO_STORED_DATA.into())
    }
}

impl<S: Sensor> Application for Body<S> {
    fn identity(&self) -> Identity {
        Identity {
            vendor: self.factory.vendor,
            device_type: self.factory.device_type,
            product_code: self.product.product_code(),
            major_revision: 1,
            minor_revision: 1,
            serial: self.factory.serial,
            product_name: self.product.product_name,
        }
    }

    fn status(&self) -> u16 {
        let defaults = Block {
            crossings_at_change: self.keeping.saved.crossings_at_change,
            ..Block::default_for(self.product.encoder)
        };
        let configured = if self.keeping.saved == defaults { 0 } else { CONFIGURED };
        let damaged = self.keeping.memory == MemoryState::Damaged;
        configured | if damaged { MINOR_RECOVERABLE_FAULT } else { 0 }
    }

    fn configuration_consistency(&self) -> u16 {
        self.keeping.consistency
    }

    fn switches(&self) -> SwitchPositions {
        let bit_rate = match self.switches.bit_rate() {
            BitRate::Kbit125 => 0,
            BitRate::Kbit250 => 1,
            BitRate::Kbit500 => 2,
        };
        SwitchPositions { mac: self.switches.address(), bit_rate }
    }

    fn assembly_size(&self, instance: u8) -> Option<usize> {
        match instance {
            1 => Some(4),
            2 => Some(5),
            _ => None,
        }
    }

    fn produce(&mut self, now: Instant, instance: u8, octets: &mut [u8; 8]) -> usize {
        self.sample(now);
        let [first, second, third, fourth, flags, ..] = octets;
        [*first, *second, *third, *fourth] = self.encoder.position().to_le_bytes();
        if instance != 2 {
            return 4;
        }
        *flags = if self.encoder.alarm() { ALARM_FLAG } else { 0 }
            | if self.encoder.warning() { WARNING_FLAG } else { 0 };
        5
    }

    fn class(&self, class: u8) -> Option<Class> {
        (class == ENCODER_POSITION).then_some(Class { revision: 1, max_instance: 1 })
    }

    fn get(&mut self, now: Instant, path: Path, out: &mut Writer<'_>) -> Result<(), Error> {
        let row = row(path)?;
        self.sample(now);
        row.encode(self.view(), out).map_err(|_| GeneralStatus::RESOURCE_UNAVAILABLE.into())
    }

    fn set(&mut self, now: Instant, path: Path, data: &[u8]) -> Result<Done, Error> {
        let row = row(path)?;
        let write = row.write.ok_or(Error::from(GeneralStatus::ATTRIBUTE_NOT_SETTABLE))?;
        let value = row.decode(data)?;
        // A preset takes effect at the position of this very moment.
        self.sample(now);
        let changed = write(&mut self.encoder, value)
            .map_err(|_| Error::from(GeneralStatus::INVALID_ATTRIBUTE_VALUE))?;
        if row.key == "preset" {
            self.events.push(now, Event::Preset { value: self.encoder.preset() });
        } else if changed {
            self.events.push(now, Event::SettingChanged { attribute: row.attribute });
        }
        Ok(Done::Now)
    }

    fn serve(
        &mut self,
        now: Instant,
        request: Request<'_>,
        _out: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        if request.instance > 1 {
            return Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into());
        }
        let known = [Service::SAVE, Service::RESTORE, Service::RESET].contains(&request.service);
        if known && !request.data.is_empty() {
            return Err(GeneralStatus::TOO_MUCH_DATA.into());
        }
        self.sample(now);
        self.memory_service(now, request.service)
    }

    fn reset(&mut self, now: Instant, reset: Reset) -> Result<Done, Error> {
        match reset {
            Reset::PowerCycle => Ok(Done::Now),
            Reset::Defaults => {
                self.keeping.keep_network(NetworkSettings::default());
                self.keeping.save(now, Wanted::Defaults);
                Ok(Done::Later)
            }
        }
    }

    fn keep(&mut self, _now: Instant, settings: NetworkSettings) {
        self.keeping.keep_network(settings);
    }

    fn notice(&mut self, now: Instant, event: codewheel_devicenet::Event) {
        self.events.push(now, Event::Network(event));
    }
}

/// The row that `path` names.
fn row(path: Path) -> Result<&'static Row, Error> {
    match path.instance {
        1 => Row::find(path.attribute).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
        0 => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
        _ => Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into()),
    }
}
