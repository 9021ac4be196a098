//! The SSI input of a converter: the word of an encoder at a synchronous serial line, and what can
//! be wrong with it (HEAG 162; PROFIBUS manual §7.1, "HEAG").
//!
//! The converter is the master. Clock and data rest high; the encoder latches its code at the
//! first falling clock edge, shows one bit at each rising edge, the most significant first, and
//! pulls the line low after the last one, until its monoflop has seen no clock for a while. The
//! line is sampled at each falling edge, so n bits take n + 2 clocks:
//!
//! ```text
//! clock  ‾‾\__/‾‾\__/‾‾\__/‾‾  …  \__/‾‾\__/‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾
//! data   ‾‾‾‾‾< n−1 >< n−2 ><  …     >< 0  >\_____________/‾‾‾
//! sample   1    2      3         n      n+1   n+2   monoflop
//!        idle  msb                      lsb   low
//! ```
//!
//! The first sample must be high and the last one low: with them a broken wire, a short and most
//! wrong bit counts show themselves. A clock more at the end begins the repetition of the word on
//! encoders that repeat it; it is not needed and not looked at, unless the word is read twice.
//!
//! [`Master`] says what to clock and when, and judges what was sampled; it does no I/O. [`Input`]
//! joins it to a [`Line`] and is the [`Sensor`](crate::Sensor) of a converter.

mod input;
mod line_fault;
mod master;
mod settings;

pub use input::{Input, Line, octets_for, samples_of};
pub use line_fault::LineFault;
pub use master::Master;
pub use settings::{
    Code, DEFAULT_CLOCK_HZ, DEFAULT_CYCLE, DEFAULT_MONOFLOP, LONGEST_CYCLE, MAX_CLOCK_HZ,
    MIN_CLOCK_HZ, Refusal, Settings, Word,
};
