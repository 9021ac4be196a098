//! Seeing what goes over a port without taking part.

use std::fmt;

use codewheel_station::Instant;
use codewheel_station::can::Frame;

/// Sees each frame that a [`Loop`](crate::Loop) moves over its port.
///
/// Called in the thread of the bus, between a station and its answer: what takes long belongs
/// elsewhere.
pub trait Tap: fmt::Debug + Send {
    /// A frame of another node has come. The station has seen it already.
    fn received(&mut self, at: Instant, frame: &Frame);

    /// A frame of ours has gone out: when the port reports it, or, on a port that
    /// [reports none](crate::CanPort::confirms), when it is handed over.
    fn sent(&mut self, at: Instant, frame: &Frame);
}

/// Sees all octets that an [`Rs485Loop`](crate::Rs485Loop) moves over its port.
///
/// Called in the thread of the line, between a station and its answer: what takes long belongs
/// elsewhere.
pub trait Rs485Tap: fmt::Debug + Send {
    /// Octets have come, the last of them at `at`, in portions of any size. The station has seen
    /// them already.
    fn received(&mut self, at: Instant, octets: &[u8]);

    /// A character with a parity, framing or overrun error has come, or a break.
    fn broken_character(&mut self, at: Instant);

    /// A telegram of ours has been handed over.
    fn sent(&mut self, at: Instant, octets: &[u8]);
}
