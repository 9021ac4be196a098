//! The laboratory in virtual time: a CAN wire and an RS-485 line with faults, shafts, torn memory.
//!
//! Time is a number that whoever runs the laboratory moves forward; nothing here reads a clock,
//! starts a thread or opens a socket, and every fault is drawn from a seed. So a week on the bus
//! passes in minutes, and what went wrong once goes wrong again in the same way.
//!
//! - [`can::Wire`] joins stations to a CAN segment and steps from event to event.
//! - [`rs485::Wire`] joins them to an RS-485 line, where they speak by the rules of PROFIBUS.
//! - [`Troubled`] drops what a station says, or lets it come late.
//! - [`shaft::Shaft`] turns a line of text into raw codes for an encoder.
//! - [`ssi::VirtualEncoder`] answers the clock edges of an SSI line, and can fail at it.
//! - [`memory::TornMemory`] forgets the rest of a write when the power fails.
//!
//! # Panics
//! Nothing a station sends and nothing a user writes makes this crate panic; a panic is a bug.

pub mod can;
mod chance;
mod either;
pub mod memory;
pub mod rs485;
mod schedule;
pub mod shaft;
pub mod ssi;
mod troubled;

pub use either::Either;
pub use troubled::{Carried, Drops, Troubled};
