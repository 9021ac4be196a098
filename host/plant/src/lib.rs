//! Buses, devices, shafts, masters and faults together, running: snapshots come out.
//!
//! A [`Plant`] comes from a TOML file, [`Plant::load`], and [`Plant::start`] lets it run by the clock
//! on the wall, each bus in a thread of its own. A single bus is a [`VirtualBus`] on a simulated wire
//! in virtual time, or a [`PortBus`] on a real port; a [`MemoryFile`] is the non-volatile memory of a
//! device on either. What goes wrong, and when, stands in the file: [`Fault`]. What the buses carry
//! can be recorded meanwhile: [`Plant::start_recorded`], [`PortBus::record`].

mod check;
mod command;
mod complaint;
mod crew;
mod description;
mod device;
mod devicenet;
mod ears;
mod fault;
mod fault_kinds;
mod field_bus;
mod file;
mod keeper;
mod manned;
mod memory;
mod object;
mod plant;
mod port_bus;
mod print;
mod profibus;
mod recording;
mod repeats;
mod report;
mod running;
mod seats;
mod sensor;
mod snapshot;
mod time_span;
mod trace;
mod virtual_bus;
mod watcher;

pub use command::{Cause, Command, Done, Refusal, Switch, Ticket, Value};
pub use complaint::{Complaint, PlantError};
pub use description::{
    BusDescription, DeviceDescription, DipSwitch, FaultDescription, FaultParameter,
    MasterDescription, ParameterKind, RotarySwitch,
};
pub use devicenet::{DeviceNet, Exchange, MasterPlan, SlavePlan};
pub use fault::{Fault, Lever};
pub use field_bus::FieldBus;
pub use file::schema;
pub use memory::{Found, MemoryError, MemoryFile};
pub use object::{Object, ObjectGroup};
pub use plant::{AnyBusPlan, BusPlan, DevicePlan, Plant};
pub use port_bus::{PortBus, StartError};
pub use profibus::{Cable, DeviceOptions, DpMasterPlan, DpSlavePlan, PresetPlan, Profibus};
pub use recording::{RecordError, Recording};
pub use report::{Report, What};
pub use running::Running;
pub use sensor::SensorPlan;
pub use snapshot::{
    BusSnapshot, CycleTimes, DeviceSnapshot, DeviceState, Diagnosis, LampState, MasterSnapshot,
    Measured, Memory, ShaftState, SlaveSnapshot, SlaveState, SwitchPositions,
};
pub use time_span::{NoTimeSpan, TimeSpan};
pub use trace::{Trace, TraceLine, Traced};
pub use virtual_bus::VirtualBus;
pub use watcher::Watcher;
