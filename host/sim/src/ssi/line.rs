//! The line between a master and a virtual encoder.

use codewheel_encoder::Sensor;
use codewheel_encoder::ssi::Line;
use codewheel_station::{Duration, Instant};

use super::VirtualEncoder;

/// The most clocks of a transfer.
const MOST_CLOCKS: u8 = 64;

/// A port that plays the clock of a master to a [`VirtualEncoder`], edge by edge, in virtual time.
#[derive(Clone, Debug)]
pub struct VirtualLine<S> {
    encoder: VirtualEncoder<S>,
    whole_octets: bool,
}

impl<S: Sensor> VirtualLine<S> {
    /// A line of which a port can clock any number of bits, as two pins of a board can.
    #[must_use]
    pub const fn new(encoder: VirtualEncoder<S>) -> Self {
        Self { encoder, whole_octets: false }
    }

    /// A line at a port that fills the last octet with further clocks, as SPI controllers do.
    #[must_use]
    pub const fn in_whole_octets(encoder: VirtualEncoder<S>) -> Self {
        Self { encoder, whole_octets: true }
    }

    /// The encoder at the far end.
    #[must_use]
    pub const fn encoder(&self) -> &VirtualEncoder<S> {
        &self.encoder
    }

    /// The encoder at the far end, to be turned or to fail.
    #[must_use]
    pub const fn encoder_mut(&mut self) -> &mut VirtualEncoder<S> {
        &mut self.encoder
    }
}

impl<S: Sensor> Line for VirtualLine<S> {
    /// The clock falls at `now` for the first time and rests low for the first half of each
    /// period. `None` at 0 Hz.
    fn transfer(&mut self, now: Instant, clocks: u8, clock_hz: u32) -> Option<u64> {
        let wanted = clocks.min(MOST_CLOCKS);
        let played = if self.whole_octets { wanted.next_multiple_of(8) } else { wanted };
        let half_periods = |count: u64| {
            (count * 500_000_000).checked_div(clock_hz.into()).map(Duration::from_nanos)
        };
        let mut sampled = 0;
        for clock in 0..played {
            let falls = now + half_periods(2 * u64::from(clock))?;
            let rises = now + half_periods(2 * u64::from(clock) + 1)?;
            if clock < wanted {
                sampled = sampled << 1 | u64::from(self.encoder.data_is_high(falls));
            }
            self.encoder.clock_falls(falls);
            self.encoder.clock_rises(rises);
        }
        Some(sampled)
    }
}
