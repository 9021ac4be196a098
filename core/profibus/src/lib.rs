//! The PROFIBUS book: telegrams, receiver, responder and a DP-V0 slave, for any device.
//!
//! [`Slave`] is the whole stack of a passive station. It does no I/O and knows no device: octets
//! and time go in, telegrams and deadlines come out, and the device is lent to it for each call as
//! an [`Application`].
//!
//! # Panics
//! Nothing a peer can send makes this crate panic. A panic is a bug.
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

#[cfg(test)]
extern crate std;

mod answer;
mod application;
mod baud_search;
mod event;
pub mod function_code;
mod machine;
mod parameters;
mod process_data;
mod receiver;
mod responder;
pub mod sap;
mod slave;
pub mod telegram;
mod watchdog;

pub use application::{Application, Lengths, Refused};
pub use event::{Event, Loss, ParameterFault};
pub use slave::{Baud, Counters, Faults, Settings, Slave, State, Timing};
