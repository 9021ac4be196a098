//! Whole segments in virtual time: how long a cycle takes, who comes back after trouble, and whose
//! address it is.

mod bus_off;
mod cycle_times;
mod duplicate_macs;
mod lost_frames_and_power;
mod segment;
