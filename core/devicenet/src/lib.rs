//! DeviceNet for any device: a Group 2 Only [`Server`] with the predefined master/slave connection
//! set, and the [`Scanner`] that speaks to such servers.
//!
//! Authority: IEC 62026-3 and the CIP books by what is publicly known of them, ODVA's conformance
//! test PUB00166, and for what the AMG manual decides, the manual. This crate knows no encoder: a
//! device is an [`Application`], lent to the server for one call at a time.
//!
//! # Panics
//! Nothing a peer can send makes this crate panic. A panic is a bug.
#![no_std]
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

#[cfg(test)]
extern crate std;

mod application;
pub mod connection;
mod duplicate;
mod event;
pub mod explicit;
pub mod fragment;
pub mod identifier;
mod mac_id;
pub mod scanner;
mod server;

pub use application::{
    Application, Class, Done, Identity, NetworkSettings, Request, Reset, SwitchPositions,
};
pub use connection::ProducedPath;
pub use duplicate::{CheckMessage, DuplicateMacCheck, Fault};
pub use event::Event;
pub use identifier::Identifier;
pub use mac_id::MacId;
pub use scanner::Scanner;
pub use server::{NetworkStatus, Server, choice};
