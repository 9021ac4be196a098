//! The data that polls and productions carry, in fragments where they do not fit a frame.

use codewheel_station::Instant;
use codewheel_station::can::Frame;

use crate::MacId;
use crate::explicit::frame;
use crate::fragment::{Fragment, Reassembly, Received, io_fragment};
use crate::identifier::{POLL_COMMAND, group_2};

/// The most octets of input or output data that a scanner exchanges with one connection.
pub const IO_DATA_OCTETS: usize = 64;
/// The most that fit one frame.
const FRAME_OCTETS: usize = 8;

/// What a frame was to the production it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// None of the slave's productions.
    Nothing,
    /// A part of one.
    Part,
    /// All of one, or the rest of it.
    Whole,
}

/// What one I/O connection of a slave brings.
#[derive(Clone, Debug)]
pub(super) struct Input {
    octets: [u8; IO_DATA_OCTETS],
    length: u8,
    /// What the slave says it produces.
    size: u16,
    /// When the latest production was whole.
    pub(super) at: Option<Instant>,
    pub(super) count: u64,
    fragments: Reassembly<IO_DATA_OCTETS>,
}

impl Input {
    pub(super) const fn new() -> Self {
        Self {
            octets: [0; IO_DATA_OCTETS],
            length: 0,
            size: 0,
            at: None,
            count: 0,
            fragments: Reassembly::new(),
        }
    }

    /// The slave will produce `size` octets at a time.
    pub(super) const fn expect(&mut self, size: u16) {
        self.size = size;
        self.fragments.clear();
    }

    #[inline]
    pub(super) fn data(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// Takes in a frame. What is shorter or longer than the slave said it produces is none of its
    /// productions.
    #[inline]
    pub(super) fn heard(&mut self, now: Instant, data: &[u8]) -> Heard {
        let size = usize::from(self.size);
        let production = if size <= FRAME_OCTETS {
            data
        } else {
            let [octet, octets @ ..] = data else { return Heard::Nothing };
            match self.fragments.push(Fragment::from_octet(*octet), octets) {
                Received::Complete => self.fragments.body(),
                Received::Taken => return Heard::Part,
                Received::Dropped | Received::TooMuch => return Heard::Nothing,
            }
        };
        if production.len() != size {
            return Heard::Nothing;
        }
        for (to, from) in self.octets.iter_mut().zip(production) {
            *to = *from;
        }
        self.length = size.min(IO_DATA_OCTETS) as u8;
        self.at = Some(now);
        self.count += 1;
        Heard::Whole
    }
}

/// The output data of one slave.
#[derive(Clone, Debug)]
pub(super) struct Output {
    octets: [u8; IO_DATA_OCTETS],
    length: u8,
}

impl Output {
    pub(super) const fn new() -> Self {
        Self { octets: [0; IO_DATA_OCTETS], length: 0 }
    }

    pub(super) fn data(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// Keeps `data`, at most [`IO_DATA_OCTETS`] long.
    pub(super) fn set(&mut self, data: &[u8]) {
        for (to, from) in self.octets.iter_mut().zip(data) {
            *to = *from;
        }
        self.length = data.len().min(IO_DATA_OCTETS) as u8;
    }
}

/// A poll command too long for a frame, between its first and its last fragment. It keeps the data
/// as they were when it began, so that none goes out half old and half new.
#[derive(Clone, Debug)]
pub(super) struct LongPoll {
    mac: MacId,
    output: Output,
    /// The fragment to go next; 0 = there is none.
    next: u8,
}

impl LongPoll {
    pub(super) const fn idle(mac: MacId) -> Self {
        Self { mac, output: Output::new(), next: 0 }
    }

    pub(super) const fn stop(&mut self) {
        self.next = 0;
    }

    /// The poll command for the slave at `mac`, or its first fragment; more is in
    /// [`next`](Self::next) then.
    #[inline]
    pub(super) fn begin(&mut self, mac: MacId, output: &[u8]) -> Frame {
        let identifier = group_2(mac, POLL_COMMAND);
        if output.len() <= FRAME_OCTETS {
            return Frame::standard(identifier, output);
        }
        self.mac = mac;
        self.output.set(output);
        let first = self.fragment(0);
        self.next = 1;
        first.unwrap_or(Frame::standard(identifier, &[]))
    }

    /// What is left of the poll command under way.
    #[inline]
    pub(super) fn next(&mut self) -> Option<Frame> {
        if self.next == 0 {
            return None;
        }
        let frame = self.fragment(self.next);
        self.next = if frame.is_some() { self.next + 1 } else { 0 };
        frame
    }

    fn fragment(&self, index: u8) -> Option<Frame> {
        let (fragment, octets) = io_fragment(self.output.data(), usize::from(index))?;
        Some(frame(group_2(self.mac, POLL_COMMAND), &[fragment.to_octet()], octets))
    }
}
