//! Anything that can happen to a scanner, as octets.
//!
//! The scanner has MAC ID 1; its slaves are at the MAC IDs 5, 6, 7 and 63, places 0 to 3. An input is
//! a head and operations. The head: bits 0–3 of an octet say which slaves are added, bit 4 that they
//! must be of vendor 468 and product code 10, bit 5 that they are to produce assembly 2, bits 6–7 what
//! is done with them ([`settings`]); a second octet is the poll interval in ms. Then, until the end:
//!
//! | octet | then | what happens |
//! |---|---|---|
//! | 80–83 | length, octets | the slave at this place does what it was asked, and says so |
//! | 84–87 | length, octets | a poll response of the slave |
//! | 88 | ms u16 | time passes, from deadline to deadline |
//! | 89 | µs u16 | the same |
//! | 8A | 10 ms u16 | time passes, and nobody looks at deadlines |
//! | 8B | | the medium takes nothing from now on, or again something |
//! | 8C | place, general, additional | the slave refuses |
//! | 8D | identifier u16, length, octets | any frame arrives |
//! | 8E | place, length, octets | somebody asks for an explicit request |
//! | 8F | place | the slave acknowledges the fragment sent last |
//! | 90 | place, fragment, length, octets | a fragment of the slave's answer |
//! | 91, 92 | | bus-off; recovered |
//! | 93 | | all answers are fetched |
//! | 94–97 | length, octets | the slave at this place produces of its own accord |
//! | 98 | place | the slave is removed |
//! | 99 | place, head octet | it is added again |
//! | 9A | place, length, octets | its output data |
//! | 9B | | the oldest request is given up |
//! | 9C | 0, or 1 for forced | a scan begins |
//! | 9D | | the scanner begins anew |
//! | 9E | place | the slave is heard checking its MAC ID |
//!
//! Every other octet does nothing. An operation that the input ends in takes zeros.

use codewheel_devicenet::scanner::{
    ChangeSettings, DeviceIdentity, PollSettings, Probing, ScanProgress, Scanner, ScannerIdentity,
    SlaveSettings, SlaveState, SlaveView, Ticket, Trigger,
};
use codewheel_devicenet::{Fault, MacId};
use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Duration, Instant, Reader, Station};

const MACS: [u8; 4] = [5, 6, 7, 63];
/// For each slave a poll of ten fragments, an acknowledge of its production, one of a fragment and a
/// request; a probe and an address check.
const FRAMES_AT_ONCE: usize = 13 * MACS.len() + 2;
/// Deadlines served in one operation; then time passes late.
const STEPS: usize = 400;

struct Bench {
    scanner: Scanner<4>,
    now: Instant,
    /// Header and service of what each slave was asked last, and the frame.
    asked: [(u8, u8, Option<Frame>); 4],
    mailbox: Option<Frame>,
    medium_takes: bool,
    bus_off: bool,
    tickets: Vec<Ticket>,
}

/// Does what `octets` say and fails where the scanner does what it must not.
pub(crate) fn body(octets: &[u8]) {
    let mut reader = Reader::new(octets);
    let head = reader.u8().unwrap_or_default();
    let interval = Duration::from_millis(u64::from(reader.u8().unwrap_or_default()));
    let identity = ScannerIdentity { vendor: 1, serial: 1 };
    let mut scanner = Scanner::new(mac(1), identity, interval);
    for place in (0..MACS.len()).filter(|place| head & 1 << place != 0) {
        scanner.add(settings(head, place)).expect("there is room");
    }
    let mut bench = Bench {
        scanner,
        now: Instant::ZERO,
        asked: [(0, 0, None); 4],
        mailbox: None,
        medium_takes: true,
        bus_off: false,
        tickets: Vec::new(),
    };
    bench.serve();
    while let Ok(operation) = reader.u8() {
        bench.operate(operation, &mut reader);
        bench.serve();
        bench.judge();
    }
    bench.fall_silent();
}

/// What is done with the slave at `place`: it is polled, or produces changes, or each of the four
/// something else, with or without time-outs.
fn settings(head: u8, place: usize) -> SlaveSettings {
    let slave = mac(MACS[place]);
    let assembly = (head & 0x20 != 0).then_some(2);
    let mut settings = match (head >> 6, place) {
        (0, _) | (2 | 3, 0) => SlaveSettings::poll(slave),
        (1, _) => SlaveSettings::change_of_state(slave),
        (_, 1) => SlaveSettings::cyclic(slave, 100),
        (_, 2) => SlaveSettings::explicit(slave),
        _ => SlaveSettings {
            change: Some(ChangeSettings {
                trigger: Trigger::ChangeOfState,
                acknowledged: false,
                expected_packet_rate: 1_000,
                production_inhibit: 10,
                assembly,
            }),
            ..SlaveSettings::poll(slave)
        },
    };
    let unlimited = head >> 6 == 3;
    settings.poll = settings.poll.map(|poll| PollSettings {
        assembly,
        expected_packet_rate: if unlimited { 0 } else { poll.expected_packet_rate },
    });
    settings.change = settings.change.map(|change| ChangeSettings {
        assembly,
        expected_packet_rate: if unlimited { 0 } else { change.expected_packet_rate },
        ..change
    });
    let identity = DeviceIdentity { vendor: 468, product_code: 10 };
    settings.identity = (head & 0x10 != 0).then_some(identity);
    settings
}

fn mac(address: u8) -> MacId {
    MacId::new(address).expect("0 to 63")
}

impl Bench {
    fn operate(&mut self, operation: u8, reader: &mut Reader<'_>) {
        let number = |reader: &mut Reader<'_>| u64::from(reader.u16_le().unwrap_or_default());
        let mut octet = || reader.u8().unwrap_or_default();
        match operation {
            0x80..=0x83 => {
                let place = usize::from(operation & 3);
                let length = octet();
                let (header, service, _) = self.asked[place];
                let data = take(reader, length.min(6));
                self.answer(place, &[&[header & 0x7F, service | 0x80], data].concat());
            }
            0x84..=0x87 => {
                let length = octet();
                let identifier = 0x3C0 | u16::from(MACS[usize::from(operation & 3)]);
                self.hear(&Frame::standard(identifier, take(reader, length)));
            }
            0x88 => self.wait(Duration::from_millis(number(reader))),
            0x89 => self.wait(Duration::from_micros(number(reader))),
            0x8A => {
                self.now += Duration::from_millis(10 * number(reader));
                self.scanner.advance(self.now);
            }
            0x8B => self.hold(!self.medium_takes),
            0x8C => {
                let place = usize::from(octet() & 3);
                let (general, additional) = (octet(), octet());
                let header = self.asked[place].0 & 0x7F;
                self.answer(place, &[header, 0x94, general, additional]);
            }
            0x8D => {
                let identifier = reader.u16_le().unwrap_or_default();
                let length = reader.u8().unwrap_or_default();
                self.hear(&Frame::standard(identifier, take(reader, length)));
            }
            0x8E => {
                let (place, length) = (usize::from(octet() & 3), octet());
                let body = some(reader, length);
                let patience = Duration::from_secs(1);
                if let Ok(ticket) = self.scanner.request(mac(MACS[place]), body, patience) {
                    assert!(self.scanner.is_on_line() && !body.is_empty());
                    assert!(!self.tickets.contains(&ticket), "a ticket twice");
                    self.tickets.push(ticket);
                }
            }
            0x8F => {
                let place = usize::from(octet() & 3);
                if let (header, _, Some(frame)) = self.asked[place]
                    && let [_, fragment, ..] = frame.data()
                {
                    self.answer(place, &[header | 0x80, fragment | 0xC0, 0]);
                }
            }
            0x90 => {
                let place = usize::from(octet() & 3);
                let (fragment, length) = (octet(), octet());
                let data = take(reader, length.min(6));
                self.answer(place, &[&[self.asked[place].0 | 0x80, fragment], data].concat());
            }
            0x91 => {
                self.bus_off = true;
                self.mailbox = None;
                self.scanner.handle(self.now, Input::BusOff);
            }
            0x92 => self.recover(),
            0x93 => self.fetch(),
            0x94..=0x97 => {
                let length = octet();
                let identifier = 0x340 | u16::from(MACS[usize::from(operation & 3)]);
                self.hear(&Frame::standard(identifier, take(reader, length)));
            }
            0x98 => {
                let slave = mac(MACS[usize::from(octet() & 3)]);
                let known = self.scanner.slave(slave).is_some();
                assert_eq!(self.scanner.remove(slave), known);
            }
            0x99 => {
                let place = usize::from(octet() & 3);
                let known = self.scanner.slave(mac(MACS[place])).is_some();
                assert_eq!(self.scanner.add(settings(octet(), place)).is_err(), known);
            }
            0x9A => {
                let (place, length) = (usize::from(octet() & 3), octet());
                let data = some(reader, length);
                if self.scanner.set_output(mac(MACS[place]), data).is_ok() {
                    let view = self.scanner.slave(mac(MACS[place])).expect("it was just set");
                    assert_eq!(view.output, data);
                }
            }
            0x9B if !self.tickets.is_empty() => {
                self.scanner.cancel(self.tickets.remove(0));
            }
            0x9C => {
                let probing = if octet() & 1 == 0 { Probing::Gentle } else { Probing::Forced };
                let taken = self.scanner.scan(self.now, probing).is_ok();
                assert_eq!(taken, self.scanner.is_on_line());
            }
            0x9D => self.scanner.restart(),
            0x9E => {
                let identifier = 0x407 | u16::from(MACS[usize::from(octet() & 3)]) << 3;
                self.hear(&Frame::standard(identifier, &[0, 0xD4, 1, 9, 0, 0, 0]));
            }
            _ => {}
        }
    }

    fn answer(&mut self, place: usize, data: &[u8]) {
        let identifier = 0x403 | u16::from(MACS[place]) << 3;
        self.hear(&Frame::standard(identifier, data));
    }

    fn hear(&mut self, frame: &Frame) {
        if !self.bus_off {
            self.scanner.handle(self.now, Input::Frame(frame));
        }
    }

    fn hold(&mut self, hold: bool) {
        self.medium_takes = hold;
        if let Some(frame) = self.mailbox.take_if(|_| self.medium_takes) {
            self.scanner.handle(self.now, Input::Sent(&frame));
        }
    }

    fn recover(&mut self) {
        if std::mem::take(&mut self.bus_off) {
            self.scanner.handle(self.now, Input::Recovered);
        }
    }

    fn fetch(&mut self) {
        let scanner = &mut self.scanner;
        self.tickets.retain(|ticket| scanner.response(*ticket, |_| ()).is_none());
    }

    fn wait(&mut self, span: Duration) {
        let end = self.now + span;
        for _ in 0..STEPS {
            let Some(deadline) = self.scanner.deadline().filter(|deadline| *deadline <= end) else {
                break;
            };
            self.now = self.now.max(deadline);
            self.scanner.advance(self.now);
            self.serve();
        }
        self.now = end;
        self.scanner.advance(self.now);
    }

    /// What a driver does after each call.
    fn serve(&mut self) {
        if self.scanner.deadline().is_some_and(|at| at <= self.now) {
            self.scanner.advance(self.now);
        }
        let mut frames = 0;
        while !self.bus_off && self.mailbox.is_none() {
            let (on_line, fault) = (self.scanner.is_on_line(), self.scanner.faulted());
            let Some(frame) = self.scanner.transmit(self.now) else { break };
            self.judge_frame(&frame, on_line, fault);
            if self.medium_takes {
                self.scanner.handle(self.now, Input::Sent(&frame));
            } else {
                self.mailbox = Some(frame);
            }
            frames += 1;
            assert!(frames <= FRAMES_AT_ONCE, "{frame} is frame {frames} after one input");
        }
        if self.bus_off || self.mailbox.is_some() {
            return;
        }
        let deadline = self.scanner.deadline();
        assert!(deadline.is_none_or(|at| at > self.now), "{deadline:?} lies in the past");
        let idle = self.scanner.is_on_line() && self.views().next().is_some() && deadline.is_none();
        assert!(!idle, "on-line with slaves, and nothing will ever happen");
        self.scanner.advance(self.now);
        assert_eq!(self.scanner.transmit(self.now), None, "after advancing twice");
        assert_eq!(self.scanner.deadline(), deadline, "after advancing twice");
    }

    fn judge_frame(&mut self, frame: &Frame, on_line: bool, fault: Option<Fault>) {
        assert_eq!(fault, None, "{frame} from a scanner that should be silent");
        let Identifier::Standard(bits) = frame.identifier() else { panic!("{frame} is extended") };
        assert!(!frame.is_remote(), "{frame} is remote");
        if bits == 0x40F {
            return assert_eq!(frame.data()[0] >> 7 != 0, on_line, "{frame}");
        }
        assert!(on_line, "{frame} before on-line");
        let scans = matches!(self.scanner.live_list().progress, ScanProgress::Probing { .. });
        let place = MACS.iter().position(|mac| bits & 0x7F8 == 0x400 | u16::from(*mac) << 3);
        let known = place.filter(|place| self.scanner.slave(mac(MACS[*place])).is_some());
        let Some(place) = known else {
            assert!(scans && matches!(bits & 7, 6 | 7), "{frame} to nobody who was added");
            return;
        };
        match (bits & 7, frame.data()) {
            (4 | 6, [header, rest @ ..]) => {
                assert_eq!(header & 0x3F, 1, "{frame} under another MAC ID");
                let service = match (header >> 7, rest) {
                    (0, [service, ..]) | (1, [0, service, ..]) => *service,
                    _ => self.asked[place].1,
                };
                self.asked[place] = (*header, service, Some(*frame));
            }
            (5, _) | (2, []) => {}
            _ => panic!("{frame} is not ours to send"),
        }
    }

    fn views(&self) -> impl Iterator<Item = SlaveView<'_>> {
        MACS.into_iter().filter_map(|address| self.scanner.slave(mac(address)))
    }

    fn judge(&self) {
        assert!(self.scanner.faulted().is_none() || !self.scanner.is_on_line());
        for view in self.views() {
            assert!(view.input.len().max(view.change.len()).max(view.output.len()) <= 64);
            assert!(view.latest().is_none_or(|(at, _)| at <= self.now));
            assert_eq!(view.responses != 0, view.input_at.is_some());
            assert_eq!(view.changes != 0, view.change_at.is_some());
            let running = view.state == SlaveState::Running;
            assert!(!running || self.scanner.is_on_line(), "it runs without a scanner");
        }
    }

    /// Nobody says anything any more: slaves are lost, and every request has been answered for. The
    /// longest time-out that a slave can grant is four times 65.5 s; the driver sleeps through that.
    fn fall_silent(&mut self) {
        self.hold(true);
        self.recover();
        self.serve();
        self.wait(Duration::from_secs(3));
        self.serve();
        self.now += Duration::from_secs(270);
        self.scanner.advance(self.now);
        self.serve();
        for _ in 0..20 {
            self.wait(Duration::from_secs(1));
            self.serve();
        }
        self.judge();
        let running = self.views().any(|view| view.state == SlaveState::Running);
        assert!(!running, "a slave runs that has been silent for minutes");
        self.fetch();
        assert!(self.tickets.is_empty(), "{:?} without an answer", self.tickets);
        let progress = self.scanner.live_list().progress;
        let scans = matches!(progress, ScanProgress::Listening | ScanProgress::Probing { .. });
        assert!(!scans, "a scan without end");
    }
}

/// At most `length` octets.
fn some<'a>(reader: &mut Reader<'a>, length: u8) -> &'a [u8] {
    (0..=usize::from(length)).rev().find_map(|n| reader.octets(n).ok()).unwrap_or_default()
}

/// At most `length` and at most eight octets.
fn take<'a>(reader: &mut Reader<'a>, length: u8) -> &'a [u8] {
    some(reader, length.min(8))
}
