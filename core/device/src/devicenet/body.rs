//! The device as the server sees it: an encoder dressed for DeviceNet.

use codewheel_devicenet::explicit::{Error, GeneralStatus, Path, Service};
use codewheel_devicenet::{
    Application, Class, Done, Identity, MacId, NetworkSettings, Request, Reset, Server,
    SwitchPositions,
};
use codewheel_encoder::{Block, Encoder, Refusal, Sensor, Settings, Start};
use codewheel_station::{Deadline, Instant, Writer};

use super::Factory;
use super::keeping::Keeping;
use super::parameter::{self, PARAMETER};
use super::rows::{ENCODER_POSITION, PRESET, Row, View, Write};
use crate::event::{DeviceNetEvent, Events, Happening};
use crate::instrument::Instrument;
use crate::keeping::{self, MemoryState};
use crate::{Product, Switches};

/// Identity attribute 5: bit 2, configured; bit 8, minor recoverable fault.
const CONFIGURED: u16 = 1 << 2;
const MINOR_RECOVERABLE_FAULT: u16 = 1 << 8;

/// Assembly 2, octet 4.
const ALARM_FLAG: u8 = 1 << 0;
const WARNING_FLAG: u8 = 1 << 1;

#[derive(Clone, Debug)]
pub(super) struct Body<S> {
    pub(super) instrument: Instrument<S, DeviceNetEvent>,
    pub(super) factory: Factory,
    pub(super) switches: Switches,
    /// The address in force, as the switches gave it at power-up.
    pub(super) mac: Option<MacId>,
    pub(super) keeping: Keeping,
    /// When a reset that waits for the memory happens all the same.
    pub(super) restart_by: Deadline,
    /// The unwrapped position that the change of state connection produced last.
    produced: i64,
    /// The flags it produced last.
    produced_flags: u8,
    /// A preset or a change of settings is to be produced, however little the position moved.
    produce_anyway: bool,
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
        let (kept, state) = keeping::found(now, memory, product.fingerprint, &mut events);
        let saved = kept.map_or(defaults, |kept| kept.saved);
        let mut keeping = Keeping::new(saved, kept, state);
        let encoder =
            Encoder::power_up(model, saved, keeping.upkeep.reference()).unwrap_or_else(|_| {
                keeping = Keeping::new(defaults, None, MemoryState::Damaged);
                Encoder::with_defaults(model)
            });
        if keeping.upkeep.memory == MemoryState::Damaged {
            events.push(now, Happening::MemoryDamaged);
        }
        let mut body = Self {
            instrument: Instrument::new(now, product, sensor, encoder, events),
            factory,
            switches,
            mac: switches.mac(),
            keeping,
            restart_by: Deadline::NEVER,
            produced: 0,
            produced_flags: 0,
            produce_anyway: true,
        };
        body.wake(now);
        body
    }

    /// What every power-up does: read the switches, look at the shaft.
    fn wake(&mut self, now: Instant) {
        self.restart_by = Deadline::NEVER;
        self.mac = self.switches.mac();
        self.tell(now, Happening::PowerUp);
        if self.mac.is_none() {
            self.tell(now, DeviceNetEvent::IllegalAddress { switches: self.switches.address() });
        }
        self.sample(now);
    }

    /// The power is cycled: what is kept is in force again.
    pub(super) fn restart(&mut self, now: Instant) {
        let model = self.product().encoder;
        let reference = self.keeping.upkeep.reference();
        let encoder = Encoder::power_up(model, self.keeping.saved, reference)
            .unwrap_or_else(|_| Encoder::with_defaults(model));
        self.instrument.restart(now, encoder);
        self.keeping.power_cycled();
        self.produce_anyway = true;
        self.wake(now);
    }

    /// A server for the switches as they are at power-up and the network settings as they are kept.
    pub(super) fn server(&self) -> Server {
        let bit_rate = self.switches.bit_rate();
        match self.mac {
            Some(mac) => Server::new(mac, bit_rate, self.keeping.wanted_network),
            None => Server::off_the_bus(bit_rate, self.keeping.wanted_network),
        }
    }

    pub(super) const fn product(&self) -> &'static Product {
        self.instrument.product
    }

    pub(super) const fn encoder(&self) -> &Encoder {
        &self.instrument.encoder
    }

    pub(super) fn tell(&mut self, now: Instant, event: impl Into<DeviceNetEvent>) {
        self.instrument.events.push(now, event);
    }

    /// Looks at the shaft.
    fn sample(&mut self, now: Instant) {
        self.instrument.sample(now);
        self.keeping.upkeep.watch(&self.instrument.encoder);
    }

    /// Runs what fell due; whether a pending Save has failed.
    pub(super) fn advance(&mut self, now: Instant) -> bool {
        if self.instrument.next_sample.is_due(now) {
            self.sample(now);
        }
        self.instrument.settle(now);
        let overdue = self.keeping.overdue(now);
        if overdue {
            self.tell(now, Happening::KeepFailed);
        }
        overdue
    }

    pub(super) fn deadline(&self) -> Deadline {
        self.instrument.deadline().min(self.keeping.deadline()).min(self.restart_by)
    }

    /// The flags of assembly 2.
    fn flags(&self) -> u8 {
        let alarm = if self.encoder().alarm() { ALARM_FLAG } else { 0 };
        let warning = if self.encoder().warning() { WARNING_FLAG } else { 0 };
        alarm | warning
    }

    fn view(&self) -> View<'_> {
        View { product: self.product(), encoder: self.encoder() }
    }

    /// Writes a value that has the data type of its row.
    pub(super) fn write(
        &mut self,
        now: Instant,
        row: &Row,
        write: Write,
        value: i64,
    ) -> Result<(), Refusal> {
        // A preset takes effect at the position of this very moment.
        self.sample(now);
        let before = self.measure();
        let changed = write(&mut self.instrument.encoder, value)?;
        self.produce_anyway |= before != self.measure();
        if row.attribute == PRESET {
            // Every preset is produced, also one that finds its value in place.
            self.produce_anyway = true;
            self.tell(now, Happening::Preset);
        } else if changed {
            self.tell(now, DeviceNetEvent::SettingChanged { attribute: row.attribute });
        }
        Ok(())
    }

    /// The services of one parameter. Save, Restore and Reset are for all parameters together, at
    /// class level (decision: the conformance test wants 08 at an instance).
    fn parameter_service(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        let row = parameter::row(request.instance)?;
        match request.service {
            Service::GET_ATTRIBUTES_ALL => {
                expect_nothing(request.data)?;
                self.sample(now);
                parameter::all_attributes(row, self.view(), out)?;
            }
            Service::GET_ENUM_STRING => parameter::enum_string(row, request.data, out)?,
            _ => return Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into()),
        }
        Ok(Done::Now)
    }

    /// Save, Restore and Reset of class 2Fh.
    pub(super) fn memory_service(&mut self, now: Instant, service: Service) -> Result<Done, Error> {
        self.sample(now);
        match service {
            Service::SAVE => self.save(now, self.encoder().block(), false),
            Service::RESTORE => {
                if self.keeping.upkeep.memory == MemoryState::Damaged {
                    return Err(GeneralStatus::NO_STORED_DATA.into());
                }
                self.load(self.keeping.saved)?;
                self.tell(now, DeviceNetEvent::Restored);
                Ok(Done::Now)
            }
            Service::RESET => {
                self.load(self.encoder().default_block())?;
                self.tell(now, DeviceNetEvent::Reset);
                Ok(Done::Now)
            }
            _ => Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into()),
        }
    }

    /// New saved settings. The record of an earlier Save whose connection has ended may still be on
    /// its way into memory; then this one has to be asked for again.
    fn save(&mut self, now: Instant, block: Block, resets_network: bool) -> Result<Done, Error> {
        if self.keeping.save(now, block, resets_network) {
            Ok(Done::Later)
        } else {
            Err(GeneralStatus::DEVICE_STATE_CONFLICT.into())
        }
    }

    fn load(&mut self, block: Block) -> Result<(), Error> {
        let before = self.measure();
        self.instrument
            .encoder
            .load(block)
            .map_err(|_| Error::from(GeneralStatus::NO_STORED_DATA))?;
        self.produce_anyway |= before != self.measure();
        Ok(())
    }

    /// What the position is measured by: where it really changes, the position is produced however
    /// little it moved.
    fn measure(&self) -> (Settings, i32) {
        (self.encoder().settings(), self.encoder().offset())
    }
}

impl<S: Sensor> Application for Body<S> {
    fn identity(&self) -> Identity {
        Identity {
            vendor: self.factory.vendor,
            device_type: self.factory.device_type,
            product_code: self.product().product_code(),
            major_revision: 1,
            minor_revision: 1,
            serial: self.factory.serial,
            product_name: self.product().product_name,
        }
    }

    fn status(&self) -> u16 {
        let defaults = Block {
            crossings_at_change: self.keeping.saved.crossings_at_change,
            ..Block::default_for(self.product().encoder)
        };
        let configured = if self.keeping.saved == defaults { 0 } else { CONFIGURED };
        let damaged = self.keeping.upkeep.memory == MemoryState::Damaged;
        configured | if damaged { MINOR_RECOVERABLE_FAULT } else { 0 }
    }

    fn configuration_consistency(&self) -> u16 {
        self.keeping.consistency
    }

    fn switches(&self) -> SwitchPositions {
        SwitchPositions { mac: self.switches.address(), bit_rate: self.switches.bit_rate() }
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
        [*first, *second, *third, *fourth] = self.encoder().position().to_le_bytes();
        if instance != 2 {
            return 4;
        }
        *flags = self.flags();
        5
    }

    fn highest_assembly(&self) -> u8 {
        2
    }

    /// The COS delta is judged on the unwrapped position, so that one above half the range works
    /// too; the flags count where they are produced.
    fn has_changed(&mut self, instance: u8) -> bool {
        let moved = self.encoder().unwrapped().abs_diff(self.produced);
        self.produce_anyway
            || moved >= u64::from(self.encoder().cos_delta())
            || instance == 2 && self.produced_flags != self.flags()
    }

    fn change_produced(&mut self, _instance: u8) {
        self.produced = self.encoder().unwrapped();
        self.produced_flags = self.flags();
        self.produce_anyway = false;
    }

    fn class(&self, class: u8) -> Option<Class> {
        let max_instance = match class {
            ENCODER_POSITION => 1,
            PARAMETER => parameter::LINKS.len() as u16,
            _ => return None,
        };
        Some(Class { revision: 1, max_instance })
    }

    fn get(&mut self, now: Instant, path: Path, out: &mut Writer<'_>) -> Result<(), Error> {
        if path.class == PARAMETER {
            if path.instance == 0 {
                return parameter::class_attribute(path.attribute, out);
            }
            let row = parameter::row(path.instance)?;
            self.sample(now);
            return parameter::attribute(row, path.attribute, self.view(), out);
        }
        let row = row(path)?;
        self.sample(now);
        row.encode(self.view(), out).map_err(|_| GeneralStatus::RESOURCE_UNAVAILABLE.into())
    }

    fn set(&mut self, now: Instant, path: Path, data: &[u8]) -> Result<Done, Error> {
        let row = if path.class == PARAMETER {
            let row = parameter::row(path.instance)?;
            match path.attribute {
                parameter::VALUE => row,
                2..=parameter::LAST_ATTRIBUTE => {
                    return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE.into());
                }
                _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
            }
        } else {
            row(path)?
        };
        let write = row.write.ok_or(Error::from(GeneralStatus::ATTRIBUTE_NOT_SETTABLE))?;
        let value = row.decode(data)?;
        self.write(now, row, write, value)
            .map_err(|_| Error::from(GeneralStatus::INVALID_ATTRIBUTE_VALUE))?;
        Ok(Done::Now)
    }

    fn serve(
        &mut self,
        now: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        if request.class == PARAMETER && request.instance != 0 {
            return self.parameter_service(now, request, out);
        }
        if request.instance > 1 {
            return Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into());
        }
        if request.class == PARAMETER && request.service == Service::GET_ATTRIBUTES_ALL {
            expect_nothing(request.data)?;
            return parameter::all_class_attributes(out).map(|()| Done::Now);
        }
        let known = [Service::SAVE, Service::RESTORE, Service::RESET].contains(&request.service);
        if known {
            expect_nothing(request.data)?;
        }
        self.memory_service(now, request.service)
    }

    fn reset(&mut self, now: Instant, reset: Reset) -> Result<Done, Error> {
        match reset {
            Reset::PowerCycle => Ok(Done::Now),
            Reset::Defaults => self.save(now, self.encoder().default_block(), true),
        }
    }

    fn keep(&mut self, _now: Instant, settings: NetworkSettings) {
        self.keeping.keep_network(settings);
    }

    fn notice(&mut self, now: Instant, event: codewheel_devicenet::Event) {
        self.tell(now, DeviceNetEvent::Network(event));
    }
}

/// Services that take no data refuse some.
fn expect_nothing(data: &[u8]) -> Result<(), Error> {
    if data.is_empty() { Ok(()) } else { Err(GeneralStatus::TOO_MUCH_DATA.into()) }
}

/// The row that `path` names.
fn row(path: Path) -> Result<&'static Row, Error> {
    match path.instance {
        1 => Row::find(path.attribute).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
        0 => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
        _ => Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into()),
    }
}
