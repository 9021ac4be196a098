//! A CAN segment in virtual time.
//!
//! A [`Wire`] carries the frames of its stations as a real segment does: at bus idle the lowest
//! identifier wins, a frame lasts exactly its bits with real stuffing, somebody has to acknowledge
//! it, and only stations whose acceptance filters match see it. On top of that it loses and
//! destroys frames and takes controllers off the bus on demand, names the station that breaks a
//! rule, and counts.

mod bits;
mod candump;
mod errors;
mod event;
mod faults;
pub mod rules;
mod script;
mod statistics;
mod takers;
mod wire;

pub use crate::{Drops, Either, Troubled};
pub use bits::frame_bits;
pub use candump::{FrameTextError, candump_line, parse_frame};
pub use event::Event;
pub use faults::Faults;
pub use rules::Rule;
pub use script::Script;
pub use statistics::Statistics;
pub use wire::{Node, NodeId, Wire};
