//! What an observer of the line sees.

use std::fmt;

use codewheel_station::Instant;
use codewheel_station::rs485::Transmission;

use super::NodeId;

/// Something that happened on the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A telegram has gone over the line.
    Telegram {
        /// Its sender.
        from: NodeId,
        /// What was sent. A telegram cut short by a loss of power is shown whole.
        octets: Transmission,
        /// The begin of its first start bit.
        begin: Instant,
        /// The end of its last stop bit.
        end: Instant,
        /// Whether each character went over the line as it was sent, without a pause between them.
        intact: bool,
    },
    /// A character was broken for everybody.
    BrokenCharacter {
        /// Its end.
        at: Instant,
        /// The sender.
        from: NodeId,
    },
    /// Two bits of a character were turned over.
    Flipped {
        /// Its end.
        at: Instant,
        /// The sender.
        from: NodeId,
        /// The octet that was sent.
        sent: u8,
        /// The octet that the line carried.
        carried: u8,
    },
    /// A telegram was interrupted for a while.
    Pause {
        /// The end of the character before the pause.
        at: Instant,
        /// The sender.
        from: NodeId,
        /// How long the pause is.
        bits: u32,
    },
    /// A station will not hear a telegram that begins.
    Lost {
        /// The begin of the telegram.
        at: Instant,
        /// The station that misses it.
        receiver: NodeId,
        /// The telegram.
        octets: Transmission,
    },
    /// A station began to speak while another one spoke.
    Collision {
        /// When.
        at: Instant,
        /// The name of the station that spoke already.
        first: String,
        /// The name of the station that began.
        second: String,
    },
    /// A station broke a rule.
    Violation {
        /// When it showed.
        at: Instant,
        /// The name of the station.
        station: String,
        /// What it did against which rule; reads on from the name.
        rule: String,
    },
}

impl Event {
    /// When it happened; of a telegram its end.
    #[must_use]
    pub const fn at(&self) -> Instant {
        match self {
            Self::Telegram { end: at, .. }
            | Self::BrokenCharacter { at, .. }
            | Self::Flipped { at, .. }
            | Self::Pause { at, .. }
            | Self::Lost { at, .. }
            | Self::Collision { at, .. }
            | Self::Violation { at, .. } => *at,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ", self.at())?;
        match self {
            Self::Telegram { octets, intact: true, .. } => write!(f, "{octets:?}"),
            Self::Telegram { octets, intact: false, .. } => write!(f, "{octets:?} disturbed"),
            Self::BrokenCharacter { .. } => f.write_str("a broken character"),
            Self::Flipped { sent, carried, .. } => write!(f, "{sent:02X} became {carried:02X}"),
            Self::Pause { bits, .. } => write!(f, "a pause of {bits} bits inside a telegram"),
            Self::Lost { octets, .. } => write!(f, "{octets:?} lost by a receiver"),
            Self::Collision { first, second, .. } => {
                write!(f, "{second} begins to speak while {first} speaks")
            }
            Self::Violation { station, rule, .. } => write!(f, "{station} {rule}"),
        }
    }
}
