//! Buses, devices, shafts and masters together, running: snapshots come out.
//!
//! Two ways to run an encoder: [`Player`] plays one on a real port, [`VirtualDeviceNet`] keeps a
//! whole segment of them on a simulated wire, paced by the clock on the wall. [`MemoryFile`] is the
//! non-volatile memory of either.

mod demo;
mod memory;
mod player;
mod virtual_devicenet;

pub use demo::demo;
pub use memory::{Found, MemoryError, MemoryFile};
pub use player::{PlayError, Player, PlayerSettings, Report};
pub use virtual_devicenet::{
    EncoderSettings, EncoderSnapshot, Running, SegmentSettings, SegmentSnapshot, VirtualDeviceNet,
};
