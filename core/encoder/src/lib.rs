//! An absolute rotary encoder as such: from the raw code of the disc to the position.
//!
//! Geometry, settings, range and preset, position error, velocity and the record that survives a
//! power cut. It knows no bus: who asks for the position is the business of the floors above.
//!
//! The way of a value: a [`Sensor`] yields a [`Sample`], [`Encoder::sample`] follows the shaft
//! with it, [`Encoder::position`] says where it stands. A converter has an SSI line for a sensor, see
//! [`ssi`]. The way of a setting: a write builds a new
//! [`Settings`], [`Encoder::apply`] takes it whole or refuses it with a [`Refusal`]. The way over a
//! power cut: [`encode`] turns a [`Kept`] into octets, [`choose`] finds the newer whole record of
//! two slots.
//!
//! # Panics
//! Nothing in this crate panics on any input.
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

#[cfg(test)]
extern crate std;

mod alarm;
mod block;
mod encoder;
mod geometry;
mod record;
mod refusal;
mod sensor;
mod settings;
mod slots;
pub mod ssi;
mod transform;
mod velocity;

pub use alarm::{ALARM_TIME, DEFAULT_SPEED_LIMIT, JUDGED_WITHIN};
pub use block::{Block, Reference};
pub use encoder::Encoder;
pub use geometry::{Geometry, Model};
pub use record::{Damage, Kept, RECORD_OCTETS, decode, encode};
pub use refusal::Refusal;
pub use sensor::{Reading, Sample, Sensor};
pub use settings::{Direction, Settings};
pub use slots::{Slot, Start, choose};
