//! What the wire has counted.

use codewheel_station::{Duration, Instant};

/// What the wire has counted from its beginning up to one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// The moment.
    pub at: Instant,
    /// Frames that went out and were acknowledged.
    pub frames: u64,
    /// Tries that nobody acknowledged.
    pub unacknowledged: u64,
    /// Tries that were destroyed on the wire.
    pub corrupted: u64,
    /// Frames that a station should have taken and did not see, counted for each station.
    pub lost: u64,
    /// How often a controller left the bus.
    pub bus_offs: u64,
    /// Rules broken.
    pub violations: u64,
    /// How long the wire was not idle: frames, error frames and their interframe spaces.
    pub busy: Duration,
}

impl Statistics {
    /// The share of the time since `earlier` in which the wire was not idle, 0 … 1; 0 where no time
    /// has passed. `Statistics::default()` stands for the beginning.
    #[must_use]
    pub fn bus_load_since(&self, earlier: &Self) -> f64 {
        let window = self.at.since(earlier.at).as_nanos();
        if window == 0 {
            return 0.0;
        }
        let busy = self.busy.as_nanos().saturating_sub(earlier.busy.as_nanos());
        busy as f64 / window as f64
    }
}
