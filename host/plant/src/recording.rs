//! What buses carry, on its way into a capture.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use codewheel_capture::{
    Bus, BusRecorder, Condition, Direction, Format, Framer, Recorded, Recorder, WriteError,
};
use codewheel_link::{Rs485Tap, Tap};
use codewheel_station::Instant;
use codewheel_station::can::Frame;
use codewheel_station::rs485::BaudRate;
use thiserror::Error;

use crate::ears::Ears;

/// Why buses cannot be recorded.
#[derive(Debug, Error)]
#[error("cannot record to {}: {reason}", .path.display())]
pub struct RecordError {
    /// The file.
    pub path: PathBuf,
    /// What is in the way.
    pub reason: WriteError,
}

/// Buses that are recorded into one file while they run.
///
/// The file is written by a thread of its own. When the disk is too slow, records are lost and
/// counted; no bus waits.
#[derive(Debug)]
pub struct Recording(Recorder);

impl Recording {
    /// Whether a file with the suffix of `path` can hold what `buses` carry. Touches nothing.
    ///
    /// # Errors
    /// [`RecordError`] with [`WriteError::Format`].
    pub fn check(path: &Path, buses: &[Bus]) -> Result<(), RecordError> {
        let checked = Format::of(path).and_then(|format| format.check(buses));
        checked.map_err(|reason| RecordError { path: path.to_owned(), reason: reason.into() })
    }

    /// Makes the file anew, for these buses.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn create(path: &Path, buses: Vec<Bus>) -> Result<Self, RecordError> {
        let created = Recorder::create(path, buses);
        created.map(Self).map_err(|reason| RecordError { path: path.to_owned(), reason })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// What has been recorded so far.
    #[must_use]
    pub fn recorded(&self) -> Recorded {
        self.0.recorded()
    }

    /// Writes the rest, and ends. The buses have ended before, or what they carry from now on is
    /// not recorded.
    ///
    /// # Errors
    /// [`RecordError`] where the file did not take everything.
    pub fn finish(self) -> Result<Recorded, RecordError> {
        let path = self.path().to_owned();
        self.0.finish().map_err(|reason| RecordError { path, reason })
    }

    /// The handle for the bus at `place`, on whose clock it is `now`.
    pub(crate) fn bus(&self, place: usize, now: Instant) -> BusRecorder {
        // A capture has at most 256 buses, so every place that it knows is a u16.
        let place = u16::try_from(place).unwrap_or(u16::MAX);
        self.0.bus(place, codewheel_capture::Timestamp::origin_of(now))
    }
}

/// Hears the frames of a CAN port.
#[derive(Debug)]
pub(crate) struct Frames(pub(crate) Arc<Ears>);

impl Tap for Frames {
    fn received(&mut self, at: Instant, frame: &Frame) {
        self.0.frame(at, frame, Direction::Received);
    }

    fn sent(&mut self, at: Instant, frame: &Frame) {
        self.0.frame(at, frame, Direction::Sent);
    }
}

/// Hears the telegrams of an RS-485 port. Dropping it tells what came and has no end yet.
#[derive(Debug)]
pub(crate) struct Telegrams {
    ears: Arc<Ears>,
    framer: Framer,
}

impl Telegrams {
    pub(crate) fn new(ears: Arc<Ears>, rate: BaudRate) -> Self {
        Self { ears, framer: Framer::new(rate) }
    }
}

/// What a framer gives its telegrams to.
fn received(ears: &Ears) -> impl FnMut(Instant, &[u8], Condition) {
    |at, octets, condition| ears.telegram(at, octets, condition, Direction::Received)
}

impl Rs485Tap for Telegrams {
    fn received(&mut self, at: Instant, octets: &[u8]) {
        self.framer.push(at, octets, &mut received(&self.ears));
    }

    fn broken_character(&mut self, at: Instant) {
        self.framer.broken(at, &mut received(&self.ears));
    }

    fn sent(&mut self, at: Instant, octets: &[u8]) {
        self.ears.telegram(at, octets, Condition::Intact, Direction::Sent);
    }
}

impl Drop for Telegrams {
    fn drop(&mut self) {
        self.framer.end(&mut received(&self.ears));
    }
}
