//! RS-485 lines: octets in the order in which they come, telegrams out.
//!
//! [`open_rs485`] joins the line that a [`BusUri`](crate::BusUri) names and gives an [`Rs485Port`];
//! [`Rs485Loop::turn`] moves octets, telegrams and time between it and a
//! [`Node`](codewheel_station::rs485::Node).
//!
//! ```no_run
//! # use codewheel_link::{Clock, LinkError, Rs485Loop, open_rs485};
//! # use codewheel_station::rs485::{BaudRate, Node};
//! # fn run<N: Node>(mut slave: N) -> Result<(), LinkError> {
//! # let uri = "rs485-listen:127.0.0.1:4002".parse().expect("a bus URI");
//! let mut port = open_rs485(&uri, BaudRate::Mbit12)?;
//! let mut drive = Rs485Loop::new(Clock::new());
//! while !drive.turn(&mut slave, port.as_mut(), None)?.woken {}
//! # Ok(())
//! # }
//! ```
//!
//! Over TCP a line is raw octets both ways, without a frame or a word of setting up: what a serial
//! server in raw mode speaks, and `socat` or `nc` too.

mod listen;
mod port;
#[cfg(unix)]
mod pty;
mod stream;
mod tcp;
#[cfg(unix)]
mod terminal;
mod turn;

pub use port::{Rs485Port, Rs485Received, open_rs485};
pub use turn::Rs485Loop;

/// Octets read at once: a telegram and more, few enough that a flood delays the others by
/// microseconds.
const PIECE: usize = 512;
