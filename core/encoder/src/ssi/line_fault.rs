//! What can be wrong with an SSI line.

use core::fmt;

/// What was wrong with the newest reading of an SSI line. It holds the last good position and is a
/// position error, renewed with each cycle.
///
/// A wrong bit count shows by the bit that stands where the line must be low. Where that bit
/// happens to be 0 the reading counts as good: a turning shaft gives the count away, and reading
/// twice does with an encoder that repeats its word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LineFault {
    /// High from before the first clock until after the last bit: no encoder.
    StuckHigh,
    /// Low before the first clock, where the line must rest high: a short, crossed data wires, or
    /// a monoflop that is not over after a whole cycle.
    StuckLow,
    /// Not low after the last bit: the encoder has a word of another length, or no monoflop.
    NoLowAfterWord,
    /// The word read a second time is another one. Encoders that do not repeat their word cannot
    /// be read twice.
    Mismatch,
    /// The port that clocks the line failed, so nothing was read. Decision: it is no fault of the
    /// line, but the position is as old as with one.
    NoTransfer,
}

impl fmt::Display for LineFault {
    /// What was seen and what to look at, as a sentence without a full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StuckHigh => {
                "the SSI data line stays high: no encoder answers; check its supply and the wires \
                 of clock and data"
            }
            Self::StuckLow => {
                "the SSI data line is low before the first clock: check for a short and for \
                 crossed data wires; the encoder's monoflop time must be shorter than the pause \
                 between two readings"
            }
            Self::NoLowAfterWord => {
                "the SSI data line is not low after the last bit: check that both sides have the \
                 same number of bits, and that the encoder has a monoflop"
            }
            Self::Mismatch => {
                "the SSI word read a second time is another one: check screen and cable length; \
                 switch double reading off if the encoder does not repeat its word"
            }
            Self::NoTransfer => {
                "the SSI line could not be clocked: the port refused or broke off the transfer"
            }
        })
    }
}

impl core::error::Error for LineFault {}
