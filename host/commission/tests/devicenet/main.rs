//! Commissioning on a DeviceNet segment in virtual time: real encoders, other people's masters, and
//! all that can go wrong.

mod interruptions;
mod liar;
mod listening;
mod other_devices;
mod other_masters;
mod scanning;
mod settings;
mod toy;
mod troubles;
mod watching;
mod wire_seat;
