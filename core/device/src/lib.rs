//! The encoder products: catalogue, attribute rows, lamp, switches, non-volatile memory — the
//! encoder dressed for its bus.
//!
//! [`DeviceNetEncoder`] and [`ProfibusEncoder`] are complete devices: hand them frames or octets and
//! time, a [`Sensor`], and a place for their records.
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
mod instrument;
mod keeping;
mod lamp;
pub mod product;
pub mod profibus;
mod snapshot;
mod switches;

pub use devicenet::{DeviceNetEncoder, Factory};
pub use event::Event;
pub use keeping::MemoryState;
pub use lamp::{Colour, Lamp};
pub use product::Product;
pub use profibus::ProfibusEncoder;
pub use snapshot::{DeviceNetState, Network, ProfibusState, Snapshot};
pub use switches::Switches;
