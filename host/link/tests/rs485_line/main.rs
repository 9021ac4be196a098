//! An RS-485 line on real ports: who hears what, and when a station speaks.
#![allow(clippy::unwrap_used)]

mod anything_at_all;
mod bench;
mod deaf_and_flooding_clients;
mod opening;
#[cfg(unix)]
mod pty;
#[cfg(unix)]
mod serial_port;
mod shared_by_clients;
mod when_a_station_speaks;
