//! One explicit request to a slave and its response, fragmented both ways where needed.
//!
//! The octets live with whoever asks, in a [`Question`]; the exchange keeps the state and the
//! timers, which are these:
//!
//! | while | the exchange is given up after |
//! |---|---|
//! | request fragments go out | one second without the acknowledge, twice |
//! | the response has not begun | the patience of the question, once all of it was sent |
//! | response fragments come in | [`FRAGMENT_TIME`] without a new one |
//! | anything at all | [`EXCHANGE_TIME`] and the patience, from the first frame |

use codewheel_station::can::Frame;
use codewheel_station::{Deadline, Duration, Instant};

use crate::MacId;
use crate::explicit::{BodyFormat, Error, GeneralStatus, Header, Service, frame};
use crate::fragment::{
    FIRST_AND_ONLY, Fragment, Kind, Piece, Reassembly, Received, STATUS_OK, STATUS_TOO_MUCH_DATA,
    Sending,
};
use crate::identifier::{EXPLICIT_REQUEST, UNCONNECTED_REQUEST, group_2};

/// How long a slave may take to answer over the explicit connection: its expected packet rate, as it
/// is after an allocation. A slave that writes its memory first takes up to 5 s, so whoever asks for
/// that waits longer.
pub const ANSWER_TIME: Duration = Duration::from_millis(2_500);

/// How long it may take on the unconnected port, where the question is whether it is there at all.
pub(super) const UNCONNECTED_TIME: Duration = Duration::from_millis(500);

/// How long the next fragment of a response may take: the slave repeats one after a second, once.
const FRAGMENT_TIME: Duration = Duration::from_millis(2_500);
/// The most an exchange may take besides the patience.
const EXCHANGE_TIME: Duration = Duration::from_secs(30);
/// How long a frame that was handed out may wait for the medium, where nobody reports it as sent.
const HANDED_TIME: Duration = Duration::from_secs(1);

/// Which port of the slave a request goes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Port {
    /// Group 2 message 6: Allocate and Release.
    Unconnected,
    /// Group 2 message 4, over the explicit connection.
    Connected,
}

impl Port {
    /// How long a slave may take to answer a request of our own.
    pub(super) const fn patience(self) -> Duration {
        match self {
            Self::Unconnected => UNCONNECTED_TIME,
            Self::Connected => ANSWER_TIME,
        }
    }
}

/// A request body, and room for what comes back.
#[derive(Clone, Debug)]
pub(super) struct Question<const REQUEST: usize, const RESPONSE: usize> {
    body: [u8; REQUEST],
    length: u8,
    pub(super) port: Port,
    pub(super) patience: Duration,
    response: Reassembly<RESPONSE>,
}

impl<const REQUEST: usize, const RESPONSE: usize> Question<REQUEST, RESPONSE> {
    pub(super) const fn new() -> Self {
        const { assert!(REQUEST <= u8::MAX as usize, "lengths are kept in 8 bits") };
        Self {
            body: [0; REQUEST],
            length: 0,
            port: Port::Unconnected,
            patience: ANSWER_TIME,
            response: Reassembly::new(),
        }
    }

    /// Keeps `body`, written as 8/8, in `format`: at most `REQUEST` octets then.
    pub(super) fn ask(&mut self, port: Port, format: BodyFormat, body: &[u8], patience: Duration) {
        let (wide_class, wide_instance) = format.high_octets();
        let high = |place| (place == 1 && wide_class) || (place == 2 && wide_instance);
        let octets = body
            .iter()
            .enumerate()
            .flat_map(|(place, octet)| core::iter::once(*octet).chain(high(place).then_some(0)));
        self.length = 0;
        for (to, from) in self.body.iter_mut().zip(octets) {
            *to = from;
            self.length += 1;
        }
        self.port = port;
        self.patience = patience;
        self.response.clear();
    }

    /// What the slave answered, once the exchange has ended with an answer.
    pub(super) fn answer(&self) -> Answer<'_> {
        match self.response.body() {
            [0x94, general, rest @ ..] => Answer::Refused(Error {
                general: GeneralStatus(*general),
                additional: rest.first().copied().unwrap_or(0xFF),
            }),
            [_, data @ ..] => Answer::Done(data),
            [] => Answer::Done(&[]),
        }
    }
}

/// What a slave answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer<'a> {
    /// It did it; the data behind the service octet.
    Done(&'a [u8]),
    /// It refused.
    Refused(Error),
}

/// How an exchange ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// The response has arrived.
    Answered,
    /// The response does not fit its room.
    TooLong,
    /// Nothing came back in time.
    Silent,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    /// The request is on its way or its response is waited for.
    Asking,
    Ended(Ended),
}

/// The acknowledge of one fragment, with the header and the port of the exchange it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Acknowledge {
    port: Port,
    header: Header,
    count: u8,
    status: u8,
}

#[derive(Clone, Debug)]
pub(super) struct Exchange {
    slave: MacId,
    header: Header,
    port: Port,
    state: State,
    /// The service asked for.
    service: u8,
    sending: Sending,
    /// Outlives the exchange it belongs to.
    acknowledge: Option<Acknowledge>,
    /// The acknowledge of the last fragment of the last response: when the fragment comes again,
    /// the acknowledge got lost.
    last: Option<Acknowledge>,
    /// How much of the response there is.
    collected: u16,
    patience: Duration,
    /// When the slave counts as silent, while it is its turn.
    silent_at: Deadline,
    /// When the exchange has taken too long altogether.
    ends_at: Deadline,
}

impl Exchange {
    pub(super) const fn new(master: MacId, slave: MacId) -> Self {
        Self {
            slave,
            header: Header(master.value()),
            port: Port::Unconnected,
            state: State::Idle,
            service: 0,
            sending: Sending::IDLE,
            acknowledge: None,
            last: None,
            collected: 0,
            patience: ANSWER_TIME,
            silent_at: Deadline::NEVER,
            ends_at: Deadline::NEVER,
        }
    }

    /// Begins to send `question`; what was on its way is given up, but for an acknowledge owed.
    pub(super) fn begin<const REQUEST: usize, const RESPONSE: usize>(
        &mut self,
        question: &mut Question<REQUEST, RESPONSE>,
    ) {
        self.stop();
        self.header = self.header.of_next_transaction();
        self.port = question.port;
        self.patience = question.patience;
        self.service = question.body.first().copied().unwrap_or_default();
        self.sending.begin(u16::from(question.length));
        question.response.clear();
        self.collected = 0;
        self.state = State::Asking;
    }

    /// Gives up whatever is going on, but for an acknowledge owed: without it the slave would
    /// repeat itself, and give up what we have long had.
    pub(super) const fn stop(&mut self) {
        self.state = State::Idle;
        self.sending.stop();
        self.silent_at = Deadline::NEVER;
        self.ends_at = Deadline::NEVER;
    }

    /// Forgets acknowledges, too: the slave or the bus is gone.
    pub(super) const fn forget(&mut self) {
        self.stop();
        self.acknowledge = None;
        self.last = None;
    }

    pub(super) fn is_idle(&self) -> bool {
        self.state == State::Idle
    }

    /// How the exchange ended, or `None` while it has not. Call [`stop`](Self::stop) when it has
    /// been seen.
    pub(super) const fn ended(&self) -> Option<Ended> {
        match self.state {
            State::Ended(ended) => Some(ended),
            State::Idle | State::Asking => None,
        }
    }

    /// An explicit response of the slave, without its header octet.
    pub(super) fn heard<const REQUEST: usize, const RESPONSE: usize>(
        &mut self,
        now: Instant,
        header: Header,
        rest: &[u8],
        question: &mut Question<REQUEST, RESPONSE>,
    ) {
        if header.mac() != self.header.mac() {
            return;
        }
        let ours = self.state == State::Asking && header.transaction() == self.header.transaction();
        let response = &mut question.response;
        if !header.fragmented() {
            if ours && rest.first().is_some_and(|service| self.answers(*service)) {
                response.clear();
                let only = Fragment { kind: Kind::First, count: FIRST_AND_ONLY };
                response.push(only, rest);
                self.end(Ended::Answered);
            }
            return;
        }
        let [octet, octets @ ..] = rest else { return };
        let fragment = Fragment::from_octet(*octet);
        match (fragment.kind, octets) {
            (_, []) => {}
            (Kind::Acknowledge, [status, ..]) => {
                if ours {
                    self.acknowledged(now, fragment.count, *status);
                }
            }
            _ if ours && self.sending.is_all_out() => {
                self.collect(now, header, fragment, octets, response);
            }
            _ => {
                if self
                    .last
                    .is_some_and(|last| last.header == header && last.count == fragment.count)
                    && is_last(fragment)
                {
                    self.acknowledge = self.last;
                }
            }
        }
    }

    /// Whether a response with `service` can be the one to our request, as far as a transaction
    /// identifier of one bit allows to say. A refusal may come before all of the request is out.
    const fn answers(&self, service: u8) -> bool {
        (service == Service::ERROR.response() && self.sending.has_begun())
            || (service == Service(self.service).response() && self.sending.is_all_out())
    }

    fn acknowledged(&mut self, now: Instant, count: u8, status: u8) {
        if self.sending.is_idle() {
            return;
        }
        self.sending.acknowledged(count, status);
        if self.sending.is_idle() {
            // All of it has arrived, or the slave has no room for it and will say so.
            self.silent_at = Deadline::at(now + self.patience);
        }
    }

    fn collect<const RESPONSE: usize>(
        &mut self,
        now: Instant,
        header: Header,
        fragment: Fragment,
        octets: &[u8],
        response: &mut Reassembly<RESPONSE>,
    ) {
        let received = response.push(fragment, octets);
        let status = match received {
            Received::Dropped => return,
            Received::Taken | Received::Complete => STATUS_OK,
            Received::TooMuch => STATUS_TOO_MUCH_DATA,
        };
        let acknowledge = Acknowledge { port: self.port, header, count: fragment.count, status };
        self.acknowledge = Some(acknowledge);
        // Only what is new proves that the slave gets on: not a repetition, nor a new beginning.
        let length = response.body().len() as u16;
        if length > self.collected {
            self.collected = length;
            self.silent_at = Deadline::at(now + self.patience.max(FRAGMENT_TIME));
        }
        match received {
            Received::Complete => {
                self.last = Some(acknowledge);
                if response.body().first().is_some_and(|service| self.answers(*service)) {
                    self.end(Ended::Answered);
                }
            }
            Received::TooMuch => self.end(Ended::TooLong),
            Received::Dropped | Received::Taken => {}
        }
    }

    const fn end(&mut self, ended: Ended) {
        self.stop();
        self.state = State::Ended(ended);
    }

    /// The medium reports a frame of ours to the slave, with `data`, as sent.
    pub(super) fn sent(&mut self, now: Instant, port: Port, data: &[u8]) {
        let Some(header) = data.first().map(|octet| Header(*octet)) else { return };
        if self.state != State::Asking
            || port != self.port
            || header.transaction() != self.header.transaction()
        {
            return;
        }
        if header.fragmented() {
            self.sending.sent(now);
        } else if self.silent_at != Deadline::NEVER {
            self.silent_at = Deadline::at(now + self.patience);
        }
    }

    pub(super) fn advance(&mut self, now: Instant) {
        if self.sending.advance(now) || self.silent_at.is_due(now) || self.ends_at.is_due(now) {
            self.end(Ended::Silent);
        }
    }

    pub(super) fn deadline(&self) -> Deadline {
        self.sending.deadline().min(self.silent_at).min(self.ends_at)
    }

    /// Whether [`transmit`](Self::transmit) has something.
    pub(super) const fn is_owed(&self) -> bool {
        self.acknowledge.is_some() || self.sending.is_owed()
    }

    pub(super) fn transmit<const REQUEST: usize, const RESPONSE: usize>(
        &mut self,
        now: Instant,
        question: &Question<REQUEST, RESPONSE>,
    ) -> Option<Frame> {
        if let Some(Acknowledge { port, header, count, status }) = self.acknowledge.take() {
            let fragment = Fragment { kind: Kind::Acknowledge, count };
            let octets = [header.with_fragmented(true).0, fragment.to_octet(), status];
            return Some(Frame::standard(self.identifier(port), &octets));
        }
        let identifier = self.identifier(self.port);
        let piece = self.sending.next(now, &question.body)?;
        if self.ends_at == Deadline::NEVER {
            self.ends_at = Deadline::at(now + self.patience + EXCHANGE_TIME);
        }
        Some(match piece {
            Piece::Whole(octets) => {
                self.silent_at = Deadline::at(now + self.patience + HANDED_TIME);
                frame(identifier, &[self.header.with_fragmented(false).0], octets)
            }
            Piece::Fragment(fragment, octets) => {
                let header = self.header.with_fragmented(true).0;
                frame(identifier, &[header, fragment.to_octet()], octets)
            }
        })
    }

    const fn identifier(&self, port: Port) -> u16 {
        let message = match port {
            Port::Unconnected => UNCONNECTED_REQUEST,
            Port::Connected => EXPLICIT_REQUEST,
        };
        group_2(self.slave, message)
    }
}

const fn is_last(fragment: Fragment) -> bool {
    match fragment.kind {
        Kind::Last => true,
        Kind::First => fragment.count == FIRST_AND_ONLY,
        Kind::Middle | Kind::Acknowledge => false,
    }
}
