//! Masters, and what people do with them.
//!
//! [`profibus::Master`] is a PROFIBUS-DP master of class 1: the protocol of
//! [profirust](https://docs.rs/profirust), driven as a
//! [`Station`](codewheel_station::Station) like every other endpoint of the house.
//!
//! # Panics
//! Nothing a peer can send makes this crate panic. A panic is a bug.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

pub mod profibus;
