//! A line behind a single stream of octets: a TCP connection, a pty, a serial port.

use std::collections::VecDeque;
use std::fmt;
use std::io::{self, Read, Write};
use std::net::SocketAddr;
use std::time::Duration;

use codewheel_station::rs485::{BaudRate, Transmission};
use mio::Token;

use super::PIECE;
use super::port::{Rs485Port, Rs485Received};
use crate::error::phrase;
use crate::output::{Output, Portion};
use crate::socket::{Limit, Watch};
use crate::{LinkError, Notice, Waker};

/// The token by which a stream is watched.
pub(super) const STREAM: Token = Token(1);

/// What the kinds of streams differ in. Reading and writing do not wait.
pub(super) trait Line: Read + Write + Send + fmt::Debug {
    /// Takes in what was read.
    fn hear(&mut self, octets: &[u8], inbox: &mut VecDeque<Rs485Received>) {
        inbox.push_back(Rs485Received::Octets(octets.to_vec()));
    }

    /// Makes room for `transmission`; gives whether something was thrown away for it.
    fn make_room(&mut self, _transmission: &Transmission) -> bool {
        false
    }

    /// Whether the line has a rate.
    fn has_rate(&self) -> bool {
        false
    }

    /// Sets the rate of a line that has one, and gives what people should hear of it.
    fn set_baud_rate(&mut self, _rate: BaudRate) -> io::Result<Vec<Notice>> {
        Ok(Vec::new())
    }

    /// The line as a bus URI.
    fn describe(&self) -> String;
}

/// A port to one stream.
#[derive(Debug)]
pub(super) struct StreamPort<L> {
    line: L,
    watch: Watch,
    /// The stream may hold more: it tells once, and not again before it was read to its end.
    is_unread: bool,
    output: Output<Transmission>,
    inbox: VecDeque<Rs485Received>,
    was_unread_told: bool,
    /// Why there is nothing more to be had.
    end: Option<String>,
}

impl Portion for Transmission {
    fn as_octets(&self) -> &[u8] {
        self.octets()
    }

    fn loss(&self) -> u64 {
        self.octets().len() as u64
    }
}

impl<L: Line> StreamPort<L> {
    /// A port to `line`, which `watch` watches as [`STREAM`]; `notices` are told first.
    pub(super) fn new(line: L, watch: Watch, notices: Vec<Notice>) -> Self {
        Self {
            line,
            watch,
            is_unread: true,
            output: Output::default(),
            inbox: notices.into_iter().map(Rs485Received::Notice).collect(),
            was_unread_told: false,
            end: None,
        }
    }

    /// Reads one piece and takes it in.
    fn read(&mut self) {
        let mut buffer = [0; PIECE];
        match self.line.read(&mut buffer) {
            Ok(0) => self.lose("the other side closed it".to_owned()),
            Ok(count) => {
                self.line.hear(buffer.get(..count).unwrap_or_default(), &mut self.inbox);
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => self.is_unread = false,
            Err(error) => self.lose(phrase(&error)),
        }
    }

    fn flush(&mut self) {
        if let Err(error) = self.output.flush(&mut self.line) {
            self.lose(phrase(&error));
        }
    }

    fn lose(&mut self, reason: String) {
        self.is_unread = false;
        self.end.get_or_insert(reason);
    }

    fn lost(&self, reason: &str) -> LinkError {
        LinkError::Lost { bus: self.line.describe(), reason: reason.to_owned() }
    }

    fn tell_unread(&mut self) {
        if !self.was_unread_told {
            self.was_unread_told = true;
            self.inbox.push_back(Rs485Received::Notice(Notice::LineUnread));
        }
    }
}

impl<L: Line> Rs485Port for StreamPort<L> {
    fn send(&mut self, transmission: &Transmission) -> Result<(), LinkError> {
        if let Some(end) = &self.end {
            return Err(self.lost(end));
        }
        let thrown_away = self.line.make_room(transmission);
        if thrown_away {
            self.output.unblock();
        }
        if self.output.push(*transmission) || thrown_away {
            self.tell_unread();
        }
        // A line lost here is reported by `receive`, after what had arrived.
        self.flush();
        Ok(())
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Rs485Received>, LinkError> {
        let limit = Limit::after(wait);
        // To look is to read: asking whether there is something to read costs as much.
        self.is_unread |= wait == Some(Duration::ZERO) && self.end.is_none();
        loop {
            // First, so that a flood does not drown it.
            if self.watch.take_woken() {
                return Ok(Some(Rs485Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            if let Some(end) = &self.end {
                return Err(self.lost(end));
            }
            if self.is_unread {
                self.read();
            } else if limit.is_over() {
                return Ok(None);
            } else {
                self.watch.wait(limit.remaining())?;
                for change in self.watch.changes() {
                    self.is_unread |= change.readable;
                    if change.writable {
                        self.output.unblock();
                    }
                }
                self.flush();
            }
        }
    }

    fn waker(&self) -> Waker {
        self.watch.waker()
    }

    fn has_rate(&self) -> bool {
        self.line.has_rate()
    }

    fn set_baud_rate(&mut self, rate: BaudRate) -> Result<(), LinkError> {
        match self.line.set_baud_rate(rate) {
            Ok(notices) => self.inbox.extend(notices.into_iter().map(Rs485Received::Notice)),
            Err(error) => self.lose(phrase(&error)),
        }
        Ok(())
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        self.line.describe()
    }
}
