//! An SSI line as the sensor of a converter.

use codewheel_station::Instant;

use super::{Master, Refusal, Settings};
use crate::{Sample, Sensor};

/// The port that clocks an SSI line: an SPI controller, two pins, or a line in virtual time.
///
/// It rests with the clock high. An SPI controller does all this in mode 2 (clock rests high,
/// sampled at the first edge), without chip select and output; it clocks whole octets, for which
/// there are [`octets_for`] and [`samples_of`]. A fail-safe receiver or a pull-up must hold the
/// data line high while nothing drives it, or a missing encoder is no certain
/// [`StuckHigh`](super::LineFault::StuckHigh).
pub trait Line {
    /// Clocks the line `clocks` times, 1 … 64, at `clock_hz` or the next slower rate the port has,
    /// from `now` on, and returns the data line sampled at each falling edge: the first in the
    /// highest of the lowest `clocks` bits, high as 1. More clocks may follow; they are not
    /// returned.
    ///
    /// `None` where the port failed. No clock may come after it has returned, until the next call.
    fn transfer(&mut self, now: Instant, clocks: u8, clock_hz: u32) -> Option<u64>;
}

impl<L: Line + ?Sized> Line for &mut L {
    fn transfer(&mut self, now: Instant, clocks: u8, clock_hz: u32) -> Option<u64> {
        (**self).transfer(now, clocks, clock_hz)
    }
}

/// The octets in which a port clocks `clocks` clocks, or a few more: 2 … 8 for the words of SSI.
#[must_use]
pub const fn octets_for(clocks: u8) -> usize {
    clocks.div_ceil(8) as usize
}

/// The first `clocks` samples, at most 64, of the octets a port has read, the highest bit first.
/// What would stand beyond their end reads as 0.
///
/// The clocks that fill the last octet come after the reading is complete. An encoder that repeats
/// its word begins to do so and breaks off when its monoflop ends; others stay low.
#[must_use]
pub fn samples_of(octets: &[u8], clocks: u8) -> u64 {
    let mut sampled = [0; 8];
    for (place, octet) in sampled.iter_mut().zip(octets) {
        *place = *octet;
    }
    let clocks = u32::from(clocks).min(u64::BITS);
    u64::from_be_bytes(sampled).checked_shr(u64::BITS - clocks).unwrap_or(0)
}

/// An SSI line as a sensor: read once a cycle, however often it is asked.
#[derive(Clone, Debug)]
pub struct Input<L> {
    line: L,
    master: Master,
}

impl<L: Line> Input<L> {
    /// The sensor at the end of `line`. It reads with the first sample.
    ///
    /// # Errors
    /// What [`Settings::check`] refuses.
    pub fn new(line: L, settings: Settings) -> Result<Self, Refusal> {
        Ok(Self { line, master: Master::new(settings)? })
    }

    /// How the line is read.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        self.master.settings()
    }

    /// The line.
    #[must_use]
    pub const fn line(&self) -> &L {
        &self.line
    }

    /// The line, to be changed, never to be clocked.
    #[must_use]
    pub const fn line_mut(&mut self) -> &mut L {
        &mut self.line
    }
}

impl<L: Line> Sensor for Input<L> {
    /// Reads the line when a cycle has passed since the last reading, and repeats that otherwise.
    fn sample(&mut self, now: Instant) -> Sample {
        if now < self.master.reads_at() {
            return self.master.repeated();
        }
        let settings = self.master.settings();
        let sampled = self.line.transfer(now, settings.clocks(), settings.clock_hz);
        self.master.read(now, sampled)
    }

    /// The next reading: nobody knows before it whether the shaft at the line has moved.
    fn changes_at(&self, now: Instant) -> Option<Instant> {
        Some(now.max(self.master.reads_at()))
    }
}
