//! What the scanner knows and tells.

use codewheel_station::{Duration, Instant};

use super::settings::Refusal;
use crate::MacId;
use crate::explicit::Error;

/// Where a slave stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlaveState {
    /// It does not answer.
    Absent,
    /// It answers and is being configured, or is being released.
    Configuring,
    /// It exchanges data.
    Running,
    /// It answers, and refuses; tried again every two seconds.
    Refused(Refusal),
}

/// What is known of a slave now.
#[derive(Clone, Copy, Debug)]
pub struct SlaveView<'a> {
    /// Where it stands.
    pub state: SlaveState,
    /// Its latest poll response; empty before the first.
    pub input: &'a [u8],
    /// When the poll response arrived.
    pub input_at: Option<Instant>,
    /// What it produced last of its own accord (change of state or cyclic); empty before the
    /// first production.
    pub change: &'a [u8],
    /// When that production arrived.
    pub change_at: Option<Instant>,
    /// What a poll command carries; empty for a slave that gets none.
    pub output: &'a [u8],
    /// Poll commands sent.
    pub polls: u64,
    /// Poll responses received.
    pub responses: u64,
    /// Productions of its own accord received, repetitions included.
    pub changes: u64,
    /// How often it was lost while running.
    pub losses: u32,
}

impl<'a> SlaveView<'a> {
    /// The newest input, whichever connection brought it, and when it arrived.
    #[must_use]
    pub fn latest(&self) -> Option<(Instant, &'a [u8])> {
        let poll = self.input_at.map(|at| (at, self.input));
        let change = self.change_at.map(|at| (at, self.change));
        match (poll, change) {
            (Some(poll), Some(change)) => Some(if change.0 > poll.0 { change } else { poll }),
            (poll, change) => poll.or(change),
        }
    }
}

/// Names an explicit request until its response has been fetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket {
    pub(super) mac: MacId,
    pub(super) number: u32,
}

impl Ticket {
    /// The slave that is asked.
    #[must_use]
    pub const fn mac(self) -> MacId {
        self.mac
    }
}

/// What came back for a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response<'a> {
    /// The slave did it; the data of its response.
    Done(&'a [u8]),
    /// The slave refused.
    Refused(Error),
    /// The response is longer than the 256 octets there is room for.
    TooLong,
    /// The slave did not answer in time, or was lost, or the scanner left the bus.
    NoAnswer,
}

/// The times of the poll cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleTimes {
    /// Cycles completed.
    pub count: u64,
    /// The last one, from its first poll to its last response.
    pub last: Duration,
    /// The longest one.
    pub longest: Duration,
}
