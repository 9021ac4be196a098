//! SLCAN: CAN frames as ASCII lines, the language of LAWICEL's adapters and their many relatives.
//!
//! The lines ([`Line`]), the reader of a client's commands ([`CommandDecoder`]), the reader of an
//! adapter's answers ([`AnswerDecoder`]) and the adapter's side of one client ([`Channel`]) do no
//! I/O: octets go in, in pieces of any size, and lines and frames come out.
//!
//! Source: LAWICEL CAN232 manual, version 3, §2 (commands) and §1.2 (an empty line is answered
//! with an empty line). Where adapters differ we follow that manual.

mod answer;
mod channel;
mod client;
mod command;
mod line;
#[cfg(unix)]
mod pty;
#[cfg(unix)]
mod serial;

pub use answer::{Answer, AnswerDecoder};
pub use channel::{Channel, Effect};
pub use command::{Command, CommandDecoder, Malformed};
pub use line::Line;

pub(crate) use client::connect;
#[cfg(unix)]
pub(crate) use pty::listen as listen_pty;
#[cfg(unix)]
pub(crate) use serial::open as open_serial;
