//! `slcan-listen:pty:PATH`: we play the adapter at a serial port made of software, for the one
//! program that opens it.

use std::collections::VecDeque;
use std::io::{self, Read};
use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant};

use codewheel_station::can::{BitRate, Frame};
use mio::Token;

use super::channel::{Channel, Effect};
use super::line::Line;
use crate::error::phrase;
use crate::output::{Output, Portion};
use crate::pty::Pty;
use crate::segment::moment;
use crate::socket::{Limit, Watch};
use crate::{CanPort, LinkError, Notice, Received, Waker};

const PROGRAM: Token = Token(1);

/// Octets read at once.
const PIECE: usize = 512;

/// Reports kept for a station that only sends and never receives.
const REPORTS: usize = 4096;

/// Makes a pty, puts its name at `path`, and serves a segment at `rate` there.
pub(crate) fn listen(path: &Path, rate: BitRate) -> Result<PtyPort, LinkError> {
    let watch = Watch::new()?;
    let pty = Pty::make(path, &watch, PROGRAM)?;
    Ok(PtyPort {
        rate,
        started: Instant::now(),
        watch,
        pty,
        is_unread: true,
        channel: Channel::default(),
        output: Output::default(),
        inbox: VecDeque::new(),
        was_unread_told: false,
        rate_told: None,
        end: None,
    })
}

/// An adapter whose serial port is a pty. Nobody sees a program open or close it: what the last one
/// left open stays open, as on a real adapter, until the next closes it.
#[derive(Debug)]
pub(crate) struct PtyPort {
    rate: BitRate,
    started: Instant,
    watch: Watch,
    pty: Pty,
    /// The pty may hold more: it tells once, and not again before it was read to its end.
    is_unread: bool,
    channel: Channel,
    output: Output<Line>,
    inbox: VecDeque<Received>,
    was_unread_told: bool,
    /// The other rate that people have heard of.
    rate_told: Option<u32>,
    /// Why there is nothing more to be had.
    end: Option<String>,
}

impl PtyPort {
    /// Reads one piece and does what it leads to.
    fn read(&mut self) {
        let mut buffer = [0; PIECE];
        match self.pty.read(&mut buffer) {
            Ok(0) => self.lose("the system closed it".to_owned()),
            Ok(count) => self.hear(buffer.get(..count).unwrap_or_default()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.is_unread = false,
            Err(error) => self.lose(phrase(&error)),
        }
    }

    fn hear(&mut self, octets: &[u8]) {
        if self.pty.forget_stale() {
            self.output.clear();
        }
        let mut effects = Vec::new();
        self.channel.receive(octets, |effect| effects.push(effect));
        for effect in effects {
            match effect {
                Effect::Answer(line) => self.say(line),
                Effect::Transmit(frame) => self.inbox.push_back(Received::Frame(frame)),
                Effect::Opened { bit_rate, .. } => self.tell_other_rate(bit_rate),
                Effect::Closed => {}
            }
        }
    }

    fn tell_other_rate(&mut self, bit_rate: Option<u32>) {
        let segment = self.rate;
        let Some(chosen) = bit_rate.filter(|chosen| *chosen != segment.bits_per_second()) else {
            return;
        };
        if self.rate_told.replace(chosen) != Some(chosen) {
            let client = format!("at {}", self.pty.path().display());
            self.tell(Notice::OtherBitRate { client, chosen, segment });
        }
    }

    fn say(&mut self, line: Line) {
        let thrown_away = self.pty.make_room(Portion::as_octets(&line).len());
        if thrown_away {
            self.output.clear();
        }
        if (self.output.push(line) || thrown_away) && !self.was_unread_told {
            self.was_unread_told = true;
            self.tell(Notice::LineUnread);
        }
    }

    fn flush(&mut self) {
        if let Err(error) = self.output.flush(&mut self.pty) {
            self.lose(phrase(&error));
        }
    }

    fn lose(&mut self, reason: String) {
        self.is_unread = false;
        self.end.get_or_insert(reason);
    }

    fn lost(&self, reason: &str) -> LinkError {
        LinkError::Lost { bus: self.describe(), reason: reason.to_owned() }
    }

    fn tell(&mut self, notice: Notice) {
        self.inbox.push_back(Received::Notice(notice));
    }
}

impl CanPort for PtyPort {
    fn is_ready(&self) -> bool {
        self.inbox.len() < REPORTS
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        if let Some(end) = &self.end {
            return Err(self.lost(end));
        }
        if !self.is_ready() {
            return Ok(false);
        }
        if let Some(line) = self.channel.deliver(frame, moment(self.started).milliseconds) {
            self.say(line);
            self.flush();
        }
        self.inbox.push_back(Received::Sent(*frame));
        Ok(true)
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        let limit = Limit::after(wait);
        loop {
            // First, so that a flood does not drown it.
            if self.watch.take_woken() {
                return Ok(Some(Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            if let Some(end) = &self.end {
                return Err(self.lost(end));
            }
            let pause = if self.is_unread { Some(Duration::ZERO) } else { limit.remaining() };
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
            // A program that sends nothing but garbage must not hold up the station's time.
            if self.inbox.is_empty() && self.end.is_none() && limit.is_over() {
                return Ok(None);
            }
        }
    }

    fn waker(&self) -> Waker {
        self.watch.waker()
    }

    /// The adapter acknowledges each frame itself, whether a program is there or not.
    fn confirms(&self) -> bool {
        true
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        format!("slcan-listen:pty:{}", self.pty.path().display())
    }
}
