//! The device as the slave sees it: an encoder dressed for PROFIBUS.

use codewheel_encoder::{Block, Encoder, Refusal as EncoderRefusal, Sensor, Start};
use codewheel_profibus::{Application, Lengths, Refused, Settings, Slave, State};
use codewheel_station::{Deadline, Instant, Writer};

use super::configuration::Row as Configuration;
use super::keeping::Keeping;
use super::parameters::{self, Parameters};
use super::{Factory, IDENT_NUMBER, PROCESS_OCTETS, Refusal, Remark, Switches, diagnosis};
use crate::Product;
use crate::event::{Event, Events, Happening};
use crate::instrument::Instrument;
use crate::keeping::{self, MemoryState};
use crate::lamp::{Lamp, SlaveStatus};

#[derive(Clone, Debug)]
pub(super) struct Body<S> {
    pub(super) instrument: Instrument<S, Event>,
    pub(super) factory: Factory,
    pub(super) switches: Switches,
    pub(super) keeping: Keeping,
    /// Whether class 2 is on.
    pub(super) class_2: bool,
    /// The configuration accepted last.
    pub(super) configuration: &'static Configuration,
    /// A preset was out of range, and none in range has come since.
    pub(super) preset_refused: bool,
    /// Parameters or a configuration were refused, and none have led to the exchange of data since.
    has_error: bool,
    /// The diagnosis is the short one: good parameters have switched class 2 off.
    is_short: bool,
    /// The clock bit of the preset was seen 0, so its next 1 is a rise.
    clock_is_low: bool,
    /// No outputs have come yet in this data exchange.
    begins: bool,
    /// Settings came into force before the shaft was seen; where their turns begin is not settled.
    turns_await_sample: bool,
    /// The alarm and the warning as the diagnosis shows them.
    shown: (bool, bool),
    /// How often they have changed.
    version: u16,
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
        let model = factory.model;
        let mut events = Events::new();
        let (kept, state) = keeping::found(now, memory, product.fingerprint, &mut events);
        let keeping = Keeping::new(model, kept, state)
            .unwrap_or_else(|_| Keeping::empty(model, MemoryState::Damaged));
        if keeping.upkeep.memory == MemoryState::Damaged {
            events.push(now, Happening::MemoryDamaged);
        }
        let reference = keeping.upkeep.reference();
        let encoder = Encoder::power_up(model, keeping.saved(), reference)
            .unwrap_or_else(|_| Encoder::with_defaults(model));
        let mut body = Self {
            instrument: Instrument::new(now, product, sensor, encoder, events),
            factory,
            switches,
            keeping,
            class_2: false,
            configuration: Configuration::default_for(product.encoder),
            preset_refused: false,
            has_error: false,
            is_short: false,
            clock_is_low: false,
            begins: false,
            turns_await_sample: false,
            shown: (false, false),
            version: 0,
        };
        body.wake(now);
        body
    }

    /// What every power-up does: look at the shaft.
    fn wake(&mut self, now: Instant) {
        self.tell(now, Happening::PowerUp);
        self.sample(now);
    }

    /// The power is cycled: what is kept is in force again, everything else is forgotten.
    pub(super) fn restart(&mut self, now: Instant) {
        let model = self.factory.model;
        let (block, reference) = self.keeping.power_cycled();
        let encoder = Encoder::power_up(model, block, reference)
            .unwrap_or_else(|_| Encoder::with_defaults(model));
        self.instrument.restart(now, encoder);
        self.class_2 = false;
        self.configuration = Configuration::default_for(self.product().encoder);
        self.preset_refused = false;
        self.has_error = false;
        self.is_short = false;
        self.clock_is_low = false;
        self.turns_await_sample = false;
        self.show();
        self.wake(now);
    }

    /// A slave for the switches as they are at power-up.
    pub(super) fn slave(&self) -> Slave<PROCESS_OCTETS> {
        Slave::new(Settings {
            address: self.switches.address(),
            ident_number: IDENT_NUMBER,
            baud: self.factory.baud,
            timing: self.factory.timing,
        })
    }

    pub(super) const fn product(&self) -> &'static Product {
        self.instrument.product
    }

    pub(super) const fn encoder(&self) -> &Encoder {
        &self.instrument.encoder
    }

    pub(super) fn tell(&mut self, now: Instant, event: impl Into<Event>) {
        self.instrument.events.push(now, event);
    }

    fn refuse(&mut self, now: Instant, refusal: Refusal) -> Refused {
        self.tell(now, Event::Refused(refusal));
        Refused
    }

    /// Looks at the shaft.
    #[inline]
    fn sample(&mut self, now: Instant) {
        if self.instrument.sample(now) {
            self.show();
        }
        self.keeping.upkeep.watch(&self.instrument.encoder);
        if self.turns_await_sample {
            self.keep_turns();
        }
    }

    /// Runs what fell due.
    pub(super) fn advance(&mut self, now: Instant) {
        if self.instrument.next_sample.is_due(now) {
            self.sample(now);
        }
        self.instrument.settle(now);
        self.show();
        self.keeping.upkeep.advance(now);
    }

    #[inline]
    pub(super) fn deadline(&self) -> Deadline {
        self.instrument.deadline().min(self.keeping.deadline())
    }

    /// A position error, or a preset out of range.
    pub(super) const fn alarm(&self) -> bool {
        self.encoder().alarm() || self.preset_refused
    }

    /// What the diagnosis reads from.
    pub(super) const fn view(&self) -> diagnosis::View<'_> {
        diagnosis::View {
            product: self.product(),
            encoder: self.encoder(),
            class: if self.is_short { 1 } else { 2 },
            alarm: self.alarm(),
        }
    }

    /// What the lamp says while the slave is in `state`.
    pub(super) fn lamp(&self, state: State) -> Lamp {
        Lamp::of_slave(SlaveStatus {
            preset_out_of_range: self.preset_refused,
            position_error: self.encoder().alarm(),
            parameterization_error: self.has_error,
            exchanges_data: state == State::DataExchange,
        })
    }

    /// Notes what the diagnosis shows now. The short one shows no warnings, so there they change
    /// nothing (decision).
    #[inline]
    fn show(&mut self) {
        let shown = (self.alarm(), self.encoder().warning() && !self.is_short);
        if shown != self.shown {
            self.shown = shown;
            self.version = self.version.wrapping_add(1);
        }
    }

    /// Puts parameters in force that have been found good.
    fn take(&mut self, now: Instant, parameters: Parameters) {
        // Settings count their turns from where the shaft stands now.
        self.sample(now);
        let before = self.encoder().block();
        let Parameters { class_2, settings } = parameters;
        let encoder = &mut self.instrument.encoder;
        // Both were judged, so neither is refused; a refusal would change nothing.
        let _ = match self.keeping.block_for(&parameters) {
            Some(block) if block == before => Ok(()),
            Some(block) => encoder.load(block),
            None if settings != before.settings => encoder.apply(settings).map(|_| ()),
            None if before.offset != 0 => {
                encoder.load(Block { settings, ..encoder.default_block() })
            }
            None => Ok(()),
        };
        self.class_2 = class_2;
        self.is_short = !class_2;
        self.preset_refused &= class_2;
        self.turns_await_sample = true;
        if self.encoder().has_sample() {
            self.keep_turns();
        }
        if self.encoder().block() != before {
            self.tell_of_offset(now, before.offset);
        }
        self.show();
    }

    /// Keeps where the turns of the settings in force begin, where there is need.
    #[cold]
    fn keep_turns(&mut self) {
        if self.encoder().has_sample() {
            let block = self.instrument.encoder.block();
            self.keeping.keep_turns(self.factory.model, &block);
            self.turns_await_sample = false;
        }
    }

    /// Tells whether the offset that is kept came into force, or went out of it.
    fn tell_of_offset(&mut self, now: Instant, before: i32) {
        let kept = self.keeping.preset().offset;
        match self.encoder().offset() {
            0 if before != 0 && kept != 0 => {
                self.tell(now, Event::Remark(Remark::OffsetSetAside { offset: kept }));
            }
            0 => {}
            offset => self.tell(now, Event::Remark(Remark::OffsetInForce { offset })),
        }
    }

    /// The inputs show no handshake, so only this tells why a preset does nothing.
    #[cold]
    fn first_outputs(&mut self, now: Instant, clock: bool) {
        self.begins = false;
        if clock && self.class_2 {
            self.tell(now, Event::Remark(Remark::ClockBitSet));
        }
    }

    /// The preset function (PROFIBUS manual §7.4), at the position of this very moment.
    fn preset(&mut self, now: Instant, value: u32) {
        self.sample(now);
        if self.encoder().line_fault().is_some() {
            // An offset made of a position that is only held would be wrong for good.
            self.refuse(now, Refusal::NoPosition);
            return;
        }
        match self.instrument.encoder.set_preset(value) {
            Ok(()) => {
                self.preset_refused = false;
                let block = self.instrument.encoder.block();
                self.keeping.keep_preset(&block);
                self.tell(now, Happening::Preset);
            }
            Err(EncoderRefusal::Preset { max }) => {
                self.preset_refused = true;
                self.refuse(now, Refusal::Preset { given: value, max });
            }
            // The line fault that is the reason is an alarm already.
            Err(_) => {
                self.refuse(now, Refusal::NoPosition);
            }
        }
        self.show();
    }
}

/// The clock bit and the value of a preset in as many octets as the configuration has.
#[inline]
fn clock_and_value(octets: &[u8]) -> Option<(bool, u32)> {
    match *octets {
        [a, b, c, d] => {
            let word = u32::from_be_bytes([a, b, c, d]);
            Some((word >> 31 == 1, word & (u32::MAX >> 1)))
        }
        [a, b] => {
            let word = u16::from_be_bytes([a, b]);
            Some((word >> 15 == 1, u32::from(word & (u16::MAX >> 1))))
        }
        _ => None,
    }
}

impl<S: Sensor> Application for Body<S> {
    fn parameterize(&mut self, now: Instant, user: &[u8]) -> Result<(), Refused> {
        for remark in parameters::ignored(user) {
            self.tell(now, Event::Remark(remark));
        }
        match Parameters::read(self.factory.model, user) {
            Ok(parameters) => {
                self.take(now, parameters);
                Ok(())
            }
            Err(refusal) => {
                self.parameters_refused(now);
                Err(self.refuse(now, refusal))
            }
        }
    }

    fn parameters_refused(&mut self, _now: Instant) {
        self.has_error = true;
        self.is_short = false;
        self.show();
    }

    fn configure(&mut self, now: Instant, identifiers: &[u8]) -> Result<Lengths, Refused> {
        let configuration = Configuration::judge(identifiers).map_err(|refusal| {
            self.has_error = true;
            self.refuse(now, refusal)
        })?;
        self.configuration = configuration;
        let total = self.encoder().settings().total_in_force(self.factory.model);
        if let Some(bits) = configuration.bits_missing(total) {
            self.tell(now, Event::Remark(Remark::OneWord { bits }));
        }
        if configuration.outputs != 0 && !self.class_2 {
            self.tell(now, Event::Remark(Remark::PresetsIgnored));
        }
        Ok(configuration.lengths())
    }

    fn configuration(&self, out: &mut Writer<'_>) {
        // One octet always fits.
        let _ = out.u8(self.configuration.identifier);
    }

    fn data_exchange_begins(&mut self, _now: Instant) {
        self.has_error = false;
        // Decision: a clock bit that is set already, as after a restart of the master, is no rise.
        self.clock_is_low = false;
        self.begins = true;
    }

    #[inline]
    fn inputs(&mut self, now: Instant, octets: &mut [u8]) {
        self.sample(now);
        let position = self.encoder().position();
        match octets {
            [a, b, c, d] => [*a, *b, *c, *d] = position.to_be_bytes(),
            [a, b] => [*a, *b] = (position as u16).to_be_bytes(),
            _ => {}
        }
    }

    #[inline]
    fn outputs(&mut self, now: Instant, octets: &[u8]) {
        let Some((clock, value)) = clock_and_value(octets) else { return };
        let rises = clock && self.clock_is_low;
        self.clock_is_low = !clock;
        if self.begins {
            self.first_outputs(now, clock);
        }
        if rises && self.class_2 {
            self.preset(now, value);
        }
    }

    fn clear(&mut self, _now: Instant) {
        self.clock_is_low = true;
    }

    fn diagnosis(&mut self, now: Instant, out: &mut Writer<'_>) {
        self.sample(now);
        // The stack has room for the longest.
        let _ = diagnosis::write(&self.view(), out);
    }

    #[inline]
    fn has_diagnosis(&self) -> bool {
        self.shown != (false, false)
    }

    #[inline]
    fn diagnosis_version(&self) -> u16 {
        self.version
    }

    fn notice(&mut self, now: Instant, event: codewheel_profibus::Event) {
        self.tell(now, Event::Profibus(event));
    }
}
