//! Real ports for CAN and RS-485 stations, and the loops that drive a station on them.
//!
//! A [`BusUri`] names a bus, [`open`] joins it and gives a [`CanPort`], and [`Loop::turn`] moves
//! frames and time between the port and a [`Station`](codewheel_station::Station). For RS-485 these
//! are [`open_rs485`], [`Rs485Port`] and [`Rs485Loop::turn`]:
//!
//! ```no_run
//! # use codewheel_link::{Clock, Loop, LinkError, open};
//! # use codewheel_station::{Instant, Station, can};
//! # fn run<S>(mut station: S) -> Result<(), LinkError>
//! # where S: for<'a> Station<Input<'a> = can::Input<'a>, Output = can::Frame> {
//! # let uri = "slcan-listen:127.0.0.1:4001".parse().expect("a bus URI");
//! let mut port = open(&uri, can::BitRate::Kbit125)?;
//! let mut drive = Loop::new(Clock::new());
//! loop {
//!     let outcome = drive.turn(&mut station, port.as_mut(), None)?;
//!     for notice in &outcome.notices {
//!         eprintln!("{notice}");
//!     }
//!     if outcome.woken {
//!         return Ok(());
//!     }
//! }
//! # }
//! ```
//!
//! Nothing a peer sends makes a port fail, panic, grow without bound or serve another peer late.
//! Nothing here prints: what people should hear comes out as a [`Notice`].

mod clients;
mod error;
mod interface;
mod lasting;
mod notice;
mod output;
mod port;
#[cfg(unix)]
mod pty;
pub mod rs485;
mod segment;
#[cfg(unix)]
mod serial;
pub mod slcan;
mod socket;
#[cfg(target_os = "linux")]
mod socketcan;
pub mod socketcand;
mod tap;
mod turn;
mod uri;
mod virtual_bus;

pub use error::LinkError;
pub use interface::InterfaceTrouble;
pub use notice::{ControllerState, Notice};
pub use port::{CanPort, Received, Waker, open};
pub use rs485::{Rs485Loop, Rs485Port, Rs485Received, open_rs485};
pub use tap::{Rs485Tap, Tap};
pub use turn::{Clock, Loop, Outcome, STAND_IN};
pub use uri::{BusUri, Endpoint, InvalidBusUri, Medium};
