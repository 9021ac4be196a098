//! The duplicate MAC ID check: how a node gets on line (CIP volume 3, chapter 2).
//!
//! Message: identifier `10 mac 111`, seven octets
//! `[bit 7 response | physical port 0] [vendor u16] [serial number u32]`.

use codewheel_station::can::Frame;
use codewheel_station::{Deadline, Duration, Instant, Reader, Short, Writer};

use crate::MacId;
use crate::identifier::{DUPLICATE_MAC_CHECK, group_2};

/// How long a node listens after each of its two requests.
const LISTEN_TIME: Duration = Duration::from_secs(1);

/// A duplicate MAC ID check message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CheckMessage {
    /// Bit 7 of the first octet: a response ("this address is mine") rather than a request.
    pub response: bool,
    /// The physical port, 0 … 127; we are always port 0.
    pub port: u8,
    /// The sender's vendor code.
    pub vendor: u16,
    /// The sender's serial number.
    pub serial: u32,
}

impl CheckMessage {
    /// Reads the message.
    ///
    /// # Errors
    /// [`Short`] with fewer than seven octets.
    pub fn parse(data: &[u8]) -> Result<Self, Short> {
        let mut reader = Reader::new(data);
        let first = reader.u8()?;
        Ok(Self {
            response: first & 0x80 != 0,
            port: first & 0x7F,
            vendor: reader.u16_le()?,
            serial: reader.u32_le()?,
        })
    }

    /// The frame that carries the message for `mac`.
    #[must_use]
    pub fn frame(&self, mac: MacId) -> Frame {
        let mut octets = [0; 7];
        let mut writer = Writer::new(&mut octets);
        // Seven octets fit seven octets.
        let _ = writer.u8((self.response as u8) << 7 | self.port & 0x7F);
        let _ = writer.u16_le(self.vendor);
        let _ = writer.u32_le(self.serial);
        Frame::standard(group_2(mac, DUPLICATE_MAC_CHECK), &octets)
    }
}

/// Why a node is silent on its network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Another node has the same MAC ID.
    DuplicateMac,
    /// The controller left the bus after too many errors.
    BusOff,
    /// Nothing leads to the network.
    Detached,
    /// The switches give no address of a DeviceNet node.
    Switches,
}

/// Where a node stands on its way to the network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// A request is to be sent, or has been handed to the controller.
    Asking {
        second: bool,
        handed: bool,
    },
    /// The request was acknowledged on the wire; another owner would answer until then.
    Listening {
        second: bool,
    },
    OnLine,
    Faulted(Fault),
}

/// What a step of the check brought about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Two requests went unanswered: the node is on-line.
    OnLine,
    /// Somebody else has our MAC ID: the node is silent until its next power cycle.
    Duplicate,
}

/// The check itself and, once on-line, the defence of the address.
#[derive(Clone, Debug)]
pub struct DuplicateMacCheck {
    mac: MacId,
    phase: Phase,
    answer_owed: bool,
    /// The end of [`Phase::Listening`].
    listens_until: Deadline,
}

impl DuplicateMacCheck {
    /// Begins the check for `mac`.
    #[must_use]
    pub const fn begin(mac: MacId) -> Self {
        Self {
            mac,
            phase: Phase::Asking { second: false, handed: false },
            answer_owed: false,
            listens_until: Deadline::NEVER,
        }
    }

    /// Falls silent for good. A fault that there is already stays: a node without an address of its
    /// own must not come back because its controller left the bus as well.
    pub const fn fault(&mut self, fault: Fault) {
        if matches!(self.phase, Phase::Faulted(Fault::DuplicateMac | Fault::Switches)) {
            return;
        }
        self.phase = Phase::Faulted(fault);
        self.answer_owed = false;
        self.listens_until = Deadline::NEVER;
    }

    /// Whether the check has been passed.
    #[must_use]
    pub const fn is_on_line(&self) -> bool {
        matches!(self.phase, Phase::OnLine)
    }

    /// Why the node is silent, if it is.
    #[must_use]
    pub const fn faulted(&self) -> Option<Fault> {
        match self.phase {
            Phase::Faulted(fault) => Some(fault),
            _ => None,
        }
    }

    /// A check message with our MAC ID arrived. Anything but seven octets is none and ignored.
    pub fn heard(&mut self, data: &[u8]) -> Option<Change> {
        if data.len() != 7 {
            return None;
        }
        let message = CheckMessage::parse(data).ok()?;
        match self.phase {
            Phase::Faulted(_) => None,
            Phase::OnLine if !message.response => {
                self.answer_owed = true;
                None
            }
            _ => {
                self.fault(Fault::DuplicateMac);
                Some(Change::Duplicate)
            }
        }
    }

    /// The controller reports our frame with `identifier` as sent.
    pub fn sent(&mut self, now: Instant, identifier: u16) {
        if identifier != group_2(self.mac, DUPLICATE_MAC_CHECK) {
            return;
        }
        if let Phase::Asking { second, handed: true } = self.phase {
            self.phase = Phase::Listening { second };
            self.listens_until = Deadline::at(now + LISTEN_TIME);
        }
    }

    /// Ends a silence that fell due.
    pub fn advance(&mut self, now: Instant) -> Option<Change> {
        if !self.listens_until.is_due(now) {
            return None;
        }
        self.listens_until = Deadline::NEVER;
        if self.phase == (Phase::Listening { second: true }) {
            self.phase = Phase::OnLine;
            return Some(Change::OnLine);
        }
        self.phase = Phase::Asking { second: true, handed: false };
        None
    }

    /// The check message to send next, signed with `vendor` and `serial`.
    pub fn transmit(&mut self, vendor: u16, serial: u32) -> Option<Frame> {
        let response = match &mut self.phase {
            Phase::Asking { handed, .. } if !*handed => {
                *handed = true;
                false
            }
            Phase::OnLine if self.answer_owed => {
                self.answer_owed = false;
                true
            }
            _ => return None,
        };
        Some(CheckMessage { response, port: 0, vendor, serial }.frame(self.mac))
    }

    /// When [`advance`](Self::advance) must run.
    #[must_use]
    pub const fn deadline(&self) -> Deadline {
        self.listens_until
    }
}
