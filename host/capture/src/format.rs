//! The formats of files, by their suffix.

pub(crate) mod asc;
pub(crate) mod log;
pub(crate) mod pcapng;
pub(crate) mod trc;

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::{Bus, Medium, Record, Timestamp};

/// The format of a capture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// `.log`: one line as `candump -L` writes it, or a telegram in the same way.
    Log,
    /// `.asc` of Vector.
    Asc,
    /// `.trc` of PEAK.
    Trc,
    /// `.pcapng` of Wireshark.
    Pcapng,
}

/// Why a file cannot be in the format that its suffix says.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FormatError {
    /// The suffix is none of the four.
    #[error("{} has no suffix of a capture: write .log, .asc, .trc or .pcapng", .0.display())]
    Suffix(PathBuf),
    /// The format carries CAN frames alone.
    #[error("a {format} file carries CAN frames, and {bus} is PROFIBUS: record to .pcapng or .log")]
    Medium {
        /// The format.
        format: Format,
        /// The name of the bus.
        bus: String,
    },
    /// More buses than a capture has numbers for.
    #[error("{0} buses; a capture has at most {MOST_BUSES}")]
    TooManyBuses(usize),
}

/// The most buses of a capture.
pub(crate) const MOST_BUSES: usize = 256;

impl Format {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Log, Self::Asc, Self::Trc, Self::Pcapng];

    /// The format that the suffix of `path` says, in small or capital letters.
    ///
    /// # Errors
    /// [`FormatError::Suffix`].
    pub fn of(path: &Path) -> Result<Self, FormatError> {
        let suffix = path.extension().and_then(|suffix| suffix.to_str()).unwrap_or_default();
        Self::ALL
            .into_iter()
            .find(|format| suffix.eq_ignore_ascii_case(format.suffix()))
            .ok_or_else(|| FormatError::Suffix(path.to_owned()))
    }

    /// The suffix, without its dot.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::Log => "log",
            Self::Asc => "asc",
            Self::Trc => "trc",
            Self::Pcapng => "pcapng",
        }
    }

    /// Whether it carries what `medium` carries.
    #[must_use]
    pub const fn carries(self, medium: Medium) -> bool {
        match medium {
            Medium::DeviceNet => true,
            Medium::Profibus => matches!(self, Self::Log | Self::Pcapng),
        }
    }

    /// Whether it can hold what these buses carry.
    ///
    /// # Errors
    /// [`FormatError::Medium`], [`FormatError::TooManyBuses`].
    pub fn check(self, buses: &[Bus]) -> Result<(), FormatError> {
        if buses.len() > MOST_BUSES {
            return Err(FormatError::TooManyBuses(buses.len()));
        }
        match buses.iter().find(|bus| !self.carries(bus.medium)) {
            Some(bus) => Err(FormatError::Medium { format: self, bus: bus.name.clone() }),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Format {
    /// The suffix with its dot.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, ".{}", self.suffix())
    }
}

/// Turns records into the octets of a file.
#[derive(Debug)]
pub(crate) enum Encoder {
    Log,
    Asc { begin: Timestamp },
    Trc { begin: Timestamp, number: u64 },
    Pcapng,
}

impl Encoder {
    pub(crate) const fn new(format: Format, begin: Timestamp) -> Self {
        match format {
            Format::Log => Self::Log,
            Format::Asc => Self::Asc { begin: asc::begin_of(begin) },
            Format::Trc => Self::Trc { begin, number: 0 },
            Format::Pcapng => Self::Pcapng,
        }
    }

    /// What stands before the first record.
    pub(crate) fn head(&self, out: &mut Vec<u8>, buses: &[Bus]) {
        match self {
            Self::Log => {}
            Self::Asc { begin } => asc::head(out, *begin),
            Self::Trc { begin, .. } => trc::head(out, *begin, buses),
            Self::Pcapng => pcapng::head(out, buses),
        }
    }

    /// One record. A telegram in a format without telegrams is left out; [`Format::check`] has
    /// refused its bus.
    pub(crate) fn record(&mut self, out: &mut Vec<u8>, buses: &[Bus], record: &Record<'_>) {
        match self {
            Self::Log => log::record(out, buses, record),
            Self::Asc { begin } => asc::record(out, *begin, record),
            Self::Trc { begin, number } => trc::record(out, *begin, number, record),
            Self::Pcapng => pcapng::record(out, record),
        }
    }

    /// What stands behind the last record. `lost` counts records of each bus that did not get here.
    pub(crate) fn tail(&self, out: &mut Vec<u8>, at: Timestamp, counts: &[Counts]) {
        match self {
            Self::Log | Self::Trc { .. } => {}
            Self::Asc { .. } => asc::tail(out),
            Self::Pcapng => pcapng::tail(out, at, counts),
        }
    }
}

/// What has been counted of a bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) written: u64,
    pub(crate) lost: u64,
}
