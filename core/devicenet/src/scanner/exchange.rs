//! One explicit request to a slave and its response, fragmented both ways where needed.

use codewheel_station::can::Frame;
use codewheel_station::{Deadline, Duration, Instant};

use crate::MacId;
use crate::explicit::{Error, GeneralStatus, Header, Service};
use crate::fragment::{
    Fragment, Kind, Piece, Reassembly, Received, STATUS_OK, STATUS_TOO_MUCH_DATA, Sending,
};
use crate::identifier::{EXPLICIT_REQUEST, UNCONNECTED_REQUEST, group_2};

/// The longest request body.
pub(super) const REQUEST_OCTETS: usize = 64;
/// The longest response body.
const RESPONSE_OCTETS: usize = 256;

/// How long a slave may take to answer. A slave that writes its memory first takes up to 5 s, so
/// whoever asks for that waits longer.
pub(super) const ANSWER_TIME: Duration = Duration::from_millis(500);

/// Which port of the slave a request goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Port {
    /// Group 2 message 6: Allocate and Release.
    Unconnected,
    /// Group 2 message 4, over the explicit connection.
    Connected,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    /// The request is on its way or its response is waited for.
    Asking,
    /// The response has arrived.
    Answered,
    /// Nothing came back in time.
    Silent,
}

/// How an exchange ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome<'a> {
    /// The slave did it; the data behind the service octet.
    Done(&'a [u8]),
    /// The slave refused.
    Refused(Error),
    /// Nothing came back in time.
    NoAnswer,
}

#[derive(Clone, Debug)]
pub(super) struct Exchange {
    slave: MacId,
    header: Header,
    port: Port,
    state: State,
    request: [u8; REQUEST_OCTETS],
    sending: Sending,
    acknowledge: Option<(u8, u8)>,
    response: Reassembly<RESPONSE_OCTETS>,
    patience: Duration,
    /// When the slave counts as silent, while something is waited for.
    silent_at: Deadline,
}

impl Exchange {
    pub(super) const fn new(master: MacId, slave: MacId) -> Self {
        Self {
            slave,
            header: Header(master.value()),
            port: Port::Unconnected,
            state: State::Idle,
            request: [0; REQUEST_OCTETS],
            sending: Sending::IDLE,
            acknowledge: None,
            response: Reassembly::new(),
            patience: ANSWER_TIME,
            silent_at: Deadline::NEVER,
        }
    }

    /// Begins to send `body`, at most [`REQUEST_OCTETS`] long; what was on its way is given up.
    pub(super) fn begin(&mut self, port: Port, body: &[u8], patience: Duration) {
        self.port = port;
        self.header = self.header.of_next_transaction();
        for (to, from) in self.request.iter_mut().zip(body) {
            *to = *from;
        }
        self.sending.begin(body.len().min(REQUEST_OCTETS) as u16);
        self.response.clear();
        self.acknowledge = None;
        self.patience = patience;
        self.silent_at = Deadline::NEVER;
        self.state = State::Asking;
    }

    /// Gives up whatever is going on.
    pub(super) fn stop(&mut self) {
        self.state = State::Idle;
        self.sending.stop();
        self.acknowledge = None;
        self.silent_at = Deadline::NEVER;
    }

    /// An explicit response of the slave, without its header octet.
    pub(super) fn heard(&mut self, now: Instant, header: Header, rest: &[u8]) {
        if self.state != State::Asking
            || header.mac() != self.header.mac()
            || header.transaction() != self.header.transaction()
        {
            return;
        }
        if !header.fragmented() {
            self.response.clear();
            let only = Fragment { kind: Kind::First, count: crate::fragment::FIRST_AND_ONLY };
            self.response.push(only, rest);
            return self.answered();
        }
        let [octet, octets @ ..] = rest else { return };
        let fragment = Fragment::from_octet(*octet);
        self.silent_at = Deadline::at(now + self.patience);
        if fragment.kind == Kind::Acknowledge {
            if let [status, ..] = octets {
                self.sending.acknowledged(fragment.count, *status);
            }
            return;
        }
        match self.response.push(fragment, octets) {
            Received::Dropped => {}
            Received::Taken => self.acknowledge = Some((fragment.count, STATUS_OK)),
            Received::TooMuch => {
                self.acknowledge = Some((fragment.count, STATUS_TOO_MUCH_DATA));
            }
            Received::Complete => {
                self.acknowledge = Some((fragment.count, STATUS_OK));
                self.answered();
            }
        }
    }

    fn answered(&mut self) {
        let asked = self.request.first().copied().unwrap_or_default();
        let Some(&service) = self.response.body().first() else { return };
        if service == Service::ERROR.response() || service == Service(asked).response() {
            self.state = State::Answered;
            self.sending.stop();
            self.silent_at = Deadline::NEVER;
        }
    }

    /// How the exchange ended, or `None` while it has not. Call [`stop`](Self::stop) when it has
    /// been read.
    pub(super) fn outcome(&self) -> Option<Outcome<'_>> {
        match self.state {
            State::Idle | State::Asking => None,
            State::Silent => Some(Outcome::NoAnswer),
            State::Answered => Some(match self.response.body() {
                [0x94, general, additional, ..] => Outcome::Refused(Error {
                    general: GeneralStatus(*general),
                    additional: *additional,
                }),
                [_, data @ ..] => Outcome::Done(data),
                [] => Outcome::NoAnswer,
            }),
        }
    }

    pub(super) fn advance(&mut self, now: Instant) {
        if self.sending.advance(now) || self.silent_at.is_due(now) {
            self.sending.stop();
            self.silent_at = Deadline::NEVER;
            if self.state == State::Asking {
                self.state = State::Silent;
            }
        }
    }

    pub(super) fn deadline(&self) -> Deadline {
        self.sending.deadline().min(self.silent_at)
    }

    /// Whether [`transmit`](Self::transmit) has something.
    pub(super) fn is_owed(&self) -> bool {
        self.acknowledge.is_some() || self.sending.is_owed()
    }

    pub(super) fn transmit(&mut self, now: Instant) -> Option<Frame> {
        let message = match self.port {
            Port::Unconnected => UNCONNECTED_REQUEST,
            Port::Connected => EXPLICIT_REQUEST,
        };
        let identifier = group_2(self.slave, message);
        if let Some((count, status)) = self.acknowledge.take() {
            let header = self.header.with_fragmented(true).0;
            let fragment = Fragment { kind: Kind::Acknowledge, count };
            return Some(Frame::standard(identifier, &[header, fragment.to_octet(), status]));
        }
        let frame = match self.sending.next(now, &self.request)? {
            Piece::Whole(octets) => {
                frame(identifier, &[self.header.with_fragmented(false).0], octets)
            }
            Piece::Fragment(fragment, octets) => {
                let header = self.header.with_fragmented(true).0;
                frame(identifier, &[header, fragment.to_octet()], octets)
            }
        };
        self.silent_at = Deadline::at(now + self.patience);
        Some(frame)
    }
}

/// A frame of a head and what follows it.
pub(crate) fn frame(identifier: u16, head: &[u8], rest: &[u8]) -> Frame {
    let mut octets = [0; 8];
    let length = head.len() + rest.len();
    for (to, from) in octets.iter_mut().zip(head.iter().chain(rest)) {
        *to = *from;
    }
    Frame::standard(identifier, octets.get(..length).unwrap_or(&octets))
}
