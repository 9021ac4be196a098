//! A seat on a wire in virtual time, with whatever else the test attaches.

use std::cell::Cell;
use std::fmt;
use std::rc::Rc;

use codewheel_commission::devicenet::{Console, Encoder, OpenSettings};
use codewheel_commission::{Progress, Reading, Seat, Session, Trouble};
use codewheel_device::{DeviceNetEncoder, Factory, Product, Switches};
use codewheel_devicenet::scanner::{ScannerIdentity, SlaveSettings};
use codewheel_devicenet::{MacId, Scanner};
use codewheel_encoder::Start;
use codewheel_link::{LinkError, Notice};
use codewheel_sim::can::{Event, NodeId, Wire};
use codewheel_sim::{Either, shaft::Shaft};
use codewheel_station::can::{BitRate, Filter, Frame, Identifier};
use codewheel_station::{Duration, Instant};

use crate::liar::Liar;
use crate::toy::{Drive, Toy};

pub(crate) type Device = DeviceNetEncoder<Shaft>;
pub(crate) type Node = Either<Console, Either<Device, Either<Scanner, Either<Toy, Liar>>>>;

pub(crate) const fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

pub(crate) const fn secs(secs: u64) -> Duration {
    Duration::from_secs(secs)
}

pub(crate) fn mac(address: u8) -> MacId {
    MacId::new(address).expect("0 to 63")
}

/// What happens by itself at a moment of its own.
type Act = Box<dyn FnOnce(&mut WireSeat)>;

/// A console on a wire. Time passes only in its turns, and each ends with the next thing that
/// happens on the wire.
pub(crate) struct WireSeat {
    pub(crate) wire: Wire<Node>,
    pub(crate) console: NodeId,
    /// What was sent, when and by whom.
    pub(crate) frames: Vec<(Instant, NodeId, Frame)>,
    /// Whether the port says that it is lost for good.
    pub(crate) is_lost: bool,
    /// After how many turns somebody wants an end, which is said once.
    pub(crate) turns_left: Rc<Cell<Option<u32>>>,
    /// Whether the next turn fails because a person wants an end.
    is_interrupted: bool,
    /// So many frames after this address was allocated it does.
    interruption: Option<(u8, usize)>,
    /// Whether the memories of encoders take what they are given, and how long that lasts.
    pub(crate) has_memory: bool,
    pub(crate) memory_time: Duration,
    /// What is to happen, earliest last.
    agenda: Vec<(Instant, Act)>,
}

impl WireSeat {
    pub(crate) fn new() -> Self {
        let mut wire = Wire::new(BitRate::Kbit500, 1);
        let console = wire.attach("console", Either::Left(Console::new()), &[Filter::ALL], true);
        Self {
            wire,
            console,
            frames: Vec::new(),
            is_lost: false,
            turns_left: Rc::default(),
            is_interrupted: false,
            interruption: None,
            has_memory: true,
            memory_time: Duration::ZERO,
            agenda: Vec::new(),
        }
    }

    /// An encoder that was switched on just now.
    pub(crate) fn encoder(&mut self, address: u8, model: &str, shaft: &str) -> NodeId {
        self.encoder_with(address, model, shaft, &Start::Fresh { interrupted: false })
    }

    /// One whose memory cannot be read.
    pub(crate) fn damaged_encoder(&mut self, address: u8) -> NodeId {
        self.encoder_with(address, "amg11-d29", "still", &Start::Damaged)
    }

    fn encoder_with(&mut self, address: u8, model: &str, shaft: &str, memory: &Start) -> NodeId {
        let product = Product::find(model).expect("a model of the catalogue");
        let geometry = product.encoder.geometry;
        let shaft = Shaft::parse(shaft, geometry.singleturn_resolution(), geometry.revolutions());
        let device = DeviceNetEncoder::power_up(
            self.wire.now(),
            product,
            Factory::with_serial(1_000 + u32::from(address)),
            Switches::set_to(address, BitRate::Kbit500),
            memory,
            shaft.expect("a shaft"),
        );
        let filter = [device.filter()];
        self.wire.attach(model, Either::Right(Either::Left(device)), &filter, false)
    }

    /// Somebody else's master at `address`, as `settings` say.
    pub(crate) fn master(&mut self, address: u8, settings: SlaveSettings) -> NodeId {
        let identity = ScannerIdentity { vendor: 1, serial: 7 };
        let mut scanner = Scanner::new(mac(address), identity, millis(20));
        scanner.add(settings).expect("room");
        let node = Either::Right(Either::Right(Either::Left(scanner)));
        self.wire.attach("master", node, &[Filter::ALL], false)
    }

    pub(crate) fn toy(&mut self, toy: Toy) -> NodeId {
        let filter = [toy.server.filter()];
        let node = Either::Right(Either::Right(Either::Right(Either::Left(toy))));
        self.wire.attach("toy", node, &filter, false)
    }

    pub(crate) fn drive(&mut self, id: NodeId) -> &Drive {
        let node = self.wire.node_mut(id).and_then(Either::right_mut);
        let node = node.and_then(Either::right_mut).and_then(Either::right_mut);
        &node.and_then(Either::left_mut).expect("a toy that was not detached").drive
    }

    pub(crate) fn liar(&mut self, liar: Liar) {
        let node = Either::Right(Either::Right(Either::Right(Either::Right(liar))));
        self.wire.attach("liar", node, &[Filter::ALL], false);
    }

    pub(crate) fn device(&mut self, id: NodeId) -> &mut Device {
        let node = self.wire.node_mut(id).and_then(Either::right_mut);
        node.and_then(Either::left_mut).expect("an encoder that was not detached")
    }

    pub(crate) fn scanner(&mut self, id: NodeId) -> &mut Scanner {
        let node = self.wire.node_mut(id).and_then(Either::right_mut);
        let node = node.and_then(Either::right_mut).and_then(Either::left_mut);
        node.expect("a master that was not detached")
    }

    /// Has `act` happen after `span`, whatever goes on then.
    pub(crate) fn after(&mut self, span: Duration, act: impl FnOnce(&mut Self) + 'static) {
        let at = self.wire.now() + span;
        let place = self.agenda.partition_point(|(other, _)| *other > at);
        self.agenda.insert(place, (at, Box::new(act)));
    }

    /// Has a person want an end so many frames after the encoder at `address` was allocated.
    pub(crate) fn interrupt_after_allocation(&mut self, address: u8, frames: usize) {
        self.interruption = Some((address, frames));
    }

    fn interrupt(&mut self) {
        let Some((address, frames)) = self.interruption else { return };
        let answers = format!("{:03X}#", 0x400 | u16::from(address) << 3 | 3);
        let place = self.frames.iter().position(|(_, _, frame)| {
            let frame = frame.to_string();
            // CB: the response to Allocate.
            frame.starts_with(&answers) && frame.get(6..8) == Some("CB")
        });
        if place.is_some_and(|place| self.frames.len() > place + frames) {
            self.is_interrupted = true;
            self.interruption = None;
        }
    }

    /// Lets `span` pass.
    pub(crate) fn run(&mut self, span: Duration) {
        let until = self.wire.now() + span;
        while self.wire.now() < until {
            self.step(until);
        }
    }

    /// Goes to the next thing that happens, or to `until`.
    fn step(&mut self, until: Instant) {
        // Whoever asks the console something changes it, which is an event of this moment.
        self.carry_until(self.wire.now());
        let next = self.wire.next_event().unwrap_or(until).min(until);
        let next = self.agenda.last().map_or(next, |(at, _)| next.min(*at));
        self.carry_until(next);
        while self.agenda.last().is_some_and(|(at, _)| *at <= next) {
            if let Some((_, act)) = self.agenda.pop() {
                act(self);
            }
        }
        self.keep();
    }

    fn carry_until(&mut self, until: Instant) {
        let frames = &mut self.frames;
        self.wire.run_until(until, &mut |event| {
            if let Event::Frame { at, from, frame, .. } = event {
                frames.push((*at, *from, *frame));
            }
        });
    }

    /// Serves the memories of all encoders.
    fn keep(&mut self) {
        let now = self.wire.now();
        let encoder = |node: &Node| {
            node.right().and_then(Either::left).is_some_and(|device| device.keep_due(now))
        };
        let due: Vec<NodeId> =
            self.wire.nodes().filter(|(_, node)| encoder(node)).map(|(id, _)| id).collect();
        for id in due {
            if self.device(id).keep(now).is_some() {
                let result = if self.has_memory { Ok(()) } else { Err(()) };
                self.after(self.memory_time, move |seat| {
                    let now = seat.wire.now();
                    seat.device(id).kept(now, result);
                });
            }
        }
    }

    /// What the console has sent, as candump writes it.
    pub(crate) fn ours(&self) -> Vec<String> {
        let ours = self.frames.iter().filter(|(_, from, _)| *from == self.console);
        ours.map(|(_, _, frame)| frame.to_string()).collect()
    }

    /// Which of our allocations at `address` were taken and not released since, by the frames.
    pub(crate) fn held(&self, address: u16) -> u8 {
        let (mut wanted, mut held) = (0, 0);
        for (_, _, frame) in &self.frames {
            let Identifier::Standard(bits) = frame.identifier() else { continue };
            let own = 0x400 | address << 3;
            match (bits ^ own, frame.data()) {
                (4 | 6, [_, 0x4B | 0x4C, 3, 1, choice, ..]) => wanted = *choice,
                (3, [_, 0xCB, ..]) => held |= wanted,
                (3, [_, 0xCC]) => held &= !wanted,
                _ => {}
            }
        }
        held
    }

    /// Opens the device at `address`.
    pub(crate) fn open(&mut self, address: u8) -> Result<Encoder<&mut Self>, Trouble> {
        Encoder::open(self, mac(address), OpenSettings::default())
    }
}

impl fmt::Debug for WireSeat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.wire.fmt(f)
    }
}

impl Seat for WireSeat {
    type Station = Console;

    fn now(&self) -> Instant {
        self.wire.now()
    }

    fn station(&mut self) -> &mut Console {
        self.wire.node_mut(self.console).and_then(Either::left_mut).expect("the console")
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        if self.is_lost {
            let reason = "the other side closed it".to_owned();
            return Err(LinkError::Lost { bus: "slcan:127.0.0.1:4001".to_owned(), reason });
        }
        if self.turns_left.get() == Some(0) {
            self.turns_left.set(None);
            return Err(LinkError::System(std::io::ErrorKind::Interrupted.into()));
        }
        self.turns_left.set(self.turns_left.get().map(|turns| turns - 1));
        self.interrupt();
        if std::mem::take(&mut self.is_interrupted) {
            return Err(LinkError::System(std::io::ErrorKind::Interrupted.into()));
        }
        self.step(until);
        Ok(Vec::new())
    }
}

/// Hears of no progress.
pub(crate) fn unheard(_: Progress) {}

/// The number that a value of `session` is now.
pub(crate) fn number(session: &mut impl Session, key: &str) -> i64 {
    let name = codewheel_commission::Name::Key(key.to_owned());
    match session.value(&name).expect("a value").reading {
        Reading::Number(number) => number,
        other => panic!("{key} is {other:?}"),
    }
}

/// A name of a row or an attribute.
pub(crate) fn key(key: &str) -> codewheel_commission::Name {
    codewheel_commission::Name::Key(key.to_owned())
}
