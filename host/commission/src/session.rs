//! One encoder, asked and told by the same words whatever its bus.

use std::fmt;

use codewheel_device::Product;
use codewheel_device::product::Bus;
use codewheel_station::Instant;

use crate::Trouble;

/// Who a device says it is. What it did not say is `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// The vendor: DeviceNet identity attribute 1.
    pub vendor: Option<u16>,
    /// The device type: identity attribute 2.
    pub device_type: Option<u16>,
    /// The product code: identity attribute 3; on PROFIBUS the ident number.
    pub product_code: u16,
    /// Major and minor revision: identity attribute 4.
    pub revision: Option<(u8, u8)>,
    /// The serial number: identity attribute 6.
    pub serial: Option<u32>,
    /// The product name: identity attribute 7.
    pub product_name: Option<String>,
    /// The version of its firmware, as people write it: `1.01`.
    pub firmware: Option<String>,
    /// The products of the catalogue that it may be: several share a product code or an ident
    /// number. Empty for a device that is not ours.
    pub models: Vec<&'static Product>,
}

/// How a value is named on the command line.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Name {
    /// By the key of its row: `steps-per-turn`.
    Key(String),
    /// By class, instance and attribute, hexadecimal: `2f/1/7`. DeviceNet only.
    Path {
        /// The class.
        class: u8,
        /// The instance.
        instance: u8,
        /// The attribute.
        attribute: u8,
    },
    /// By the instance of the Parameter object: `parameter/3`. DeviceNet only.
    Parameter(u8),
    /// By the first octet of Slave_Diag, counted from 1: `octet/32`. PROFIBUS only.
    Octet(u8),
}

/// A number with a fraction, as precise as its place is. Two are equal that are written alike.
#[derive(Clone, Copy, Debug)]
pub enum Real {
    /// In four octets.
    Single(f32),
    /// In eight octets.
    Double(f64),
}

impl Real {
    /// Reads a number for the same place; `None` where it is none.
    #[must_use]
    pub fn parse(self, text: &str) -> Option<Self> {
        let number: f64 = text.parse().ok()?;
        let real = match self {
            Self::Single(_) => Self::Single(number as f32),
            Self::Double(_) => Self::Double(number),
        };
        real.number().is_finite().then_some(real)
    }

    /// The number that is written so: 0.1 in four octets is 0.1, not 0.100000001.
    #[must_use]
    pub fn number(self) -> f64 {
        match self {
            Self::Single(number) => number.to_string().parse().unwrap_or(number.into()),
            Self::Double(number) => number,
        }
    }
}

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Single(number) => number.fmt(f),
            Self::Double(number) => number.fmt(f),
        }
    }
}

impl PartialEq for Real {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl Eq for Real {}

/// What a value is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reading {
    /// A number.
    Number(i64),
    /// A number with a fraction.
    Real(Real),
    /// A text.
    Text(String),
    /// Octets, as they lie on the bus.
    Octets(Vec<u8>),
}

/// One value of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Value {
    /// The name on the command line: a key, or a path where there is none.
    pub name: String,
    /// Where it lies, as its manual says: `2Fh/1/7`, `octets 40–43 of Slave_Diag`.
    pub place: String,
    /// What the manual, or the device, calls it.
    pub title: String,
    /// What it is now.
    pub reading: Reading,
    /// The name of that value, where it has one: `CW`; of a scaled one what it means in its unit, with
    /// the number that is written: `23.7 (raw 237)`.
    pub label: Option<String>,
    /// The unit; empty where there is none.
    pub unit: String,
    /// Whether it can be written.
    pub writable: bool,
    /// Whether people choose it, and a passport carries it; else it is a reading.
    pub setting: bool,
    /// The smallest and largest value it takes, where that is known.
    pub range: Option<(i64, i64)>,
    /// What it is for, in a sentence; empty where nobody knows.
    pub help: String,
}

/// The position and what goes with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// When it came, in the time of the seat.
    pub at: Instant,
    /// The position in steps.
    pub position: u32,
    /// A position error, where the device tells it.
    pub alarm: Option<bool>,
    /// A warning: a low cell, where the device tells it.
    pub warning: Option<bool>,
    /// The cycle in which its master asks it, where there is one, in nanoseconds.
    pub cycle: Option<u64>,
}

/// An encoder on its bus, whom a master of ours serves.
///
/// All calls wait for the answer, and end. What a bus has no such thing for, as PROFIBUS knows no
/// Save, is refused with what to do instead. A [`Name`] that the device does not know is
/// [`Usage`](crate::Kind::Usage).
pub trait Session {
    /// The bus it is on.
    fn bus(&self) -> Bus;

    /// Its address.
    fn address(&self) -> u8;

    /// The seat's time now.
    fn now(&self) -> Instant;

    /// Who it is.
    ///
    /// # Errors
    /// [`Trouble`].
    fn identify(&mut self) -> Result<Identity, Trouble>;

    /// Everything it can tell, in the order of its manual. A device whose names nobody knows tells
    /// what its Parameter object says.
    ///
    /// # Errors
    /// [`Trouble`].
    fn values(&mut self) -> Result<Vec<Value>, Trouble>;

    /// One value.
    ///
    /// # Errors
    /// [`Trouble`].
    fn value(&mut self, name: &Name) -> Result<Value, Trouble>;

    /// Writes a value, which takes effect at once, and reads it back; not whether it came true: the
    /// caller compares. On PROFIBUS it is a parameter of Set_Prm and lasts as long as this session.
    ///
    /// # Errors
    /// [`Trouble`].
    fn write(&mut self, name: &Name, reading: &Reading) -> Result<Value, Trouble>;

    /// Makes `position`, in steps, the position of now, and gives the position read afterwards.
    ///
    /// # Errors
    /// [`Trouble`].
    fn preset(&mut self, position: u32) -> Result<Sample, Trouble>;

    /// Keeps the settings in force over a power-off.
    ///
    /// # Errors
    /// [`Trouble`].
    fn save(&mut self) -> Result<(), Trouble>;

    /// Brings back what was saved.
    ///
    /// # Errors
    /// [`Trouble`].
    fn restore(&mut self) -> Result<(), Trouble>;

    /// Brings back the defaults; the memory is not written.
    ///
    /// # Errors
    /// [`Trouble`].
    fn reset(&mut self) -> Result<(), Trouble>;

    /// The next position: waits for one that is newer than that of the call before.
    ///
    /// # Errors
    /// [`Trouble`].
    fn sample(&mut self) -> Result<Sample, Trouble>;

    /// Releases the device, so that its own master can have it. Dropping a session without it leaves
    /// the device to its watchdog.
    ///
    /// # Errors
    /// [`Trouble`].
    fn release(&mut self) -> Result<(), Trouble>;

    /// What happened on the port meanwhile, for people.
    fn take_notices(&mut self) -> Vec<String>;
}
