//! An RS-485 line in virtual time, as PROFIBUS uses it.
//!
//! A [`Wire`] carries the telegrams of its stations character by character, each station at the
//! rate it has at that moment, and each character at its moment to the bit. Nobody arbitrates:
//! where two speak at once both are destroyed. On top of that it breaks, bends, stretches and
//! loses what is said on demand, names the station that breaks a rule of PROFIBUS, and counts.

mod attachment;
mod cable;
mod event;
mod faults;
mod police;
mod script;
mod speaking;
mod statistics;
mod telegram;
mod text;
mod wire;

pub use attachment::{Attachment, Hearing};
pub use cable::longest_cable;
pub use codewheel_station::rs485::Node;
pub use event::Event;
pub use faults::Faults;
pub use script::{Heard, Script};
pub use statistics::Statistics;
pub use text::{TelegramTextError, parse_telegram};
pub use wire::{NodeId, Wire};
