//! Buses, devices, shafts, masters and faults together, running: snapshots come out.
//!
//! A [`Plant`] comes from a TOML file, [`Plant::load`], and [`Plant::start`] lets it run by the clock
//! on the wall, each bus in a thread of its own. A single bus is a [`VirtualBus`] on a simulated wire
//! in virtual time, or a [`PortBus`] on a real port; a [`MemoryFile`] is the non-volatile memory of a
//! device on either. What goes wrong, and when, stands in the file: [`Fault`].

mod check;
mod complaint;
mod composite;
mod crew;
mod device;
mod fault;
mod file;
mod keeper;
mod memory;
mod plant;
mod port_bus;
mod print;
mod report;
mod running;
mod time_span;
mod virtual_bus;

pub use complaint::{Complaint, PlantError};
pub use crew::{BusSnapshot, DeviceSnapshot, MasterSnapshot, SlaveSnapshot};
pub use fault::{Fault, Lever};
pub use file::schema;
pub use memory::{Found, MemoryError, MemoryFile};
pub use plant::{BusPlan, DevicePlan, Exchange, MasterPlan, Plant, SlavePlan};
pub use port_bus::{PortBus, StartError};
pub use report::{Report, What};
pub use running::Running;
pub use time_span::{NoTimeSpan, TimeSpan};
pub use virtual_bus::VirtualBus;
