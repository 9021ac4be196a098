//! What the line has counted.

use codewheel_station::{Duration, Instant};

/// What the line has counted from its beginning up to one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// The moment.
    pub at: Instant,
    /// Telegrams whose every character went over the line as it was sent, without a pause.
    pub telegrams: u64,
    /// Telegrams of which that is not true.
    pub disturbed: u64,
    /// Characters, whole and broken.
    pub characters: u64,
    /// Characters that were broken for everybody: by a fault, a collision or a power cut.
    pub broken: u64,
    /// Telegrams that a station did not hear, counted for each station.
    pub lost: u64,
    /// How often a station began to speak while another one spoke.
    pub collisions: u64,
    /// Rules broken.
    pub violations: u64,
    /// How long somebody spoke.
    pub busy: Duration,
}

impl Statistics {
    /// The share of the time since `earlier` in which somebody spoke, 0 … 1; 0 where no time has
    /// passed. `Statistics::default()` stands for the beginning.
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
