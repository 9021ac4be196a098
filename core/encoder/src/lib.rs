//! An absolute rotary encoder as such: from the raw code of the disc to the position.
//!
//! Geometry, settings, range and preset, position error, velocity and the record that survives a
//! power cut. It knows no bus: who asks for the position is the business of the floors above.
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

#[cfg(test)]
extern crate std;

mod sensor;

pub use sensor::{Sample, Sensor};
