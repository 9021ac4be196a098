//! The ground floor of codewheel: time, byte cursors, CAN frames, RS-485 telegrams and the
//! [`Station`] trait.
//!
//! Everything above speaks through these few types: a protocol stack is a [`Station`], a wire or a
//! port moves its frames, a loop watches its deadlines. Nothing here reads a clock, allocates or
//! logs, so the same octets run in firmware, in the simulator, in the fuzzer and in the tests.
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

pub mod can;
mod cursor;
pub mod rs485;
mod time;

pub use cursor::{Full, Reader, Short, Writer};
pub use time::{Deadline, Duration, Instant, earlier};

/// A protocol endpoint without I/O: what arrives and the time go in, what leaves and deadlines
/// come out.
///
/// Whoever drives a station keeps three promises:
///
/// 1. `now` never goes back from call to call.
/// 2. After [`handle`](Station::handle) or [`advance`](Station::advance) it asks
///    [`transmit`](Station::transmit) until `None`, as soon as the medium can take an output.
/// 3. It calls [`advance`](Station::advance), then `transmit`, at the latest at
///    [`deadline`](Station::deadline), which it reads anew after every other call.
///
/// In return the station never blocks, never fails, never panics, and owes its answers as flags
/// rather than queueing them: an answer fetched late is built once, from today's values.
pub trait Station {
    /// What the medium brings. CAN: [`can::Input`]. RS-485: [`rs485::Input`].
    type Input<'a>;
    /// What the medium takes: a [`can::Frame`] or an [`rs485::Transmission`].
    type Output;

    /// Takes in what arrived at `now`. Nothing a peer can send makes this fail or panic.
    fn handle(&mut self, now: Instant, input: Self::Input<'_>);

    /// Runs whatever fell due up to `now`. Calling it early or twice does nothing.
    fn advance(&mut self, now: Instant);

    /// Builds the next output, as fresh as this call, or `None`. Call it when the medium can take
    /// one: the station counts what it hands out as on its way.
    fn transmit(&mut self, now: Instant) -> Option<Self::Output>;

    /// When [`advance`](Station::advance) and [`transmit`](Station::transmit) must be called at the
    /// latest; `None` while nothing but input can change anything.
    fn deadline(&self) -> Option<Instant>;
}
