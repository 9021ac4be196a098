//! The scanner with slaves played by the test: obedient ones, and such as break a rule.

use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{
    NotTaken, Response, Scanner, ScannerIdentity, SlaveSettings, SlaveState, SlaveView, Ticket,
};
use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Duration, Instant, Station};

use crate::bench::{frame, to_hex};

pub(crate) const fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

pub(crate) const fn secs(secs: u64) -> Duration {
    Duration::from_secs(secs)
}

pub(crate) fn mac(value: u8) -> MacId {
    MacId::new(value).expect("a MAC ID")
}

/// What the scanner took as the response, as text.
pub(crate) fn seen(response: Response<'_>) -> String {
    match response {
        Response::Done(data) => to_hex(data),
        Response::Refused(error) => format!("{error}"),
        Response::TooLong => "too long".into(),
        Response::NoAnswer => "no answer".into(),
    }
}

/// A slave as the test wants it: it answers what a slave must, unless a rule says otherwise.
#[derive(Clone, Debug)]
pub(crate) struct Peer {
    pub(crate) mac: u8,
    pub(crate) on: bool,
    /// Bodies of requests begin with this: what is answered, `None` for silence.
    pub(crate) rules: Vec<(String, Option<String>)>,
    /// What it answers to a poll; `None` for silence.
    pub(crate) input: Option<Vec<u8>>,
    /// Bodies of the requests, with `u` before those of the unconnected port.
    pub(crate) asked: Vec<String>,
    /// Polls as they came.
    pub(crate) polls: Vec<String>,
    request: Vec<u8>,
}

impl Peer {
    pub(crate) fn new(mac: u8) -> Self {
        Self {
            mac,
            on: true,
            rules: vec![
                ("4B0301".into(), Some("CB00".into())),
                ("4C0301".into(), Some("CC".into())),
                ("0E050207".into(), Some("8E0400".into())),
                ("0E050208".into(), Some("8E0000".into())),
                ("0E050407".into(), Some("8E0400".into())),
                ("0E05".into(), Some("8E03".into())),
                ("0E010101".into(), Some("8E3412".into())),
                ("0E010103".into(), Some("8E0B00".into())),
                ("10".into(), Some("90".into())),
            ],
            input: Some(vec![1, 2, 3, 4]),
            asked: Vec::new(),
            polls: Vec::new(),
            request: Vec::new(),
        }
    }

    /// Answers requests that begin with `body` otherwise than usual.
    pub(crate) fn answers(mut self, body: &str, answer: &str) -> Self {
        self.rule(body, Some(answer));
        self
    }

    pub(crate) fn rule(&mut self, body: &str, answer: Option<&str>) {
        let strip = |text: &str| text.replace(' ', "");
        self.rules.insert(0, (strip(body), answer.map(strip)));
    }

    pub(crate) fn was_asked(&self, body: &str) -> usize {
        let body = body.replace(' ', "");
        self.asked.iter().filter(|asked| asked.starts_with(&body)).count()
    }

    fn reply(&mut self, frame: &Frame) -> Vec<String> {
        let Identifier::Standard(bits) = frame.identifier() else { return vec![] };
        let own = 0x400 | u16::from(self.mac) << 3;
        let response = own | 3;
        if !self.on || bits & !7 != own {
            return vec![];
        }
        let (header, body) = match (bits & 7, frame.data()) {
            (5, data) => {
                self.polls.push(to_hex(data));
                let id = 0x3C0 | u16::from(self.mac);
                let input = self.input.as_ref();
                return input
                    .map(|octets| format!("{id:03X}#{}", to_hex(octets)))
                    .into_iter()
                    .collect();
            }
            (4 | 6, [header, body @ ..]) => (*header, body),
            _ => return vec![],
        };
        let mut sent = Vec::new();
        let mut whole = body.to_vec();
        if header & 0x80 != 0 {
            let octet = body[0];
            if octet >= 0xC0 {
                return vec![];
            }
            sent.push(format!("{response:03X}#{header:02X}{:02X}00", 0xC0 | octet));
            if octet == 0 {
                self.request.clear();
            }
            self.request.extend_from_slice(&body[1..]);
            if octet & 0xC0 != 0x80 {
                return sent;
            }
            whole = std::mem::take(&mut self.request);
        }
        let body = to_hex(&whole);
        self.asked.push(if bits & 7 == 6 { format!("u{body}") } else { body.clone() });
        let rule = self.rules.iter().find(|(begins, _)| body.starts_with(begins));
        match rule.map(|(_, answer)| answer.clone()) {
            Some(None) => {}
            Some(Some(answer)) => {
                sent.push(format!("{response:03X}#{:02X}{answer}", header & 0x7F))
            }
            None => sent.push(format!("{response:03X}#{:02X}9408FF", header & 0x7F)),
        }
        sent
    }
}

/// The scanner at MAC ID 0, vendor 1, serial number 99, and its peers, on a medium that takes every
/// frame at once and a frame's time of 200 µs.
pub(crate) struct Bench {
    pub(crate) scanner: Scanner<8>,
    pub(crate) peers: Vec<Peer>,
    pub(crate) now: Instant,
    /// Everything the scanner has sent.
    pub(crate) log: Vec<(Instant, String)>,
    /// Whether the medium reports what it has sent.
    pub(crate) reports: bool,
}

impl Bench {
    /// Switched on; polls every 10 ms.
    pub(crate) fn new(peers: &[Peer], settings: &[SlaveSettings]) -> Self {
        let identity = ScannerIdentity { vendor: 1, serial: 99 };
        let mut scanner = Scanner::new(mac(0), identity, millis(10));
        for settings in settings {
            scanner.add(*settings).expect("room");
        }
        let peers = peers.to_vec();
        Self { scanner, peers, now: Instant::ZERO, log: vec![], reports: true }
    }

    /// One peer, polled, for three seconds: it runs.
    pub(crate) fn polling(peer: Peer) -> Self {
        let settings = SlaveSettings::poll(mac(peer.mac));
        Self::running(peer, settings)
    }

    pub(crate) fn running(peer: Peer, settings: SlaveSettings) -> Self {
        let mut bench = Self::new(&[peer], &[settings]);
        bench.run(millis(2_500));
        assert_eq!(bench.view().state, SlaveState::Running);
        bench
    }

    pub(crate) fn peer(&mut self) -> &mut Peer {
        &mut self.peers[0]
    }

    pub(crate) fn view(&self) -> SlaveView<'_> {
        self.scanner.slave(mac(self.peers[0].mac)).expect("added")
    }

    pub(crate) fn state(&self) -> SlaveState {
        self.view().state
    }

    /// Asks the first peer.
    pub(crate) fn request(&mut self, body: &str) -> Result<Ticket, NotTaken> {
        let octets = frame_data(body);
        self.scanner.request(mac(self.peers[0].mac), &octets, millis(500))
    }

    /// What has come back for `ticket`.
    pub(crate) fn response(&mut self, ticket: Ticket) -> Option<String> {
        self.scanner.response(ticket, seen)
    }

    /// Takes everything the scanner has to send, without telling the peers.
    pub(crate) fn collect(&mut self) -> Vec<String> {
        let mut sent = Vec::new();
        while let Some(frame) = self.scanner.transmit(self.now) {
            sent.push(frame.to_string());
            self.log.push((self.now, frame.to_string()));
            if self.reports {
                self.scanner.handle(self.now, Input::Sent(&frame));
            }
            assert!(sent.len() < 200, "the scanner does not stop sending: {sent:?}");
        }
        sent
    }

    /// A frame arrives; what the scanner sends in return, except polls.
    pub(crate) fn hears(&mut self, candump: &str) -> Vec<String> {
        self.scanner.handle(self.now, Input::Frame(&frame(candump)));
        without_polls(self.collect())
    }

    /// A frame arrives; what the scanner sends in return must be `expected`, polls apart.
    #[track_caller]
    pub(crate) fn says(&mut self, candump: &str, expected: &[&str]) {
        assert_eq!(self.hears(candump), expected, "in answer to {candump}");
    }

    /// Time passes, and all peers answer what they hear.
    pub(crate) fn run(&mut self, span: Duration) {
        self.run_with(span, |_, _| true);
    }

    /// The same on a medium that loses frames for which `passes` says no.
    pub(crate) fn run_with(
        &mut self,
        span: Duration,
        mut passes: impl FnMut(Instant, &str) -> bool,
    ) {
        let end = self.now + span;
        while self.now < end {
            self.scanner.advance(self.now);
            if let Some(sent) = self.scanner.transmit(self.now) {
                self.log.push((self.now, sent.to_string()));
                if self.reports {
                    self.scanner.handle(self.now, Input::Sent(&sent));
                }
                if !passes(self.now, &sent.to_string()) {
                    continue;
                }
                for place in 0..self.peers.len() {
                    for answer in self.peers[place].reply(&sent) {
                        self.now += Duration::from_micros(200);
                        if passes(self.now, &answer) {
                            self.scanner.handle(self.now, Input::Frame(&frame(&answer)));
                        }
                    }
                }
                continue;
            }
            let next = self.scanner.deadline().unwrap_or(end);
            assert!(next > self.now, "the deadline {next} is not served at {}", self.now);
            self.now = next.min(end);
        }
    }

    /// Time passes, and nobody answers; what the scanner sent meanwhile, except polls.
    pub(crate) fn wait(&mut self, span: Duration) -> Vec<String> {
        let from = self.log.len();
        let peers = std::mem::take(&mut self.peers);
        self.run(span);
        self.peers = peers;
        without_polls(self.log[from..].iter().map(|(_, frame)| frame.clone()).collect())
    }
}

pub(crate) fn frame_data(hex: &str) -> Vec<u8> {
    let hex = hex.replace(' ', "");
    (0..hex.len() / 2)
        .map(|place| u8::from_str_radix(&hex[place * 2..place * 2 + 2], 16).expect("hexadecimal"))
        .collect()
}

fn without_polls(frames: Vec<String>) -> Vec<String> {
    let is_poll = |frame: &String| {
        let id = u16::from_str_radix(&frame[..3], 16).expect("an identifier");
        id & 0x607 == 0x405
    };
    frames.into_iter().filter(|frame| !is_poll(frame)).collect()
}
