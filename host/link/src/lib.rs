//! Real ports for a CAN station, and the one loop that drives a station on them.
//!
//! A [`BusUri`] names a bus, [`open`] joins it and gives a [`CanPort`], and [`Loop::turn`] moves
//! frames and time between the port and a [`Station`](codewheel_station::Station):
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

mod error;
mod notice;
mod port;
pub mod slcan;
mod turn;
mod uri;
mod virtual_bus;

pub use error::LinkError;
pub use notice::Notice;
pub use port::{CanPort, Received, Waker, open};
pub use turn::{Clock, Loop, Outcome, STAND_IN};
pub use uri::{BusUri, Endpoint, InvalidBusUri};
