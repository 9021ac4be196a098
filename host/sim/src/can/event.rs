//! What an observer of the wire sees.

use std::fmt;

use codewheel_station::Instant;
use codewheel_station::can::Frame;

use super::NodeId;

/// Something that happened on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame went over the wire and was acknowledged.
    Frame {
        /// The end of its last bit; the interframe space follows.
        at: Instant,
        /// Its sender; the first of them where several sent the same frame at once.
        from: NodeId,
        /// The frame.
        frame: Frame,
        /// How long it occupied the wire, in bits, with three bits of interframe space.
        bits: u32,
    },
    /// Nobody was there to acknowledge a frame. Its sender keeps it and tries again.
    Unacknowledged {
        /// The end of the error frame.
        at: Instant,
        /// The sender.
        from: NodeId,
        /// The frame.
        frame: Frame,
    },
    /// A frame was destroyed on the wire. Its sender keeps it and tries again.
    Corrupted {
        /// The end of the error frame.
        at: Instant,
        /// The sender; the one with the most dominant bits where several collided.
        from: NodeId,
        /// The frame.
        frame: Frame,
    },
    /// A station that should have taken a frame did not see it.
    Lost {
        /// The end of the frame.
        at: Instant,
        /// The station that missed it.
        receiver: NodeId,
        /// The frame.
        frame: Frame,
    },
    /// The controller of a station has left the bus.
    BusOff {
        /// When.
        at: Instant,
        /// The station.
        station: NodeId,
    },
    /// The controller of a station takes part again after a bus-off.
    Recovered {
        /// When.
        at: Instant,
        /// The station.
        station: NodeId,
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
    /// When it happened.
    #[must_use]
    pub const fn at(&self) -> Instant {
        match self {
            Self::Frame { at, .. }
            | Self::Unacknowledged { at, .. }
            | Self::Corrupted { at, .. }
            | Self::Lost { at, .. }
            | Self::BusOff { at, .. }
            | Self::Recovered { at, .. }
            | Self::Violation { at, .. } => *at,
        }
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame { at, frame, .. } => write!(f, "{at} {frame}"),
            Self::Unacknowledged { at, frame, .. } => write!(f, "{at} {frame} unacknowledged"),
            Self::Corrupted { at, frame, .. } => write!(f, "{at} {frame} destroyed"),
            Self::Lost { at, frame, .. } => write!(f, "{at} {frame} lost by a receiver"),
            Self::BusOff { at, .. } => write!(f, "{at} a station is bus-off"),
            Self::Recovered { at, .. } => write!(f, "{at} a station takes part again"),
            Self::Violation { at, station, rule } => write!(f, "{at} {station} {rule}"),
        }
    }
}
