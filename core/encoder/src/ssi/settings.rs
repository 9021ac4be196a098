//! How an SSI line is read: word, code, clock and times.

use core::fmt;

use codewheel_station::Duration;

use super::LineFault;
use crate::Geometry;

/// The slowest clock: 100 kHz.
pub const MIN_CLOCK_HZ: u32 = 100_000;

/// The fastest clock: 1 MHz.
pub const MAX_CLOCK_HZ: u32 = 1_000_000;

/// The clock of a new device: 500 kHz.
pub const DEFAULT_CLOCK_HZ: u32 = 500_000;

/// The monoflop time of a new device: 20 µs.
pub const DEFAULT_MONOFLOP: Duration = Duration::from_micros(20);

/// The cycle of a new device: a reading every millisecond.
pub const DEFAULT_CYCLE: Duration = Duration::from_millis(1);

/// The longest cycle. Decision: 2 ms, because two readings 2.5 ms apart are not judged
/// ([`JUDGED_WITHIN`](crate::JUDGED_WITHIN)), and a code jump must not pass unseen.
pub const LONGEST_CYCLE: Duration = Duration::from_millis(2);

/// The length of the SSI word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Word {
    /// 13 bit singleturn.
    Bits13,
    /// 18 bit singleturn.
    Bits18,
    /// 25 bit multiturn: 12 bits of turns, 13 of steps.
    Bits25,
    /// 29 bit multiturn: 16 bits of turns, 13 of steps.
    Bits29,
}

impl Word {
    /// The words a converter of this geometry reads; the first is that of a new device.
    ///
    /// SP 13 reads 13 bits, SP 18 reads 18, SP 29 reads 29 or 25 (decision); a converter that
    /// measures with [`Geometry::MULTITURN_25`] is an SP 29 too.
    #[must_use]
    pub fn choices(geometry: Geometry) -> &'static [Self] {
        match (geometry.is_multiturn(), geometry) {
            (true, _) => &[Self::Bits29, Self::Bits25],
            (false, Geometry::SINGLETURN_18) => &[Self::Bits18],
            (false, _) => &[Self::Bits13],
        }
    }

    /// The word of so many bits; `None` if there is none.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        match bits {
            13 => Some(Self::Bits13),
            18 => Some(Self::Bits18),
            25 => Some(Self::Bits25),
            29 => Some(Self::Bits29),
            _ => None,
        }
    }

    /// n, the bits of the word.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Self::Bits13 => 13,
            Self::Bits18 => 18,
            Self::Bits25 => 25,
            Self::Bits29 => 29,
        }
    }

    /// What the encoder at the line can tell apart: what the converter measures with.
    #[must_use]
    pub const fn geometry(self) -> Geometry {
        match self {
            Self::Bits13 => Geometry::SINGLETURN_13,
            Self::Bits18 => Geometry::SINGLETURN_18,
            Self::Bits25 => Geometry::MULTITURN_25,
            Self::Bits29 => Geometry::MULTITURN_29,
        }
    }
}

/// How the code is written in the word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Code {
    /// Gray code: one bit changes with each step.
    #[default]
    Gray,
    /// The binary number.
    Binary,
}

impl Code {
    /// The raw code that `word` stands for.
    #[must_use]
    pub const fn decode(self, word: u32) -> u32 {
        match self {
            Self::Binary => word,
            Self::Gray => {
                // Each bit is the sum, mod 2, of the Gray bits from it upwards.
                let mut code = word;
                let mut reach = 1;
                while reach < u32::BITS {
                    code ^= code >> reach;
                    reach *= 2;
                }
                code
            }
        }
    }
}

/// How an SSI line is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Settings {
    /// The length of the word.
    pub word: Word,
    /// How the code is written in it.
    pub code: Code,
    /// The clock, [`MIN_CLOCK_HZ`] … [`MAX_CLOCK_HZ`].
    pub clock_hz: u32,
    /// How long the encoder wants no clock before it latches anew: longer than a period of the
    /// clock, and short enough to end within the cycle.
    pub monoflop: Duration,
    /// Whether each word is read twice and compared. For encoders that repeat their word while the
    /// clock goes on; many do not.
    pub double_read: bool,
    /// The time from one reading to the next, at most [`LONGEST_CYCLE`].
    pub cycle: Duration,
}

impl Settings {
    /// The settings of a new device that reads such words: Gray, 500 kHz, 20 µs, read once, every
    /// millisecond.
    #[must_use]
    pub const fn of_word(word: Word) -> Self {
        Self {
            word,
            code: Code::Gray,
            clock_hz: DEFAULT_CLOCK_HZ,
            monoflop: DEFAULT_MONOFLOP,
            double_read: false,
            cycle: DEFAULT_CYCLE,
        }
    }

    /// Whether a line can be read this way.
    ///
    /// # Errors
    /// [`Refusal`], with what is allowed.
    pub fn check(&self) -> Result<(), Refusal> {
        if !(MIN_CLOCK_HZ..=MAX_CLOCK_HZ).contains(&self.clock_hz) {
            return Err(Refusal::Clock);
        }
        let period = clock_time(1, self.clock_hz);
        if self.monoflop <= period {
            return Err(Refusal::Monoflop { above: period });
        }
        let shortest = self.transfer_time() + self.monoflop;
        if self.cycle < shortest || self.cycle > LONGEST_CYCLE {
            return Err(Refusal::Cycle { min: shortest });
        }
        Ok(())
    }

    /// The clocks of one reading: n + 2 (first sample, word, low), or 2n + 3 with the word and its
    /// low once more. At most 61.
    #[must_use]
    pub const fn clocks(&self) -> u8 {
        let bits = self.word.bits();
        if self.double_read { 2 * bits + 3 } else { bits + 2 }
    }

    /// How long one reading takes, its clocks rounded up to whole octets, as ports clock them.
    #[must_use]
    pub const fn transfer_time(&self) -> Duration {
        clock_time(self.clocks().next_multiple_of(8), self.clock_hz)
    }

    /// The raw code in a reading: the line sampled at each of the [`clocks`](Self::clocks), the
    /// first in the highest of so many bits. Bits above them do not count.
    ///
    /// # Errors
    /// [`LineFault`], where the samples are none of a sound line.
    pub const fn decode(&self, sampled: u64) -> Result<u32, LineFault> {
        let bits = self.word.bits();
        // The word and its low, and with them the repeated ones, in the lowest bits.
        let (first, again) =
            if self.double_read { (sampled >> (bits + 1), Some(sampled)) } else { (sampled, None) };
        let framed = 1_u64 << (bits + 2);
        let idle_is_high = first & (framed >> 1) != 0;
        if first & (framed - 1) == framed - 1 {
            return Err(LineFault::StuckHigh);
        }
        if !idle_is_high {
            return Err(LineFault::StuckLow);
        }
        if first & 1 != 0 {
            return Err(LineFault::NoLowAfterWord);
        }
        let mask = (1_u64 << bits) - 1;
        let word = (first >> 1) & mask;
        if let Some(again) = again {
            if (again >> 1) & mask != word {
                return Err(LineFault::Mismatch);
            }
            if again & 1 != 0 {
                return Err(LineFault::NoLowAfterWord);
            }
        }
        Ok(self.code.decode(word as u32))
    }
}

const fn clock_time(clocks: u8, clock_hz: u32) -> Duration {
    let clock_hz = if clock_hz == 0 { 1 } else { clock_hz };
    Duration::from_nanos((clocks as u64 * 1_000_000_000).div_ceil(clock_hz as u64))
}

/// Why settings of an SSI line are refused. Each variant carries or names what is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The clock is not [`MIN_CLOCK_HZ`] … [`MAX_CLOCK_HZ`].
    Clock,
    /// The monoflop time is not longer than a period of the clock: the encoder would latch anew
    /// within the word.
    Monoflop {
        /// The period of the clock.
        above: Duration,
    },
    /// The cycle is shorter than a reading and the monoflop time after it, or longer than
    /// [`LONGEST_CYCLE`].
    Cycle {
        /// The shortest cycle, which may be longer than the longest allowed.
        min: Duration,
    },
}

impl fmt::Display for Refusal {
    /// What is allowed, as a sentence without a full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let micros = |span: Duration| span.as_nanos().div_ceil(1_000);
        match self {
            Self::Clock => write!(f, "the SSI clock is {MIN_CLOCK_HZ} to {MAX_CLOCK_HZ} Hz"),
            Self::Monoflop { above } => write!(
                f,
                "the monoflop time is longer than a period of the SSI clock, here {} µs: raise \
                 the time or the clock",
                micros(*above)
            ),
            Self::Cycle { min } if *min > LONGEST_CYCLE => write!(
                f,
                "one SSI reading and the monoflop time after it take {} µs, and the cycle is at \
                 most {} µs: lower the monoflop time or raise the clock",
                micros(*min),
                micros(LONGEST_CYCLE)
            ),
            Self::Cycle { min } => write!(
                f,
                "the SSI cycle is {} to {} µs with this word, clock and monoflop time",
                micros(*min),
                micros(LONGEST_CYCLE)
            ),
        }
    }
}

impl core::error::Error for Refusal {}
