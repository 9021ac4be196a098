//! A wire with encoders and another master, and a seat on it.

use codewheel_commission::profibus::{
    Console, Encoder, Master, MasterSettings, ScanSettings, SessionSettings, SlaveSettings, scan,
    shortest_slot,
};
use codewheel_commission::{Found, Progress, Seat, Survey, Trouble};
use codewheel_device::profibus::{Factory, IDENT_NUMBER, Switches};
use codewheel_device::{Product, ProfibusEncoder};
use codewheel_encoder::ssi::LineFault;
use codewheel_encoder::{Reading, Sample, Sensor, Start};
use codewheel_link::{LinkError, Notice};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::Either;
use codewheel_sim::rs485::{Attachment, Event, Faults, Hearing, NodeId, Wire};
use codewheel_sim::shaft::Shaft;
use codewheel_station::rs485::{BaudRate, Node};
use codewheel_station::{Duration, Instant};

use crate::speaker::Speaker;
use crate::stranger::Stranger;

pub(crate) const RATE: BaudRate = BaudRate::Mbit1_5;
/// The master of the plant.
pub(crate) const PLC: u8 = 2;

type Device = ProfibusEncoder<Disc>;

/// A shaft, or an SSI line that brings nothing.
pub(crate) struct Disc(Option<Shaft>);

impl Sensor for Disc {
    fn sample(&mut self, now: Instant) -> Sample {
        match &mut self.0 {
            Some(shaft) => shaft.sample(now),
            None => Sample { reading: Reading::Failed(LineFault::StuckHigh), ..Sample::default() },
        }
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        self.0.as_ref()?.changes_at(now)
    }
}
type Station = Either<Either<Console, Master>, Either<Device, Either<Stranger, Speaker>>>;

/// A console on a wire.
pub(crate) struct Bench {
    wire: Wire<Station>,
    console: NodeId,
    master: Option<NodeId>,
    devices: Vec<(u8, NodeId)>,
    /// What the wire complained of.
    pub(crate) complaints: Vec<String>,
    /// Telegrams of the console.
    pub(crate) said: u64,
    /// What the console sent as outputs to whom, each once in a row.
    pub(crate) outputs: Vec<Vec<u8>>,
    /// Who is unplugged, and when.
    unplugs: Option<(Instant, u8)>,
    /// When a person wants an end.
    interrupts: Option<Wish>,
}

/// Whether a person wants an end by now.
type Wish = Box<dyn Fn(&Bench) -> bool>;

impl std::fmt::Debug for Bench {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bench").field("wire", &self.wire).finish_non_exhaustive()
    }
}

fn name_of(event: &Event) -> Option<String> {
    match event {
        Event::Violation { .. } | Event::Collision { .. } => Some(event.to_string()),
        _ => None,
    }
}

/// The outputs in a Data_Exchange: SD2, addresses without SAP, SRD.
fn outputs_in(telegram: &[u8]) -> Option<Vec<u8>> {
    match telegram {
        [0x68, _, _, 0x68, 0..=0x7F, 0..=0x7F, code, outputs @ .., _, 0x16]
            if code & 0x4F == 0x4D || code & 0x4F == 0x4C =>
        {
            Some(outputs.to_vec())
        }
        _ => None,
    }
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self::at(RATE)
    }

    pub(crate) fn at(rate: BaudRate) -> Self {
        let mut wire = Wire::new(7);
        let console = Either::Left(Either::Left(Console::new(rate)));
        let console = wire.attach("console", console, Attachment::default());
        Self {
            wire,
            console,
            master: None,
            devices: Vec::new(),
            complaints: Vec::new(),
            said: 0,
            outputs: Vec::new(),
            unplugs: None,
            interrupts: None,
        }
    }

    /// With an encoder of a model at an address.
    pub(crate) fn with(mut self, address: u8, model: &str) -> Self {
        self.attach(address, model, self.rate());
        self
    }

    /// With a converter at whose SSI line nothing is.
    pub(crate) fn with_silent_ssi(mut self, address: u8, model: &str) -> Self {
        self.power_up(address, model, self.rate(), Disc(None));
        self
    }

    pub(crate) fn attach(&mut self, address: u8, model: &str, rate: BaudRate) {
        let geometry = Product::find(model).expect("a model").encoder.geometry;
        let shaft = Shaft::parse(
            "still angle=90deg",
            geometry.singleturn_resolution(),
            geometry.revolutions(),
        )
        .expect("a shaft");
        self.power_up(address, model, rate, Disc(Some(shaft)));
    }

    fn power_up(&mut self, address: u8, model: &str, rate: BaudRate, disc: Disc) {
        let product = Product::find(model).expect("a model");
        let factory = Factory {
            model: product.encoder,
            serial: 1,
            baud: Baud::Fixed(rate),
            timing: Timing::Exact,
        };
        let start = Start::Fresh { interrupted: false };
        let now = self.wire.now();
        let switches = Switches::set_to(address);
        let device = Device::power_up(now, product, factory, switches, &start, disc);
        let attachment = Attachment { hearing: Hearing::Telegrams, ..Attachment::default() };
        let station = Either::Right(Either::Left(device));
        let id = self.wire.attach(format!("encoder {address}"), station, attachment);
        self.devices.push((address, id));
    }

    /// A master that exchanges data with these slaves, at the rate of the console.
    pub(crate) fn with_plc(self, slaves: &[u8]) -> Self {
        let rate = self.rate();
        self.with_plc_at(rate, slaves)
    }

    pub(crate) fn with_plc_at(self, rate: BaudRate, slaves: &[u8]) -> Self {
        let watchdog = Some(Duration::from_millis(200));
        self.with_plc_of(MasterSettings { watchdog, ..MasterSettings::new(PLC, rate) }, slaves)
    }

    pub(crate) fn with_plc_of(mut self, settings: MasterSettings, slaves: &[u8]) -> Self {
        let settings =
            MasterSettings { highest_station_address: 10, gap_wait_rotations: 2, ..settings };
        let slave = |address: &u8| SlaveSettings {
            address: *address,
            ident_number: IDENT_NUMBER,
            // PROFIBUS manual §6.1: class 2, scaling, 3600 steps, 921600 in all.
            user_parameters: vec![0, 0x0A, 0, 0, 0x0E, 0x10, 0, 0x0E, 0x10, 0],
            configuration: vec![0xF1],
            inputs: 4,
            outputs: 4,
            ..SlaveSettings::default()
        };
        let master = Master::new(settings, slaves.iter().map(slave).collect()).expect("settings");
        let station = Either::Left(Either::Right(master));
        self.master = Some(self.wire.attach("PLC", station, Attachment::default()));
        self
    }

    /// A slave of somebody else's.
    pub(crate) fn with_stranger(mut self, stranger: Stranger) -> Self {
        let station = Either::Right(Either::Right(Either::Left(stranger)));
        self.wire.attach("stranger", station, Attachment::default());
        self
    }

    /// A master of somebody else's.
    pub(crate) fn with_speaker(mut self, speaker: Speaker) -> Self {
        let station = Either::Right(Either::Right(Either::Right(speaker)));
        self.wire.attach("speaker", station, Attachment::default());
        self
    }

    /// After some time.
    pub(crate) fn after(mut self, time: Duration) -> Self {
        self.run(time);
        self
    }

    pub(crate) fn run(&mut self, time: Duration) {
        let end = self.wire.now() + time;
        while self.wire.now() < end {
            self.step(end);
        }
    }

    fn step(&mut self, until: Instant) {
        let now = self.wire.now();
        if let Some((_, address)) = self.unplugs.take_if(|(at, _)| *at <= now) {
            self.unplug(address);
        }
        // Whoever was looked at is asked first, in no time.
        self.run_until(now);
        let next = self.wire.next_event().map_or(until, |next| next.min(until));
        self.run_until(next);
    }

    fn run_until(&mut self, next: Instant) {
        let (console, complaints, said) = (self.console, &mut self.complaints, &mut self.said);
        let outputs = &mut self.outputs;
        self.wire.run_until(next, &mut |event| {
            complaints.extend(name_of(event));
            if let Event::Telegram { from, octets, .. } = event
                && *from == console
            {
                *said += 1;
                outputs.extend(outputs_in(octets.octets()));
                outputs.dedup();
            }
        });
    }

    fn rate(&self) -> BaudRate {
        let console = self.wire.node(self.console).and_then(Either::left).and_then(Either::left);
        console.expect("a console").baud_rate()
    }

    pub(crate) fn plc(&self) -> &Master {
        let id = self.master.expect("a PLC");
        self.wire.node(id).and_then(Either::left).and_then(Either::right).expect("a PLC")
    }

    /// Takes the PLC off the bus.
    pub(crate) fn unplug_plc(&mut self) {
        if let Some(id) = self.master.take() {
            self.wire.detach(id);
        }
    }

    pub(crate) fn device(&self, address: u8) -> &Device {
        let (_, id) = self.devices.iter().find(|(of, _)| *of == address).expect("an encoder");
        self.wire.node(*id).and_then(Either::right).and_then(Either::left).expect("an encoder")
    }

    /// Destroys telegrams with this probability.
    pub(crate) fn disturb(&mut self, corruption: f64) {
        self.wire.set_faults(Faults { corruption, ..Faults::default() });
    }

    /// Unplugs an encoder, or the PLC, in a while.
    pub(crate) fn unplug_after(&mut self, time: Duration, address: u8) {
        self.unplugs = Some((self.wire.now() + time, address));
    }

    fn unplug(&mut self, address: u8) {
        if address == PLC {
            return self.unplug_plc();
        }
        let place = self.devices.iter().position(|(of, _)| *of == address).expect("an encoder");
        let (_, id) = self.devices.remove(place);
        self.wire.detach(id);
    }

    /// Lets one turn fail as soon as something is so.
    pub(crate) fn interrupt_when(&mut self, is_so: impl Fn(&Self) -> bool + 'static) {
        self.interrupts = Some(Box::new(is_so));
    }

    pub(crate) fn scan(&mut self, settings: ScanSettings) -> Result<Survey, Trouble> {
        scan(self, settings, &mut |_| {})
    }

    pub(crate) fn open(
        &mut self,
        address: u8,
        settings: &SessionSettings,
    ) -> Result<Encoder<&mut Self>, Trouble> {
        Encoder::open(self, address, settings, &mut |_: Progress| {})
    }
}

impl Seat for Bench {
    type Station = Console;

    fn now(&self) -> Instant {
        self.wire.now()
    }

    fn station(&mut self) -> &mut Console {
        let console = self.wire.node_mut(self.console).and_then(Either::left_mut);
        console.and_then(Either::left_mut).expect("a console")
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        if self.interrupts.as_ref().is_some_and(|is_so| is_so(self)) {
            self.interrupts = None;
            return Err(LinkError::System(std::io::ErrorKind::Interrupted.into()));
        }
        self.step(until);
        Ok(Vec::new())
    }
}

/// A master with the slot time of the wire.
pub(crate) fn quick(rate: BaudRate) -> ScanSettings {
    ScanSettings { address: 4, join: false, slot_bits: Some(shortest_slot(rate)) }
}

pub(crate) fn joining(rate: BaudRate) -> ScanSettings {
    ScanSettings { join: true, ..quick(rate) }
}

pub(crate) fn alone() -> SessionSettings {
    SessionSettings { master: quick(RATE), ..SessionSettings::default() }
}

pub(crate) fn with_others() -> SessionSettings {
    SessionSettings { master: joining(RATE), ..SessionSettings::default() }
}

pub(crate) fn node(survey: &Survey, address: u8) -> &Found {
    let node = survey.nodes.iter().find(|node| node.address == address);
    node.unwrap_or_else(|| panic!("{address} is not in {survey:#?}"))
}
