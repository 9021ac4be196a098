//! Writing a capture in place.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

use thiserror::Error;

use crate::format::{Counts, Encoder};
use crate::{Bus, Format, FormatError, Record, Timestamp};

/// Why a capture cannot be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The format cannot hold it.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The system does not take it.
    #[error("the capture cannot be written: {0}")]
    Io(#[from] io::Error),
}

/// As much is gathered before it is given to the file.
const GATHERED: usize = 1 << 16;

/// Writes a capture in any of the four [formats](crate#formats).
///
/// Each call may wait for the disk; a running bus has a [`Recorder`](crate::Recorder). Whoever drops
/// it without [`finish`](Self::finish) loses what has been gathered.
#[derive(Debug)]
pub struct Writer<W> {
    out: W,
    encoder: Encoder,
    buses: Vec<Bus>,
    counts: Vec<Counts>,
    gathered: Vec<u8>,
    last: Timestamp,
}

impl Writer<File> {
    /// Makes the file anew, in the format that its suffix says. `begin` is the moment from which the
    /// formats count that count from one; what was before becomes that moment there.
    ///
    /// # Errors
    /// [`WriteError`]; a format that cannot hold what these buses carry leaves the old file alone.
    pub fn create(path: &Path, buses: Vec<Bus>, begin: Timestamp) -> Result<Self, WriteError> {
        let format = Format::of(path)?;
        format.check(&buses)?;
        Self::new(File::create(path)?, format, buses, begin)
    }
}

impl<W: Write> Writer<W> {
    /// Writes to `out` in `format`.
    ///
    /// # Errors
    /// [`WriteError::Format`].
    pub fn new(
        out: W,
        format: Format,
        buses: Vec<Bus>,
        begin: Timestamp,
    ) -> Result<Self, WriteError> {
        format.check(&buses)?;
        let encoder = Encoder::new(format, begin);
        let mut gathered = Vec::with_capacity(GATHERED + 1_024);
        encoder.head(&mut gathered, &buses);
        let counts = vec![Counts::default(); buses.len()];
        Ok(Self { out, encoder, buses, counts, gathered, last: begin })
    }

    /// The buses of the capture.
    #[must_use]
    pub fn buses(&self) -> &[Bus] {
        &self.buses
    }

    /// Writes one record. One of a bus that the capture has not is left out, and so is more than 255
    /// octets of a telegram.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn write(&mut self, record: &Record<'_>) -> Result<(), WriteError> {
        let Some(counts) = self.counts.get_mut(usize::from(record.bus)) else { return Ok(()) };
        counts.written += 1;
        self.last = self.last.max(record.at);
        self.encoder.record(&mut self.gathered, &self.buses, record);
        if self.gathered.len() >= GATHERED { self.flush() } else { Ok(()) }
    }

    /// Gives what has been gathered to the file.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn flush(&mut self) -> Result<(), WriteError> {
        let written = self.out.write_all(&self.gathered).and_then(|()| self.out.flush());
        self.gathered.clear();
        Ok(written?)
    }

    /// Counts `lost` records of a bus that never came here. Formats with statistics say so.
    pub(crate) fn lose(&mut self, bus: u16, lost: u64) {
        if let Some(counts) = self.counts.get_mut(usize::from(bus)) {
            counts.lost += lost;
        }
    }

    /// Writes the end of the file, and gives back what it was written to.
    ///
    /// # Errors
    /// [`WriteError::Io`].
    pub fn finish(mut self) -> Result<W, WriteError> {
        self.encoder.tail(&mut self.gathered, self.last, &self.counts);
        self.flush()?;
        Ok(self.out)
    }
}
