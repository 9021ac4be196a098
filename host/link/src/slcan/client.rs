//! `slcan:`: we are the client of an adapter, or of another codewheel, over TCP or a serial port.

use std::collections::VecDeque;
use std::fmt;
use std::io::{self, Read, Write};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use codewheel_station::can::{BitRate, Frame};
use mio::net::TcpStream;
use mio::{Interest, Token};

use super::answer::{Answer, AnswerDecoder};
use super::line::Line;
use crate::error::phrase;
use crate::output::Output;
use crate::socket::{Limit, Watch, connect_to};
use crate::{CanPort, Endpoint, LinkError, Notice, Received, Waker};

/// The token by which the adapter is watched.
pub(super) const ADAPTER: Token = Token(1);

/// How long an adapter that answers may take for one answer before it counts as silent.
const ANSWER_LIMIT: Duration = Duration::from_secs(1);

/// Frames remembered for an adapter that has not answered yet.
const UNANSWERED: usize = 64;

/// Octets read at once.
const PIECE: usize = 4096;

/// Connects to `endpoint` and asks the adapter there to open its channel at `rate`.
pub(crate) fn connect(
    endpoint: &Endpoint,
    rate: BitRate,
) -> Result<ClientPort<TcpStream>, LinkError> {
    let failed = |reason| LinkError::Connect { endpoint: endpoint.to_string(), reason };
    let stream = connect_to(endpoint)?;
    stream.set_nodelay(true).map_err(failed)?;
    stream.set_nonblocking(true).map_err(failed)?;
    let mut stream = TcpStream::from_std(stream);
    let watch = Watch::new()?;
    watch
        .registry()
        .register(&mut stream, ADAPTER, Interest::READABLE | Interest::WRITABLE)
        .map_err(LinkError::System)?;
    Ok(ClientPort::new(format!("slcan:{endpoint}"), stream, watch, rate))
}

/// What leads to an adapter. Reading and writing do not wait.
pub(crate) trait Stream: Read + Write + Send + fmt::Debug {}

impl<S: Read + Write + Send + fmt::Debug> Stream for S {}

/// A channel of somebody else's adapter.
///
/// Adapters answer each frame with `z`, `Z` or a lone CR, or not at all. Which kind this is shows
/// with the first answer to a frame: before it nothing is confirmed, after it one frame is on its
/// way at a time, so that the next is built when it can go.
#[derive(Debug)]
pub(crate) struct ClientPort<S: Stream> {
    /// The adapter as a bus URI.
    bus: String,
    watch: Watch,
    stream: S,
    /// The stream may hold more: it tells once, and not again before it was read to its end.
    is_unread: bool,
    decoder: AnswerDecoder,
    output: Output<Line>,
    /// Commands whose answer is still to come, oldest first.
    commands: VecDeque<&'static str>,
    opened: Instant,
    /// Frames whose answer is still to come, oldest first.
    unanswered: VecDeque<Unanswered>,
    /// Whether this adapter answers frames, as far as is known.
    answers: bool,
    /// Refusals told to people since a frame was last taken: one frame is enough.
    refusals_told: u8,
    was_garbled: bool,
    inbox: VecDeque<Received>,
    end: Option<End>,
}

#[derive(Clone, Copy, Debug)]
struct Unanswered {
    frame: Frame,
    since: Instant,
    is_second_try: bool,
}

/// Why there is nothing more to be had from the adapter.
#[derive(Clone, Debug)]
enum End {
    Refused,
    Lost(String),
}

impl End {
    fn error(&self, bus: &str) -> LinkError {
        let bus = bus.to_owned();
        match self {
            Self::Refused => LinkError::Refused { bus },
            Self::Lost(reason) => LinkError::Lost { bus, reason: reason.clone() },
        }
    }
}

impl<S: Stream> ClientPort<S> {
    /// A port to the adapter behind `stream`, which `watch` watches as [`ADAPTER`]; asks it to open
    /// its channel at `rate`.
    pub(super) fn new(bus: String, stream: S, watch: Watch, rate: BitRate) -> Self {
        let mut port = Self {
            bus,
            watch,
            stream,
            is_unread: true,
            decoder: AnswerDecoder::default(),
            output: Output::default(),
            commands: VecDeque::new(),
            opened: Instant::now(),
            unanswered: VecDeque::new(),
            answers: false,
            refusals_told: 0,
            was_garbled: false,
            inbox: VecDeque::new(),
            end: None,
        };
        let bit_rate = match rate {
            BitRate::Kbit125 => "S4",
            BitRate::Kbit250 => "S5",
            BitRate::Kbit500 => "S6",
        };
        for command in ["C", bit_rate, "O"] {
            port.output.push(Line::short(format!("{command}\r").as_bytes()));
            port.commands.push_back(command);
        }
        port.flush();
        port
    }

    /// Has people hear of `notices` first.
    pub(super) fn telling(mut self, notices: impl IntoIterator<Item = Notice>) -> Self {
        self.inbox.extend(notices.into_iter().map(Received::Notice));
        self
    }

    /// Reads one piece and takes in what it says.
    fn read(&mut self) {
        let mut buffer = [0; PIECE];
        match self.stream.read(&mut buffer) {
            Ok(0) => self.lose("the other side closed it".to_owned()),
            Ok(count) => {
                for octet in buffer.get(..count).unwrap_or_default() {
                    if let Some(answer) = self.decoder.push(*octet) {
                        self.understand(answer);
                    }
                }
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.is_unread = false,
            Err(error) => self.lose(phrase(&error)),
        }
    }

    fn understand(&mut self, answer: Answer) {
        // An adapter that leaves commands unanswered must not have its answers to frames taken
        // for theirs for ever.
        if matches!(answer, Answer::Taken) || self.opened.elapsed() > ANSWER_LIMIT {
            self.commands.clear();
        }
        match answer {
            Answer::Frame(frame) => self.inbox.push_back(Received::Frame(frame)),
            Answer::Done | Answer::Taken => {
                if self.commands.pop_front().is_none() {
                    self.confirm();
                }
            }
            Answer::Refused => match self.commands.pop_front() {
                // A channel that is closed already cannot be closed.
                Some("C") => {}
                Some("O") => self.end = Some(End::Refused),
                Some(command) => self.tell(Notice::CommandRefused { command: command.to_owned() }),
                None => self.try_again(),
            },
            Answer::About => {}
            Answer::Garbage => {
                if !self.was_garbled {
                    self.was_garbled = true;
                    self.tell(Notice::AdapterGarbled);
                }
            }
        }
    }

    /// The oldest unanswered frame is out.
    fn confirm(&mut self) {
        let Some(unanswered) = self.unanswered.pop_front() else { return };
        self.answers = true;
        self.refusals_told = 0;
        self.inbox.push_back(Received::Sent(unanswered.frame));
    }

    /// The oldest unanswered frame was refused.
    fn try_again(&mut self) {
        let Some(Unanswered { frame, is_second_try, .. }) = self.unanswered.pop_front() else {
            return;
        };
        self.answers = true;
        if is_second_try {
            self.tell_refusal(Notice::FrameGivenUp { frame });
            self.inbox.push_back(Received::Sent(frame));
        } else {
            self.tell_refusal(Notice::FrameRefused { frame });
            self.put(frame, true);
        }
    }

    fn tell_refusal(&mut self, notice: Notice) {
        if self.refusals_told < 2 {
            self.refusals_told += 1;
            self.tell(notice);
        }
    }

    fn put(&mut self, frame: Frame, is_second_try: bool) {
        self.output.push(Line::frame(&frame, None));
        self.unanswered.push_back(Unanswered { frame, since: Instant::now(), is_second_try });
    }

    /// When an answer that is owed becomes too late. An adapter that never answered owes none.
    fn answer_limit(&self) -> Option<Instant> {
        let oldest = self.unanswered.front().filter(|_| self.answers)?;
        Some(oldest.since + ANSWER_LIMIT)
    }

    fn give_up_late_answers(&mut self) {
        if self.answer_limit().is_some_and(|limit| limit <= Instant::now()) {
            self.answers = false;
            self.unanswered.clear();
            self.tell(Notice::AdapterSilent);
        }
    }

    /// Makes room for one more frame among those unanswered.
    fn forget_the_oldest(&mut self) {
        self.unanswered.retain(|frame| frame.since.elapsed() < ANSWER_LIMIT);
        if self.unanswered.len() >= UNANSWERED {
            self.unanswered.pop_front();
        }
    }

    fn flush(&mut self) {
        if let Err(error) = self.output.flush(&mut self.stream) {
            self.lose(phrase(&error));
        }
    }

    fn lose(&mut self, reason: String) {
        self.is_unread = false;
        self.end.get_or_insert(End::Lost(reason));
    }

    fn tell(&mut self, notice: Notice) {
        self.inbox.push_back(Received::Notice(notice));
    }
}

impl<S: Stream> CanPort for ClientPort<S> {
    fn is_ready(&self) -> bool {
        let has_room = !self.answers || self.unanswered.is_empty();
        self.end.is_none() && self.output.is_empty() && has_room
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        if let Some(end) = &self.end {
            return Err(end.error(&self.bus));
        }
        if !self.is_ready() {
            return Ok(false);
        }
        self.forget_the_oldest();
        self.put(*frame, false);
        // A connection lost here is reported by `receive`, after what had arrived.
        self.flush();
        Ok(true)
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        let limit = Limit::after(wait);
        let was_ready = self.is_ready();
        loop {
            // First, so that a flood does not drown it.
            if self.watch.take_woken() {
                return Ok(Some(Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            if let Some(end) = &self.end {
                return Err(end.error(&self.bus));
            }
            let answer =
                self.answer_limit().map(|limit| limit.saturating_duration_since(Instant::now()));
            let pause = match (limit.remaining(), answer) {
                _ if self.is_unread => Some(Duration::ZERO),
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
            self.watch.wait(pause)?;
            for change in self.watch.changes() {
                self.is_unread |= change.readable;
                if change.writable {
                    self.output.unblock();
                }
            }
            if self.is_unread {
                self.read();
            }
            self.flush();
            self.give_up_late_answers();
            let became_ready = !was_ready && self.is_ready();
            if self.inbox.is_empty() && self.end.is_none() && (became_ready || limit.is_over()) {
                return Ok(None);
            }
        }
    }

    fn waker(&self) -> Waker {
        self.watch.waker()
    }

    fn confirms(&self) -> bool {
        self.answers
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        self.bus.clone()
    }
}

impl<S: Stream> Drop for ClientPort<S> {
    /// Closes the channel, so that an adapter of metal does not go on acknowledging frames that
    /// nobody reads.
    fn drop(&mut self) {
        self.output.push(Line::short(b"C\r"));
        self.flush();
    }
}
