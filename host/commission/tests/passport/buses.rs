//! Seats on wires in virtual time, with real encoders on one machine.

use std::cell::Cell;
use std::convert::Infallible;
use std::fmt::Write as _;
use std::rc::Rc;

use codewheel_commission::devicenet::{self, OpenSettings};
use codewheel_commission::profibus::{self, SessionSettings};
use codewheel_commission::{Seat, Session};
use codewheel_device::{DeviceNetEncoder, Factory, ProfibusEncoder, Switches};
use codewheel_devicenet::MacId;
use codewheel_encoder::{Sample, Sensor, Start};
use codewheel_link::{LinkError, Notice};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::{Either, can, rs485};
use codewheel_station::can::{BitRate, Filter};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};

use crate::toy::product;

/// How far a machine has turned, in codes. All encoders on it see the same.
pub(crate) type Machine = Rc<Cell<i64>>;

/// A disc on the shaft of a machine, mounted as it happened to come.
#[derive(Clone, Debug)]
pub(crate) struct Disc {
    machine: Machine,
    mounted: i64,
    codes: i64,
}

impl Sensor for Disc {
    fn sample(&mut self, _: Instant) -> Sample {
        let code = (self.machine.get() + self.mounted).rem_euclid(self.codes);
        Sample { code: code as u32, ..Sample::default() }
    }

    fn changes_at(&self, _: Instant) -> Option<Instant> {
        None
    }
}

fn disc(machine: &Machine, model: &str, mounted: i64) -> Disc {
    let codes = product(model).encoder.geometry.range().into();
    Disc { machine: Rc::clone(machine), mounted, codes }
}

/// A bus with a console, and encoders of a machine.
pub(crate) trait Bench {
    fn new() -> Self;

    /// An encoder of a model at an address, whose code is `mounted` further than the machine.
    fn attach(&mut self, address: u8, model: &str, mounted: i64);

    /// Takes the encoder at an address off the bus.
    fn detach(&mut self, address: u8);

    /// Switches it off and on, if it has kept what it should.
    fn power_cycle(&mut self, address: u8);

    fn machine(&self) -> &Machine;

    fn run(&mut self, time: Duration);

    /// What went over the bus, as `candump -L` would have it.
    fn log(&self) -> &str;

    fn with_session<T>(&mut self, address: u8, act: impl FnOnce(&mut dyn Session) -> T) -> T;

    /// Turns the machine, never so far at once that an encoder could lose count.
    fn turn(&mut self, codes: i64) {
        self.machine().set(self.machine().get() + codes);
        self.run(Duration::from_millis(20));
    }

    /// The position that the encoder at an address tells.
    fn position(&mut self, address: u8) -> u32 {
        self.with_session(address, |session| session.sample().expect("a sample").position)
    }
}

type CanNode = Either<devicenet::Console, DeviceNetEncoder<Disc>>;

/// A DeviceNet segment.
pub(crate) struct DeviceNetBench {
    wire: can::Wire<CanNode>,
    console: can::NodeId,
    encoders: Vec<(u8, can::NodeId)>,
    machine: Machine,
    log: String,
}

impl DeviceNetBench {
    fn step(&mut self, until: Instant) {
        // Whoever asks the console something changes it, which is an event of this moment.
        self.carry_until(self.wire.now());
        let next = self.wire.next_event().unwrap_or(until).min(until);
        self.carry_until(next);
        self.keep();
    }

    fn carry_until(&mut self, until: Instant) {
        let log = &mut self.log;
        self.wire.run_until(until, &mut |event| {
            if let can::Event::Frame { at, frame, .. } = event {
                let micros = at.as_nanos() / 1_000;
                let (seconds, micros) = (1_800_000_000 + micros / 1_000_000, micros % 1_000_000);
                writeln!(log, "({seconds}.{micros:06}) can0 {frame}").expect("a string takes all");
            }
        });
    }

    /// Serves the memories.
    fn keep(&mut self) {
        let now = self.wire.now();
        for (_, id) in &self.encoders {
            // Who is lent is served at once, so nobody is lent in vain.
            let is_due = |node: &CanNode| node.right().is_some_and(|it| it.keep_due(now));
            if self.wire.node(*id).is_some_and(is_due)
                && let Some(Either::Right(encoder)) = self.wire.node_mut(*id)
                && encoder.keep(now).is_some()
            {
                encoder.kept(now, Ok::<(), Infallible>(()));
            }
        }
    }
}

impl Bench for DeviceNetBench {
    fn new() -> Self {
        let mut wire = can::Wire::new(BitRate::Kbit500, 1);
        let console = Either::Left(devicenet::Console::new());
        let console = wire.attach("console", console, &[Filter::ALL], true);
        let (encoders, machine, log) = (Vec::new(), Machine::default(), String::new());
        Self { wire, console, encoders, machine, log }
    }

    fn attach(&mut self, address: u8, model: &str, mounted: i64) {
        let encoder = DeviceNetEncoder::power_up(
            self.wire.now(),
            product(model),
            // Two encoders at one address are two units.
            Factory::with_serial(1_000 + self.encoders.len() as u32),
            Switches::set_to(address, BitRate::Kbit500),
            &Start::Fresh { interrupted: false },
            disc(&self.machine, model, mounted),
        );
        let filter = [encoder.filter()];
        let id = self.wire.attach(model, Either::Right(encoder), &filter, false);
        self.encoders.push((address, id));
    }

    fn detach(&mut self, address: u8) {
        let id = self.encoders.iter().rfind(|(other, _)| *other == address).expect("it is there").1;
        self.wire.detach(id);
        // The console's master forgets it as soon as it is asked for anew.
        self.run(Duration::from_secs(1));
    }

    fn power_cycle(&mut self, address: u8) {
        let id = self.encoders.iter().rfind(|(other, _)| *other == address).expect("it is there").1;
        let now = self.wire.now();
        if let Some(Either::Right(encoder)) = self.wire.node_mut(id) {
            encoder.power_cycle(now);
        }
        self.run(Duration::from_secs(3));
    }

    fn machine(&self) -> &Machine {
        &self.machine
    }

    fn run(&mut self, time: Duration) {
        let until = self.wire.now() + time;
        while self.wire.now() < until {
            self.step(until);
        }
    }

    fn log(&self) -> &str {
        &self.log
    }

    fn with_session<T>(&mut self, address: u8, act: impl FnOnce(&mut dyn Session) -> T) -> T {
        let mac = MacId::new(address).expect("0 to 63");
        let opened = devicenet::Encoder::open(&mut *self, mac, OpenSettings::default());
        let mut session = opened.expect("a session");
        let result = act(&mut session);
        session.release().expect("it lets go");
        result
    }
}

impl Seat for DeviceNetBench {
    type Station = devicenet::Console;

    fn now(&self) -> Instant {
        self.wire.now()
    }

    fn station(&mut self) -> &mut devicenet::Console {
        self.wire.node_mut(self.console).and_then(Either::left_mut).expect("the console")
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        self.step(until);
        Ok(Vec::new())
    }
}

type LineNode = Either<profibus::Console, ProfibusEncoder<Disc>>;

/// A PROFIBUS line.
pub(crate) struct ProfibusBench {
    wire: rs485::Wire<LineNode>,
    console: rs485::NodeId,
    encoders: Vec<(u8, rs485::NodeId)>,
    machine: Machine,
    log: String,
}

const RATE: BaudRate = BaudRate::Mbit1_5;

impl ProfibusBench {
    fn step(&mut self, until: Instant) {
        // Whoever asks the console something changes it, which is an event of this moment.
        self.carry_until(self.wire.now());
        let next = self.wire.next_event().unwrap_or(until).min(until);
        self.carry_until(next);
        self.keep();
    }

    fn carry_until(&mut self, until: Instant) {
        let log = &mut self.log;
        self.wire.run_until(until, &mut |event| {
            if let rs485::Event::Telegram { octets, end, .. } = event {
                let micros = end.as_nanos() / 1_000;
                let (seconds, micros) = (1_800_000_000 + micros / 1_000_000, micros % 1_000_000);
                write!(log, "({seconds}.{micros:06}) pb0").expect("a string takes all");
                for octet in octets.octets() {
                    write!(log, " {octet:02X}").expect("a string takes all");
                }
                log.push('\n');
            }
        });
    }

    /// Serves the memories.
    fn keep(&mut self) {
        let now = self.wire.now();
        for (_, id) in &self.encoders {
            // Who is lent is served at once, so nobody is lent in vain.
            let is_due = |node: &LineNode| node.right().is_some_and(|it| it.keep_due(now));
            if self.wire.node(*id).is_some_and(is_due)
                && let Some(Either::Right(encoder)) = self.wire.node_mut(*id)
                && encoder.keep(now).is_some()
            {
                encoder.kept(now, Ok::<(), Infallible>(()));
            }
        }
    }
}

impl Bench for ProfibusBench {
    fn new() -> Self {
        let mut wire = rs485::Wire::new(1);
        let console = Either::Left(profibus::Console::new(RATE));
        let console = wire.attach("console", console, rs485::Attachment::default());
        let (encoders, machine, log) = (Vec::new(), Machine::default(), String::new());
        Self { wire, console, encoders, machine, log }
    }

    fn attach(&mut self, address: u8, model: &str, mounted: i64) {
        let product = product(model);
        let encoder = ProfibusEncoder::power_up(
            self.wire.now(),
            product,
            codewheel_device::profibus::Factory {
                model: product.encoder,
                serial: 1,
                baud: Baud::Fixed(RATE),
                timing: Timing::Exact,
            },
            codewheel_device::profibus::Switches::set_to(address),
            &Start::Fresh { interrupted: false },
            disc(&self.machine, model, mounted),
        );
        let attachment =
            rs485::Attachment { hearing: rs485::Hearing::Telegrams, ..Default::default() };
        let id = self.wire.attach(model, Either::Right(encoder), attachment);
        self.encoders.push((address, id));
    }

    fn detach(&mut self, address: u8) {
        let id = self.encoders.iter().rfind(|(other, _)| *other == address).expect("it is there").1;
        self.wire.detach(id);
        self.run(Duration::from_secs(1));
    }

    fn power_cycle(&mut self, address: u8) {
        let id = self.encoders.iter().rfind(|(other, _)| *other == address).expect("it is there").1;
        let now = self.wire.now();
        if let Some(Either::Right(encoder)) = self.wire.node_mut(id) {
            encoder.power_cycle(now);
        }
        self.run(Duration::from_secs(3));
    }

    fn machine(&self) -> &Machine {
        &self.machine
    }

    fn run(&mut self, time: Duration) {
        let until = self.wire.now() + time;
        while self.wire.now() < until {
            self.step(until);
        }
    }

    fn log(&self) -> &str {
        &self.log
    }

    fn with_session<T>(&mut self, address: u8, act: impl FnOnce(&mut dyn Session) -> T) -> T {
        let settings = SessionSettings::default();
        let opened = profibus::Encoder::open(&mut *self, address, &settings, &mut |_| ());
        let mut session = opened.expect("a session");
        let result = act(&mut session);
        session.release().expect("it lets go");
        result
    }
}

impl Seat for ProfibusBench {
    type Station = profibus::Console;

    fn now(&self) -> Instant {
        self.wire.now()
    }

    fn station(&mut self) -> &mut profibus::Console {
        self.wire.node_mut(self.console).and_then(Either::left_mut).expect("the console")
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        self.step(until);
        Ok(Vec::new())
    }
}
