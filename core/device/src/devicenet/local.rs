//! What can be done to a DeviceNet encoder without a network: the services of class 2Fh, as firmware
//! with buttons or a page beside the device wants them.
//!
//! They go the way of an explicit message through rows, memory and events. Whoever calls one asks
//! [`keep`](super::DeviceNetEncoder::keep) and [`transmit`](codewheel_station::Station::transmit)
//! afterwards, as after an input.

use core::fmt;

use codewheel_devicenet::explicit::{Error, Service};
use codewheel_devicenet::{Application, Identity};
use codewheel_encoder::{Block, Encoder, Refusal, Sensor};
use codewheel_station::Instant;

use super::DeviceNetEncoder;
use super::rows::{Range, Row, Value, View};

/// Why a local write is refused. It has changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NotWritten {
    /// The attribute can only be read.
    ReadOnly,
    /// The value does not fit the data type of the attribute.
    DataType(Range),
    /// The encoder refuses the value.
    Refused(Refusal),
}

impl fmt::Display for NotWritten {
    /// What is allowed, as a sentence without a full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadOnly => f.write_str("it can only be read"),
            Self::DataType(Range { minimum, maximum }) => {
                write!(f, "its data type takes {minimum} to {maximum}")
            }
            Self::Refused(refusal) => refusal.fmt(f),
        }
    }
}

impl core::error::Error for NotWritten {}

impl<S: Sensor> DeviceNetEncoder<S> {
    /// What it says it is: Identity attributes 1 to 4, 6 and 7.
    #[must_use]
    pub fn identity(&self) -> Identity {
        self.body.identity()
    }

    /// Identity attribute 5: bit 0, a master owns it; bit 2, configured; bit 8, minor recoverable
    /// fault, a damaged memory.
    #[must_use]
    pub fn identity_status(&self) -> u16 {
        self.server.identity_status(&self.body)
    }

    /// The value of `row` as of the newest sample.
    #[must_use]
    pub fn read(&self, row: &Row) -> Value {
        (row.read)(self.view())
    }

    /// The value of `row` that the next power-up, or a Restore, brings back; `None` for a block that
    /// the product cannot run with.
    #[must_use]
    pub fn read_saved(&self, row: &Row) -> Option<Value> {
        let saved = Encoder::power_up(self.product().encoder, self.saved(), None).ok()?;
        Some((row.read)(View { encoder: &saved, ..self.view() }))
    }

    /// The values that `row` takes now, where that is worth saying.
    #[must_use]
    pub fn range(&self, row: &Row) -> Option<Range> {
        row.range.map(|range| range(self.view()))
    }

    /// Writes `value` into `row` at `now`, as Set_Attribute_Single does.
    ///
    /// # Errors
    /// [`NotWritten`]; nothing is changed.
    pub fn write(&mut self, now: Instant, row: &Row, value: i64) -> Result<(), NotWritten> {
        let write = row.write.ok_or(NotWritten::ReadOnly)?;
        let range = row.data_type.range();
        if value < range.minimum || value > range.maximum {
            return Err(NotWritten::DataType(range));
        }
        self.body.write(now, row, write, value).map_err(NotWritten::Refused)
    }

    /// Saves the settings in force. They are in memory when [`is_saving`](Self::is_saving) ends and
    /// [`saved`](Self::saved) is what they were.
    ///
    /// # Errors
    /// 10 while the record of an earlier Save is on its way.
    pub fn save(&mut self, now: Instant) -> Result<(), Error> {
        self.body.memory_service(now, Service::SAVE).map(drop)
    }

    /// Whether a Save is on its way into memory.
    #[must_use]
    pub const fn is_saving(&self) -> bool {
        self.body.keeping.is_saving()
    }

    /// The settings that the next power-up brings back.
    #[must_use]
    pub const fn saved(&self) -> Block {
        self.body.keeping.saved
    }

    /// Brings the saved settings into force.
    ///
    /// # Errors
    /// 18 where the memory is damaged.
    pub fn restore(&mut self, now: Instant) -> Result<(), Error> {
        self.body.memory_service(now, Service::RESTORE).map(drop)
    }

    /// Brings the settings of a new device into force, unsaved.
    ///
    /// # Errors
    /// 18 where the product cannot run with them.
    pub fn reset(&mut self, now: Instant) -> Result<(), Error> {
        self.body.memory_service(now, Service::RESET).map(drop)
    }

    const fn view(&self) -> View<'_> {
        View { product: self.body.product(), encoder: self.body.encoder() }
    }
}
