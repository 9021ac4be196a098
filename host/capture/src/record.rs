//! What is recorded: one frame or telegram, its moment, its bus.

use std::fmt;
use std::time::{SystemTime, UNIX_EPOCH};

use codewheel_station::can::Frame;
use codewheel_station::{Duration, Instant};

/// A moment on the clock on the wall: nanoseconds since 1970-01-01 UTC, as far as 2554.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Timestamp(u64);

impl Timestamp {
    /// The moment `nanos` nanoseconds after the beginning of 1970.
    #[must_use]
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the beginning of 1970.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The span from `earlier` to `self`; zero where `earlier` is later.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }

    /// The moment of a bus whose time began at this one.
    #[must_use]
    pub const fn at(self, bus_time: Instant) -> Self {
        Self(self.0.saturating_add(bus_time.as_nanos()))
    }

    /// When the time of a bus began on whose clock it is `bus_time` now.
    #[must_use]
    pub fn origin_of(bus_time: Instant) -> Self {
        Self(Self::from(SystemTime::now()).0.saturating_sub(bus_time.as_nanos()))
    }
}

impl From<SystemTime> for Timestamp {
    /// Moments before 1970 become its beginning.
    fn from(time: SystemTime) -> Self {
        let span = time.duration_since(UNIX_EPOCH).unwrap_or_default();
        Self(u64::try_from(span.as_nanos()).unwrap_or(u64::MAX))
    }
}

impl fmt::Display for Timestamp {
    /// Seconds with six decimals, as candump prints them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:06}", self.0 / 1_000_000_000, self.0 / 1_000 % 1_000_000)
    }
}

/// Who said what was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Somebody else on the bus; also where a file does not say.
    #[default]
    Received,
    /// The side that recorded it.
    Sent,
}

/// How a telegram went over the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Condition {
    /// As it was sent, without a pause.
    #[default]
    Intact,
    /// With a broken character, a changed octet or a pause; or octets that are no telegram.
    Broken,
}

/// What a record holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content<'a> {
    /// A CAN frame.
    Frame(Frame),
    /// A telegram of PROFIBUS, or octets that should have been one.
    Telegram {
        /// Its octets, at most 255.
        octets: &'a [u8],
        /// How it went over the line.
        condition: Condition,
    },
}

/// One frame or telegram of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<'a> {
    /// The end of its last bit, or when it was handed over.
    pub at: Timestamp,
    /// The place of its bus among the buses of the capture.
    pub bus: u16,
    /// Who said it.
    pub direction: Direction,
    /// What was said.
    pub content: Content<'a>,
}
