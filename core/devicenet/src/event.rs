//! What the stack tells people, in place of a log.

use core::fmt;

use crate::{Fault, MacId};

/// Something that happened on the network side of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The duplicate MAC ID check was passed.
    OnLine,
    /// The node fell silent.
    Faulted(Fault),
    /// A master allocated connections.
    Allocated {
        /// Its MAC ID.
        master: MacId,
        /// The allocation choice octet.
        choice: u8,
    },
    /// Connections were released by service.
    Released {
        /// The release choice octet.
        choice: u8,
    },
    /// A connection went from configuring to established.
    Established {
        /// Its instance number.
        instance: u8,
    },
    /// A connection timed out.
    TimedOut {
        /// Its instance number.
        instance: u8,
    },
    /// The owning master and all its connections are forgotten.
    Forgotten,
    /// A poll command longer than the consumed size was dropped.
    PollTooLong {
        /// Its octets.
        length: u8,
    },
    /// An explicit response was given up: its fragments were not acknowledged.
    ResponseGivenUp,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OnLine => f.write_str("on-line"),
            Self::Faulted(Fault::DuplicateMac) => {
                f.write_str("another node has this MAC ID: silent until the next power cycle")
            }
            Self::Faulted(Fault::Detached) => f.write_str("off the network"),
            Self::Faulted(Fault::BusOff) => f.write_str("bus-off: silent"),
            Self::Faulted(Fault::Switches) => {
                f.write_str("the address switches give no DeviceNet address: silent")
            }
            Self::Allocated { master, choice } => {
                write!(f, "allocated by master {master}, choice {choice:02X}")
            }
            Self::Released { choice } => write!(f, "released, choice {choice:02X}"),
            Self::Established { instance } => write!(f, "connection {instance} established"),
            Self::TimedOut { instance } => write!(f, "connection {instance} timed out"),
            Self::Forgotten => f.write_str("no connection left: the master is forgotten"),
            Self::PollTooLong { length } => {
                write!(f, "poll command with {length} octets dropped: it consumes none")
            }
            Self::ResponseGivenUp => f.write_str("explicit response given up: not acknowledged"),
        }
    }
}
