//! Anything that can happen to an encoder on DeviceNet, as octets.
//!
//! An input is a head and operations. The head: the product (an octet, modulo the catalogue; bit 7: a
//! record follows, [`any_record`]), the address switches (an octet, modulo 100). Then, until the end:
//!
//! | octet | then | what happens |
//! |---|---|---|
//! | 00–7F | bits 6–3, at most 8, octets | a frame arrives: group 2, the device's MAC ID, message bits 2–0 |
//! | 80 | identifier u16, length, octets | any frame arrives |
//! | 81 | identifier u32, length | an extended frame arrives; with bit 31 a remote one |
//! | 82 | ms u16 | time passes, from deadline to deadline |
//! | 83 | µs u16 | the same |
//! | 84 | 10 ms u16 | time passes, and nobody looks at deadlines |
//! | 85 | | the memory has taken the record on its way |
//! | 86 | | the memory has refused it |
//! | 87 | octets u8 | the power fails, after so many octets of the record on its way, and comes back |
//! | 88, 89 | | bus-off; recovered |
//! | 8A | code u32, flags | the shaft: bit 0 the cell is low, bit 1 it turns |
//! | 8B | | the medium takes nothing from now on, or again something |
//! | 8C | switches u8 | the address switches are turned |
//! | 8D | | the fragment sent last is acknowledged |
//! | 8E, 8F | | the plug is pulled out; it is put in again |
//!
//! Every other octet does nothing. An operation that the input ends in takes zeros.

use codewheel_device::product::DEVICENET;
use codewheel_device::{DeviceNetEncoder, Factory, Switches};
use codewheel_devicenet::connection::State;
use codewheel_devicenet::{MacId, NetworkStatus};
use codewheel_encoder::{Kept, Sample, Sensor, Slot, Start, choose, encode};
use codewheel_sim::memory::TornMemory;
use codewheel_station::can::{BitRate, Frame, Identifier, Input};
use codewheel_station::{Duration, Instant, Reader, Station};

use crate::any_record::any_record;

/// What a device may hand out after one input at most: change of state, poll, an acknowledge, an
/// explicit response, a heartbeat, a duplicate MAC ID check.
const FRAMES_AT_ONCE: usize = 6;
/// Deadlines served in one operation; then time passes late.
const STEPS: usize = 200;

#[derive(Clone, Debug, Default)]
struct Hand {
    code: u32,
    cell_low: bool,
    turns: bool,
}

impl Sensor for Hand {
    fn sample(&mut self, _: Instant) -> Sample {
        Sample { code: self.code, cell_low: self.cell_low, ..Sample::default() }
    }
    fn changes_at(&self, now: Instant) -> Option<Instant> {
        self.turns.then_some(now)
    }
}

struct Bench {
    device: DeviceNetEncoder<Hand>,
    now: Instant,
    memory: TornMemory,
    /// The record on its way into memory.
    writing: Option<Kept>,
    /// The frame that waits for the medium.
    mailbox: Option<Frame>,
    /// The last frame that went out.
    sent: Option<Frame>,
    medium_takes: bool,
    bus_off: bool,
    /// The plug is out.
    detached: bool,
}

/// Does what `octets` say and fails where the device does what it must not.
pub(crate) fn body(octets: &[u8]) {
    let mut reader = Reader::new(octets);
    let mut bench = Bench::power_up(&mut reader);
    bench.serve();
    while let Ok(operation) = reader.u8() {
        bench.operate(operation, &mut reader);
        bench.serve();
        bench.judge();
    }
}

fn start(memory: &TornMemory) -> Start {
    choose(memory.read(Slot::A), memory.read(Slot::B))
}

impl Bench {
    fn power_up(reader: &mut Reader<'_>) -> Self {
        let head = reader.u8().unwrap_or_default();
        let switches = Switches::set_to(reader.u8().unwrap_or_default() % 100, BitRate::Kbit500);
        let product = &DEVICENET[usize::from(head & 0x7F) % DEVICENET.len()];
        let mut memory = TornMemory::new();
        if head & 0x80 != 0 {
            memory.write(
                Slot::B,
                &encode(&any_record(reader, product.fingerprint), u32::MAX),
                None,
            );
        }
        let factory = Factory::with_serial(7);
        let (now, hand) = (Instant::ZERO, Hand::default());
        Self {
            device: DeviceNetEncoder::power_up(
                now,
                product,
                factory,
                switches,
                &start(&memory),
                hand,
            ),
            now,
            memory,
            writing: None,
            mailbox: None,
            sent: None,
            medium_takes: true,
            bus_off: false,
            detached: false,
        }
    }

    fn operate(&mut self, operation: u8, reader: &mut Reader<'_>) {
        let number = |reader: &mut Reader<'_>| u64::from(reader.u16_le().unwrap_or_default());
        match operation {
            0x00..=0x7F => {
                let data = take(reader, operation >> 3);
                let mac = self.device.mac().map_or(63, MacId::value);
                let identifier = 0x400 | u16::from(mac) << 3 | u16::from(operation & 7);
                self.hear(&Frame::standard(identifier, data));
            }
            0x80 => {
                let identifier = reader.u16_le().unwrap_or_default();
                let length = reader.u8().unwrap_or_default();
                self.hear(&Frame::standard(identifier, take(reader, length)));
            }
            0x81 => {
                let identifier = reader.u32_le().unwrap_or_default();
                let length = usize::from(reader.u8().unwrap_or_default() % 9);
                let wide = Identifier::Extended(identifier & 0x1FFF_FFFF);
                let frame = match identifier >> 31 {
                    0 => Frame::new(wide, &[0x42; 8][..length]),
                    _ => Frame::remote(Identifier::Standard(identifier as u16 & 0x7FF), length),
                };
                self.hear(&frame.expect("it fits"));
            }
            0x82 => self.wait(Duration::from_millis(number(reader))),
            0x83 => self.wait(Duration::from_micros(number(reader))),
            0x84 => {
                self.now += Duration::from_millis(10 * number(reader));
                self.device.advance(self.now);
            }
            0x85 => {
                if let Some(kept) = self.writing.take() {
                    let (slot, sequence) = start(&self.memory).next();
                    self.memory.write(slot, &encode(&kept, sequence), None);
                    self.device.kept(self.now, Ok::<(), ()>(()));
                }
            }
            0x86 if self.writing.take().is_some() => self.device.kept(self.now, Err(())),
            0x87 => self.lose_power(usize::from(reader.u8().unwrap_or_default())),
            0x88 if !self.detached => {
                self.bus_off = true;
                self.mailbox = None;
                self.device.handle(self.now, Input::BusOff);
            }
            0x89 if self.bus_off && !self.detached => {
                self.bus_off = false;
                self.device.handle(self.now, Input::Recovered);
            }
            0x8A => {
                let code = reader.u32_le().unwrap_or_default() & 0x1FFF_FFFF;
                let flags = reader.u8().unwrap_or_default();
                let (cell_low, turns) = (flags & 1 != 0, flags & 2 != 0);
                *self.device.sensor_mut() = Hand { code, cell_low, turns };
                self.device.advance(self.now);
            }
            0x8B => {
                self.medium_takes = !self.medium_takes;
                if let Some(frame) = self.mailbox.take_if(|_| self.medium_takes) {
                    self.send(&frame);
                }
            }
            0x8C => {
                let address = reader.u8().unwrap_or_default() % 100;
                self.device.set_switches(Switches::set_to(address, BitRate::Kbit250));
            }
            0x8D => {
                let Some(sent) = self.sent.filter(|sent| sent.length() > 1) else { return };
                let Identifier::Standard(bits) = sent.identifier() else { return };
                let acknowledge = [sent.data()[0], sent.data()[1] | 0xC0, 0];
                self.hear(&Frame::standard(bits & !7 | 4, &acknowledge));
            }
            0x8E => {
                self.detached = true;
                self.mailbox = None;
                self.device.handle(self.now, Input::Detached);
            }
            // The controller is started anew.
            0x8F if self.detached => {
                (self.detached, self.bus_off) = (false, false);
                self.device.handle(self.now, Input::Attached);
            }
            _ => {}
        }
    }

    fn hear(&mut self, frame: &Frame) {
        if !self.bus_off && !self.detached {
            self.device.handle(self.now, Input::Frame(frame));
        }
    }

    fn send(&mut self, frame: &Frame) {
        self.sent = Some(*frame);
        self.device.handle(self.now, Input::Sent(frame));
    }

    fn wait(&mut self, span: Duration) {
        let end = self.now + span;
        for _ in 0..STEPS {
            let Some(deadline) = self.device.deadline().filter(|deadline| *deadline <= end) else {
                break;
            };
            self.now = self.now.max(deadline);
            self.device.advance(self.now);
            self.serve();
        }
        self.now = end;
        self.device.advance(self.now);
    }

    /// The memory holds the record from before or the one on its way, and nothing else.
    fn lose_power(&mut self, octets: usize) {
        let before = start(&self.memory);
        let writing = self.writing.take();
        if let Some(kept) = &writing {
            let (slot, sequence) = before.next();
            self.memory.write(slot, &encode(kept, sequence), Some(octets));
        }
        let after = start(&self.memory);
        match (&before, &after) {
            (Start::Kept { kept: old, .. }, Start::Kept { kept, .. }) => {
                assert!(kept == old || Some(kept) == writing.as_ref(), "neither old nor new");
            }
            (Start::Fresh { .. }, Start::Fresh { .. }) => {}
            (Start::Fresh { .. }, Start::Kept { kept, .. }) => {
                assert_eq!(Some(kept), writing.as_ref(), "kept from nowhere");
            }
            _ => panic!("{before:?} and a write cut after {octets} octets gave {after:?}"),
        }
        self.mailbox = None;
        (self.bus_off, self.detached) = (false, false);
        let (product, switches) = (self.device.product(), self.device.switches());
        let hand = self.device.sensor_mut().clone();
        let factory = Factory::with_serial(7);
        self.device =
            DeviceNetEncoder::power_up(self.now, product, factory, switches, &after, hand);
    }

    /// What a host does after each call.
    fn serve(&mut self) {
        let mut frames = 0;
        loop {
            self.writing = self.writing.or_else(|| self.device.keep(self.now));
            if self.bus_off || self.detached || self.mailbox.is_some() {
                break;
            }
            let status = self.device.server().status();
            let Some(frame) = self.device.transmit(self.now) else { break };
            self.judge_frame(&frame, status);
            if self.medium_takes {
                self.send(&frame);
            } else {
                self.mailbox = Some(frame);
            }
            frames += 1;
            assert!(frames <= FRAMES_AT_ONCE, "{frame} is frame {frames} after one input");
        }
        while let Some((at, event)) = self.device.take_event() {
            assert!(at <= self.now && !event.to_string().is_empty());
        }
        if !self.bus_off && !self.detached && self.mailbox.is_none() {
            let deadline = self.device.deadline();
            assert!(deadline.is_none_or(|at| at > self.now), "{deadline:?} lies in the past");
            self.device.advance(self.now);
            assert_eq!(self.device.transmit(self.now), None, "after advancing twice");
            assert_eq!(self.device.deadline(), deadline, "after advancing twice");
        }
    }

    fn judge_frame(&self, frame: &Frame, status: NetworkStatus) {
        let mac = u16::from(self.device.mac().expect("no address and yet a frame").value());
        let (check, explicit) = (0x407 | mac << 3, 0x403 | mac << 3);
        let (poll, change) = (0x3C0 | mac, 0x340 | mac);
        let Identifier::Standard(bits) = frame.identifier() else { panic!("{frame} is extended") };
        assert!(!frame.is_remote(), "{frame} is remote");
        match status {
            NetworkStatus::Faulted(fault) => panic!("{frame} from a node with {fault:?}"),
            NetworkStatus::NotOnLine => assert_eq!(bits, check, "before on-line"),
            _ if bits == poll || bits == change => {
                let instance = if bits == poll { 2 } else { 4 };
                let state = self.device.server().connection_state(instance);
                assert_eq!(state, Some(State::Established), "{frame}");
                let [a, b, c, d, flags @ ..] = frame.data() else { panic!("{frame} is short") };
                let position = u32::from_le_bytes([*a, *b, *c, *d]);
                assert_eq!(position, self.device.encoder().position(), "{frame}");
                assert!(matches!(flags, [] | [0..=3]), "{frame}");
            }
            _ => assert!(bits == check || bits == explicit, "{frame} is not ours to send"),
        }
    }

    fn judge(&self) {
        let server = self.device.server();
        let [explicit, poll, change] = [1, 2, 4].map(|instance| server.connection_state(instance));
        assert!(matches!(explicit, None | Some(State::Established | State::DeferredDelete)));
        let io = [poll, change];
        assert!(!io.contains(&Some(State::DeferredDelete)));
        let owned = explicit.is_some() || poll.is_some() || change.is_some();
        assert_eq!(
            server.master().is_some(),
            owned,
            "{:?} owns {explicit:?} {io:?}",
            server.master()
        );
        if explicit != Some(State::Established) && owned {
            assert!(io.contains(&Some(State::Established)), "{explicit:?} {io:?}");
        }
        if let NetworkStatus::Faulted(_) | NetworkStatus::NotOnLine = server.status() {
            assert!(!owned, "{:?} owns {explicit:?} {io:?}", server.status());
        }
        let model = self.device.product().encoder;
        let snapshot = self.device.snapshot(self.now);
        assert_eq!(snapshot.in_force.check(model), Ok(()));
        assert_eq!(snapshot.saved.check(model), Ok(()));
        let total = snapshot.in_force.settings.total_in_force(model);
        assert!(snapshot.position < total, "{} of {total}", snapshot.position);
        if let Some(kept) = &self.writing {
            assert_eq!(kept.saved.check(model), Ok(()));
        }
    }
}

/// At most `length` and at most eight octets.
fn take<'a>(reader: &mut Reader<'a>, length: u8) -> &'a [u8] {
    let wanted = usize::from(length.min(8));
    (0..=wanted).rev().find_map(|length| reader.octets(length).ok()).unwrap_or_default()
}
