//! The encoder products: catalogue, attribute rows, lamp, switches, non-volatile memory — the
//! encoder dressed for its bus.
//!
//! [`DeviceNetEncoder`] is a complete device: hand it frames and time, a [`Sensor`], and a place
//! for its records.
//!
//! # Panics
//! Nothing a peer can send makes this crate panic. A panic is a bug.
//!
//! [`Sensor`]: codewheel_encoder::Sensor
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

#[cfg(test)]
extern crate std;

pub mod devicenet;
mod event;
mod keeping;
mod lamp;
pub mod product;
mod snapshot;
mod switches;

pub use devicenet::{DeviceNetEncoder, Factory};
pub use event::Event;
pub use keeping::MemoryState;
pub use lamp::{Colour, Lamp};
pub use product::Product;
pub use snapshot::Snapshot;
pub use switches::Switches;
