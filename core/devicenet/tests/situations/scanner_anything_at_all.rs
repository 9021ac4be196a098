//! Arbitrary frames, reports and requests at arbitrary times: never a panic, never a deadline in
//! the past, never more to send than can be meant.

use codewheel_devicenet::scanner::{
    Probing, Scanner, ScannerIdentity, SlaveSettings, SlaveState, Ticket,
};
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Instant, Station};
use proptest::prelude::*;

use crate::scanner_bench::{mac, millis};

/// One thing that happens to the scanner.
#[derive(Clone, Debug)]
enum Happening {
    Frame(u16, Vec<u8>),
    /// A slave that answers as slaves do, with the given octets behind the service.
    Answer(Vec<u8>),
    Time(u64),
    /// The medium reports the oldest frame it holds.
    Sent,
    BusOff,
    Recovered,
    Restart,
    Request(u8, Vec<u8>, u64),
    Fetch,
    Cancel,
    Output(u8, Vec<u8>),
    Scan(bool),
    Add(u8),
    Remove(u8),
}

fn happening() -> impl Strategy<Value = Happening> {
    let octets = |most| prop::collection::vec(any::<u8>(), 0..=most);
    let address = || prop::sample::select(vec![3_u8, 5, 7]);
    let plausible = (
        prop::sample::select(vec![3_u16, 5, 7]),
        prop::sample::select(vec![3_u16, 7]),
        prop::sample::select(vec![0x00_u8, 0x40, 0x80, 0xC0]),
        prop::sample::select(vec![
            0x00_u8, 0x3F, 0x41, 0x81, 0x82, 0xC0, 0xC1, 0x8E, 0x90, 0x94, 0xCB,
        ]),
        octets(6),
    )
        .prop_map(|(mac, message, header, octet, rest)| {
            let mut data = vec![header, octet];
            data.extend(rest);
            Happening::Frame(0x400 | mac << 3 | message, data)
        });
    // As long as the slaves say they produce.
    let good = prop::sample::select(vec![0x3C3_u16, 0x345, 0x3C5, 0x343])
        .prop_map(|id| Happening::Frame(id, vec![1, 2, 3, 4]));
    let io = (
        prop::sample::select(vec![13_u16, 15]),
        prop::sample::select(vec![3_u16, 5, 7]),
        octets(8),
    )
        .prop_map(|(message, mac, data)| Happening::Frame(message << 6 | mac, data));
    prop_oneof![
        4 => Just(Happening::Answer(vec![4, 0])),
        2 => Just(Happening::Answer(vec![])),
        2 => prop::collection::vec(0..20_u8, 0..4).prop_map(Happening::Answer),
        3 => plausible,
        2 => io,
        4 => good,
        1 => (0..0x800_u16, octets(8)).prop_map(|(id, data)| Happening::Frame(id, data)),
        6 => prop::sample::select(vec![0_u64, 1, 10, 50, 500, 1_000, 2_500, 11_000]).prop_map(Happening::Time),
        6 => Just(Happening::Sent),
        1 => Just(Happening::BusOff),
        1 => Just(Happening::Recovered),
        1 => Just(Happening::Restart),
        3 => (address(), octets(70), 0..3_000_u64).prop_map(|(mac, body, time)| Happening::Request(mac, body, time)),
        2 => Just(Happening::Fetch),
        1 => Just(Happening::Cancel),
        1 => (address(), octets(70)).prop_map(|(mac, data)| Happening::Output(mac, data)),
        1 => any::<bool>().prop_map(Happening::Scan),
        1 => address().prop_map(Happening::Add),
        1 => address().prop_map(Happening::Remove),
    ]
}

struct Bench {
    scanner: Scanner<3>,
    now: Instant,
    /// Handed to the medium, and not yet reported as sent.
    mailbox: Vec<Frame>,
    last_request: Option<Frame>,
    tickets: Vec<Ticket>,
}

impl Bench {
    fn new(interval: Duration) -> Self {
        let mut scanner = Scanner::new(mac(0), ScannerIdentity { vendor: 1, serial: 99 }, interval);
        scanner.add(SlaveSettings::poll(mac(3))).unwrap();
        scanner.add(SlaveSettings::change_of_state(mac(5))).unwrap();
        scanner.add(SlaveSettings::explicit(mac(7))).unwrap();
        let mut bench = Self {
            scanner,
            now: Instant::ZERO,
            mailbox: vec![],
            last_request: None,
            tickets: vec![],
        };
        bench.settle();
        bench
    }

    /// Runs what is due and takes what there is to send.
    fn settle(&mut self) {
        self.scanner.advance(self.now);
        let mut count = 0;
        while let Some(frame) = self.scanner.transmit(self.now) {
            let id = frame.to_string();
            if matches!(&id[..3], "41C" | "41E" | "42C" | "42E" | "43C" | "43E") {
                self.last_request = Some(frame);
            }
            self.mailbox.push(frame);
            count += 1;
            assert!(count < 300, "the scanner does not stop sending");
        }
        if let Some(deadline) = self.scanner.deadline() {
            assert!(deadline > self.now, "{deadline} is not served at {}", self.now);
        }
    }

    fn pass(&mut self, span: Duration) {
        let end = self.now + span;
        while let Some(deadline) = self.scanner.deadline().filter(|deadline| *deadline <= end) {
            self.now = deadline;
            self.settle();
        }
        self.now = end;
        self.settle();
    }

    /// Answers the last request with `data`, as its slave would.
    fn answer(&mut self, data: &[u8]) {
        let Some(request) = self.last_request else { return };
        let codewheel_station::can::Identifier::Standard(bits) = request.identifier() else {
            return;
        };
        let Some((&header, rest)) = request.data().split_first() else { return };
        let id = bits & !7 | 3;
        let response = match rest.first() {
            Some(octet) if header & 0x80 != 0 => vec![header, 0xC0 | octet, 0],
            Some(service) => {
                let mut response = vec![header, service | 0x80];
                response.extend(data.iter().take(6));
                response
            }
            None => return,
        };
        self.scanner.handle(self.now, Input::Frame(&Frame::standard(id, &response)));
    }

    fn happens(&mut self, happening: &Happening) {
        match happening {
            Happening::Frame(id, data) => {
                self.scanner.handle(self.now, Input::Frame(&Frame::standard(*id, data)));
            }
            Happening::Answer(data) => self.answer(data),
            Happening::Time(time) => self.pass(millis(*time)),
            Happening::Sent => {
                if !self.mailbox.is_empty() {
                    let frame = self.mailbox.remove(0);
                    self.scanner.handle(self.now, Input::Sent(&frame));
                }
            }
            Happening::BusOff => {
                self.mailbox.clear();
                self.scanner.handle(self.now, Input::BusOff);
            }
            Happening::Recovered => self.scanner.handle(self.now, Input::Recovered),
            Happening::Restart => self.scanner.restart(),
            Happening::Request(address, body, time) => {
                if let Ok(ticket) = self.scanner.request(mac(*address), body, millis(*time)) {
                    self.tickets.push(ticket);
                }
            }
            Happening::Fetch => {
                let scanner = &mut self.scanner;
                self.tickets.retain(|ticket| scanner.response(*ticket, |_| ()).is_none());
            }
            Happening::Cancel => {
                if let Some(ticket) = self.tickets.pop() {
                    self.scanner.cancel(ticket);
                }
            }
            Happening::Output(address, data) => {
                let _ = self.scanner.set_output(mac(*address), data);
            }
            Happening::Scan(forced) => {
                let probing = if *forced { Probing::Forced } else { Probing::Gentle };
                let _ = self.scanner.scan(self.now, probing);
            }
            Happening::Add(address) => {
                let _ = self.scanner.add(SlaveSettings::poll(mac(*address)));
            }
            Happening::Remove(address) => {
                self.scanner.remove(mac(*address));
            }
        }
        self.settle();
    }
}

/// Brings the scanner on-line and its slaves, which obey, to data exchange.
fn begin(bench: &mut Bench) {
    for _ in 0..2 {
        for frame in std::mem::take(&mut bench.mailbox) {
            bench.scanner.handle(bench.now, Input::Sent(&frame));
        }
        bench.pass(millis(1_000));
    }
    for _ in 0..20 {
        for frame in std::mem::take(&mut bench.mailbox) {
            bench.scanner.handle(bench.now, Input::Sent(&frame));
            bench.last_request = Some(frame);
            // Attributes are sizes: four octets. What is set is granted.
            let reads = frame.data().get(1) == Some(&0x0E);
            bench.answer(if reads { &[4, 0] } else { &[] });
            bench.settle();
        }
    }
    for address in [3, 5, 7] {
        let state = bench.scanner.slave(mac(address)).unwrap().state;
        assert_eq!(state, SlaveState::Running, "{address}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_deadlines_are_served_and_every_ticket_ends(
        on_line in prop::bool::weighted(0.9),
        interval in prop::sample::select(vec![0_u64, 10]),
        happenings in prop::collection::vec(happening(), 1..150),
    ) {
        let mut bench = Bench::new(millis(interval));
        if on_line {
            begin(&mut bench);
        }
        for happening in &happenings {
            bench.happens(happening);
        }
        // The scanner counts what it is told: every view can be had at any time.
        for address in [3, 5, 7] {
            if let Some(view) = bench.scanner.slave(mac(address)) {
                prop_assert!(view.input.len() <= 64 && view.change.len() <= 64);
            }
        }
        let _ = bench.scanner.live_list();
        // With nobody left to answer, nothing stays open.
        bench.pass(Duration::from_secs(60));
        for ticket in std::mem::take(&mut bench.tickets) {
            prop_assert!(bench.scanner.response(ticket, |_| ()).is_some(), "{:?} hangs", ticket);
        }
    }
}
