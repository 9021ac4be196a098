//! A virtual SSI encoder, and the line to it in virtual time.
//!
//! [`VirtualEncoder`] knows nothing of words that are read but only of clock edges and their times,
//! as an encoder at the end of a cable does. Its word, code and monoflop are its own, so a master
//! set otherwise reads what it would read of a real one. [`VirtualLine`] plays a master's clock to
//! it.
//!
//! The edges are ideal: the data line changes with the rising edge, without the delay of cable and
//! drivers.

mod encoder;
mod line;

pub use encoder::{Behaviour, Fault, VirtualEncoder};
pub use line::VirtualLine;
