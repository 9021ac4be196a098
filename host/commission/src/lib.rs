//! Masters, and what people do with them.
//!
//! [`profibus::Master`] is a PROFIBUS-DP master of class 1: the protocol of
//! [profirust](https://docs.rs/profirust), driven as a
//! [`Station`](codewheel_station::Station) like every other endpoint of the house.
//!
//! [`devicenet`] commissions encoders on DeviceNet.
//!
//! A [`Session`] is one encoder, asked and told by the same words on both buses; a [`Survey`] is who
//! is on a bus. Whatever cannot be done is a [`Trouble`]: what was tried, what came back, what to do.
//! A [`Passport`](passport::Passport) is all that a replacement needs to give the same positions.
//! A [`Seat`] drives the station behind them, on a real port or on a wire in virtual time.
//!
//! # Panics
//! Nothing a peer can send makes this crate panic. A panic is a bug.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

pub mod devicenet;
pub mod passport;
pub mod profibus;
mod seat;
mod session;
mod survey;
mod trouble;

pub use seat::{CanSeat, Rs485Seat, Seat};
pub use session::{Identity, Name, Reading, Real, Sample, Session, Value};
pub use survey::{Found, Owner, Progress, Role, Survey};
pub use trouble::{Kind, Trouble};
