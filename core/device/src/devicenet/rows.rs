//! The attributes of class 2Fh, the Encoder Position object: one row each (AMG manual §8).
//!
//! From these rows grow Get and Set, `codewheel describe`, and all that shows or documents an
//! attribute. Adding an attribute is adding a row.

use codewheel_devicenet::explicit::{Error, GeneralStatus};
use codewheel_encoder::{Direction, Encoder, Refusal};
use codewheel_station::{Full, Writer};

use crate::product::Product;

/// The class code of the Encoder Position object.
pub const ENCODER_POSITION: u8 = 0x2F;
/// The attribute whose write executes the preset function.
pub(super) const PRESET: u8 = 10;

/// The elementary data type of an attribute (CIP volume 1, appendix C).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DataType {
    /// One octet, 0 or 1.
    Bool,
    /// Unsigned, one octet.
    Usint,
    /// Unsigned, two octets.
    Uint,
    /// Unsigned, four octets.
    Udint,
    /// Signed, four octets.
    Dint,
    /// Several unsigned octets.
    UsintArray,
}

impl DataType {
    /// The name the manual prints.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Usint => "USINT",
            Self::Uint => "UINT",
            Self::Udint => "UDINT",
            Self::Dint => "DINT",
            Self::UsintArray => "ARRAY OF USINT",
        }
    }

    /// How many octets a value has; 0 for the array, whose length varies.
    #[must_use]
    pub const fn octets(self) -> usize {
        match self {
            Self::Bool | Self::Usint => 1,
            Self::Uint => 2,
            Self::Udint | Self::Dint => 4,
            Self::UsintArray => 0,
        }
    }

    /// The numbers that it can be; of an array each of its octets.
    #[must_use]
    pub const fn range(self) -> Range {
        let (minimum, maximum) = match self {
            Self::Bool => (0, 1),
            Self::Usint | Self::UsintArray => (0, u8::MAX as i64),
            Self::Uint => (0, u16::MAX as i64),
            Self::Udint => (0, u32::MAX as i64),
            Self::Dint => (i32::MIN as i64, i32::MAX as i64),
        };
        Range { minimum, maximum }
    }
}

/// The value of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// A number of the row's type.
    Number(i64),
    /// Octets.
    Octets(&'static [u8]),
}

/// Whether an attribute is a parameter, which people choose, or a reading, which they watch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// Set by people and kept.
    Parameter,
    /// Told by the device.
    Reading,
}

/// What a row reads from.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The product.
    pub product: &'a Product,
    /// The encoder, sampled just now.
    pub encoder: &'a Encoder,
}

/// The smallest and the largest value a parameter takes now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Range {
    /// The smallest.
    pub minimum: i64,
    /// The largest.
    pub maximum: i64,
}

/// Writes a parameter; whether it really changed.
pub type Write = fn(&mut Encoder, i64) -> Result<bool, Refusal>;

/// One attribute of class 2Fh instance 1.
#[derive(Debug)]
pub struct Row {
    /// Attribute number.
    pub attribute: u8,
    /// The manual's name.
    pub name: &'static str,
    /// The name on the command line.
    pub key: &'static str,
    /// The data type.
    pub data_type: DataType,
    /// Parameter or reading.
    pub source: Source,
    /// The unit; empty where there is none.
    pub unit: &'static str,
    /// The name the Parameter object gives, at most 16 printable characters: the manual's longer
    /// names get short forms here, once.
    pub short_name: &'static str,
    /// One sentence that helps, at most 64 printable characters: the Parameter object carries it.
    pub help: &'static str,
    /// What else is worth knowing; empty where nothing is.
    pub note: &'static str,
    /// Whether a reading changes while the device runs.
    pub changes: bool,
    /// The names of the values 0, 1, … where they are enumerated.
    pub values: &'static [&'static str],
    /// Reads the attribute.
    pub read: fn(View<'_>) -> Value,
    /// Writes the attribute, where it can be written.
    pub write: Option<Write>,
    /// The values it takes now, where that is worth saying.
    pub range: Option<fn(View<'_>) -> Range>,
}

/// Alarms: bit 0, position error.
const POSITION_ERROR: i64 = 1;
/// Warnings: bit 4, voltage of the lithium cell.
const CELL_VOLTAGE: i64 = 1 << 4;
/// Attribute 80 bit 1, diagnosis supported (decision: attributes 80 to 95 exist); bit 2, scaling.
const DIAGNOSIS_SUPPORTED: i64 = 1 << 1;
const SCALING_ON: i64 = 1 << 2;
/// Attribute 89: profile 0110h in the low word, software 0101h in the high word, BCD (decision).
const PROFILE_AND_SOFTWARE: i64 = 0x0101_0110;

/// Attribute 2: all attributes there are.
static ATTRIBUTES: [u8; 24] =
    [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 80, 81, 82, 83, 84, 85, 86, 87, 88, 89, 91, 95];

fn total(view: View<'_>) -> i64 {
    i64::from(view.encoder.settings().total_resolution)
}

fn steps(view: View<'_>) -> i64 {
    i64::from(view.encoder.settings().steps_per_turn)
}

fn resolution(view: View<'_>) -> i64 {
    i64::from(view.product.encoder.geometry.singleturn_resolution())
}

fn is_ccw(view: View<'_>) -> i64 {
    i64::from(view.encoder.settings().direction == Direction::Ccw)
}

/// A value as the encoder takes it; what does not fit 32 bits is beyond every limit.
fn unsigned(value: i64) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

/// All attributes of class 2Fh, by their numbers.
pub static ROWS: [Row; 24] = [
    Row {
        attribute: 1,
        name: "No. of attributes",
        key: "number-of-attributes",
        data_type: DataType::Usint,
        source: Source::Reading,
        unit: "",
        short_name: "No. attributes",
        help: "Number of supported attributes",
        note: "",
        changes: false,
        values: &[],
        read: |_| Value::Number(ATTRIBUTES.len() as i64),
        write: None,
        range: None,
    },
    Row {
        attribute: 2,
        name: "Attributes",
        key: "attributes",
        data_type: DataType::UsintArray,
        source: Source::Reading,
        unit: "",
        short_name: "Attributes",
        help: "List of supported attributes",
        note: "",
        changes: false,
        values: &[],
        read: |_| Value::Octets(&ATTRIBUTES),
        write: None,
        range: None,
    },
    Row {
        attribute: 3,
        name: "Sense of rotation",
        key: "direction",
        data_type: DataType::Bool,
        source: Source::Parameter,
        unit: "",
        short_name: "Rotation sense",
        help: "Position grows CW or CCW, seen looking at the flange",
        note: "A change clears preset and offset.",
        changes: true,
        values: &["CW", "CCW"],
        read: |view| Value::Number(is_ccw(view)),
        write: Some(|encoder, value| {
            encoder.set_direction(if value == 0 { Direction::Cw } else { Direction::Ccw })
        }),
        range: Some(|_| Range { minimum: 0, maximum: 1 }),
    },
    Row {
        attribute: 4,
        name: "Internal diagnostic function",
        key: "internal-diagnosis",
        data_type: DataType::Bool,
        source: Source::Reading,
        unit: "",
        short_name: "Int. diagnostics",
        help: "Not used",
        note: "",
        changes: false,
        values: &["OFF", "ON"],
        read: |_| Value::Number(0),
        write: None,
        range: None,
    },
    Row {
        attribute: 5,
        name: "Scaling function",
        key: "scaling",
        data_type: DataType::Bool,
        source: Source::Reading,
        unit: "",
        short_name: "Scaling function",
        help: "Scaling is always on",
        note: "",
        changes: false,
        values: &["OFF", "ON"],
        read: |_| Value::Number(1),
        write: None,
        range: None,
    },
    Row {
        attribute: 6,
        name: "Position format",
        key: "position-format",
        data_type: DataType::Usint,
        source: Source::Reading,
        unit: "",
        short_name: "Position format",
        help: "The position counts steps",
        note: "",
        changes: false,
        values: &["Steps"],
        read: |_| Value::Number(0),
        write: None,
        range: None,
    },
    Row {
        attribute: 7,
        name: "Steps per turn",
        key: "steps-per-turn",
        data_type: DataType::Udint,
        source: Source::Parameter,
        unit: "step",
        short_name: "Steps per turn",
        help: "Number of steps per turn",
        note: "A change keeps the turns as programmed, sets the total resolution to steps × turns, and clears preset and offset.",
        changes: true,
        values: &[],
        read: |view| Value::Number(steps(view)),
        write: Some(|encoder, value| encoder.set_steps_per_turn(unsigned(value))),
        range: Some(|view| Range { minimum: 1, maximum: resolution(view) }),
    },
    Row {
        attribute: 8,
        name: "Total resolution",
        key: "total-resolution",
        data_type: DataType::Udint,
        source: Source::Parameter,
        unit: "step",
        short_name: "Total resolution",
        help: "Steps over the whole measuring range: steps per turn x turns",
        note: "A change clears preset and offset. On singleturn encoders it is the steps per turn.",
        changes: true,
        values: &[],
        read: |view| Value::Number(total(view)),
        write: Some(|encoder, value| encoder.set_total_resolution(unsigned(value))),
        range: Some(|view| {
            let maximum = steps(view) * i64::from(view.product.encoder.geometry.revolutions());
            let follows = view.product.encoder.total_follows_steps;
            Range { minimum: if follows { maximum } else { 1 }, maximum }
        }),
    },
    Row {
        attribute: 9,
        name: "Reserved",
        key: "measurement-steps",
        data_type: DataType::Udint,
        source: Source::Reading,
        unit: "",
        short_name: "Measuring steps",
        help: "Reserved, not used",
        note: "",
        changes: false,
        values: &[],
        read: |_| Value::Number(0),
        write: None,
        range: None,
    },
    Row {
        attribute: 10,
        name: "Preset value",
        key: "preset",
        data_type: DataType::Udint,
        source: Source::Parameter,
        unit: "step",
        short_name: "Preset value",
        help: "The current position becomes this value; use it at standstill",
        note: "The offset that does it lasts until the next power-up unless it is saved.",
        changes: true,
        values: &[],
        read: |view| Value::Number(i64::from(view.encoder.preset())),
        write: Some(|encoder, value| encoder.set_preset(unsigned(value)).map(|()| true)),
        range: Some(|view| Range { minimum: 0, maximum: total(view) - 1 }),
    },
    Row {
        attribute: 11,
        name: "COS delta",
        key: "cos-delta",
        data_type: DataType::Dint,
        source: Source::Parameter,
        unit: "step",
        short_name: "COS delta",
        help: "Change of position that is produced in change of state mode",
        note: "",
        changes: true,
        values: &[],
        read: |view| Value::Number(i64::from(view.encoder.cos_delta())),
        write: Some(|encoder, value| {
            encoder.set_cos_delta(i32::try_from(value).unwrap_or(i32::MAX))
        }),
        range: Some(|view| Range { minimum: 1, maximum: total(view) }),
    },
    Row {
        attribute: 12,
        name: "Position value",
        key: "position",
        data_type: DataType::Dint,
        source: Source::Reading,
        unit: "step",
        short_name: "Position value",
        help: "Current position",
        note: "",
        changes: true,
        values: &[],
        read: |view| Value::Number(i64::from(view.encoder.position())),
        write: None,
        range: Some(|view| Range { minimum: 0, maximum: total(view) - 1 }),
    },
    Row {
        attribute: 80,
        name: "Operating status",
        key: "operating-status",
        data_type: DataType::Usint,
        source: Source::Reading,
        unit: "",
        short_name: "Operating status",
        help: "Bit 0 CCW, bit 1 diagnosis supported, bit 2 scaling on",
        note: "",
        changes: true,
        values: &[],
        read: |view| Value::Number(is_ccw(view) | DIAGNOSIS_SUPPORTED | SCALING_ON),
        write: None,
        range: None,
    },
    Row {
        attribute: 81,
        name: "Singleturn resolution",
        key: "singleturn-resolution",
        data_type: DataType::Udint,
        source: Source::Reading,
        unit: "step",
        short_name: "Singleturn res.",
        help: "Internal steps per turn",
        note: "",
        changes: false,
        values: &[],
        read: |view| Value::Number(resolution(view)),
        write: None,
        range: None,
    },
    Row {
        attribute: 82,
        name: "No. of revolutions",
        key: "revolutions",
        data_type: DataType::Uint,
        source: Source::Reading,
        unit: "",
        short_name: "Revolutions",
        help: "Internal number of revolutions; 65535 stands for 65536",
        note: "0 for singleturn encoders.",
        changes: false,
        values: &[],
        read: |view| Value::Number(i64::from(view.product.number_of_revolutions())),
        write: None,
        range: None,
    },
    Row {
        attribute: 83,
        name: "Alarm signals",
        key: "alarms",
        data_type: DataType::Uint,
        source: Source::Reading,
        unit: "",
        short_name: "Alarm signals",
        help: "Bit 0 position error",
        note: "It ends by itself after 2.5 s.",
        changes: true,
        values: &[],
        read: |view| Value::Number(if view.encoder.alarm() { POSITION_ERROR } else { 0 }),
        write: None,
        range: None,
    },
    Row {
        attribute: 84,
        name: "Supported alarm signals",
        key: "supported-alarms",
        data_type: DataType::Uint,
        source: Source::Reading,
        unit: "",
        short_name: "Supported alarms",
        help: "Bit 0 position error supported",
        note: "",
        changes: false,
        values: &[],
        read: |_| Value::Number(POSITION_ERROR),
        write: None,
        range: None,
    },
    Row {
        attribute: 85,
        name: "Alarm flag",
        key: "alarm",
        data_type: DataType::Bool,
        source: Source::Reading,
        unit: "",
        short_name: "Alarm flag",
        help: "An alarm signal is set: the position may be wrong",
        note: "",
        changes: true,
        values: &["OK", "Alarm"],
        read: |view| Value::Number(i64::from(view.encoder.alarm())),
        write: None,
        range: None,
    },
    Row {
        attribute: 86,
        name: "Warning messages",
        key: "warnings",
        data_type: DataType::Uint,
        source: Source::Reading,
        unit: "",
        short_name: "Warning messages",
        help: "Bit 4 voltage of the lithium cell too low",
        note: "",
        changes: true,
        values: &[],
        read: |view| Value::Number(if view.encoder.warning() { CELL_VOLTAGE } else { 0 }),
        write: None,
        range: None,
    },
    Row {
        attribute: 87,
        name: "Supported warning messages",
        key: "supported-warnings",
        data_type: DataType::Uint,
        source: Source::Reading,
        unit: "",
        short_name: "Supp. warnings",
        help: "Bit 4 lithium cell warning supported",
        note: "",
        changes: false,
        values: &[],
        read: |view| {
            Value::Number(if view.product.encoder.lithium_cell { CELL_VOLTAGE } else { 0 })
        },
        write: None,
        range: None,
    },
    Row {
        attribute: 88,
        name: "Warning flag",
        key: "warning",
        data_type: DataType::Bool,
        source: Source::Reading,
        unit: "",
        short_name: "Warning flag",
        help: "A warning message is set: the position is right all the same",
        note: "",
        changes: true,
        values: &["OK", "Warning"],
        read: |view| Value::Number(i64::from(view.encoder.warning())),
        write: None,
        range: None,
    },
    Row {
        attribute: 89,
        name: "Profile and software version",
        key: "version",
        data_type: DataType::Udint,
        source: Source::Reading,
        unit: "",
        short_name: "Profile/software",
        help: "Low word profile version, high word software version, BCD",
        note: "",
        changes: false,
        values: &[],
        read: |_| Value::Number(PROFILE_AND_SOFTWARE),
        write: None,
        range: None,
    },
    Row {
        attribute: 91,
        name: "Offset value",
        key: "offset",
        data_type: DataType::Dint,
        source: Source::Reading,
        unit: "step",
        short_name: "Offset value",
        help: "What the preset function adds to the scaled position",
        note: "",
        changes: true,
        values: &[],
        read: |view| Value::Number(i64::from(view.encoder.offset())),
        write: None,
        range: None,
    },
    Row {
        attribute: 95,
        name: "Encoder type",
        key: "encoder-type",
        data_type: DataType::Uint,
        source: Source::Reading,
        unit: "",
        short_name: "Encoder type",
        help: "1 absolute singleturn encoder, 2 absolute multiturn encoder",
        note: "",
        changes: false,
        values: &["", "Singleturn", "Multiturn"],
        read: |view| Value::Number(i64::from(view.product.encoder_type())),
        write: None,
        range: None,
    },
];

impl Row {
    /// The row of `attribute`.
    #[must_use]
    pub fn find(attribute: u8) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.attribute == attribute)
    }

    /// The row with this key.
    #[must_use]
    pub fn with_key(key: &str) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.key == key)
    }

    /// Writes the value as the wire carries it.
    pub(crate) fn encode(&self, view: View<'_>, out: &mut Writer<'_>) -> Result<(), Full> {
        match (self.read)(view) {
            Value::Octets(octets) => out.octets(octets),
            Value::Number(value) => self.encode_number(value, out),
        }
    }

    /// Writes a number in the octets of the row's type.
    pub(crate) fn encode_number(&self, value: i64, out: &mut Writer<'_>) -> Result<(), Full> {
        out.octets(value.to_le_bytes().get(..self.data_type.octets()).unwrap_or_default())
    }

    /// Reads a value from the wire.
    ///
    /// # Errors
    /// 13 where octets are missing, 15 where there are too many, 09 for a BOOL that is neither 0
    /// nor 1.
    pub(crate) fn decode(&self, data: &[u8]) -> Result<i64, Error> {
        let octets = self.data_type.octets();
        if data.len() < octets {
            return Err(GeneralStatus::NOT_ENOUGH_DATA.into());
        }
        if data.len() > octets {
            return Err(GeneralStatus::TOO_MUCH_DATA.into());
        }
        let bits = data.iter().rev().fold(0, |bits, octet| bits << 8 | u32::from(*octet));
        let value = match self.data_type {
            DataType::Dint => i64::from(bits.cast_signed()),
            _ => i64::from(bits),
        };
        if self.data_type == DataType::Bool && value > 1 {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE.into());
        }
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_list_of_attributes_is_the_rows() {
        let numbers: Vec<u8> = ROWS.iter().map(|row| row.attribute).collect();
        assert_eq!(numbers, ATTRIBUTES);
        assert!(numbers.is_sorted());
    }

    #[test]
    fn the_manual_writes_five_attributes_and_no_more() {
        let writable = ROWS.iter().filter(|row| row.write.is_some());
        let numbers: Vec<u8> = writable.map(|row| row.attribute).collect();
        assert_eq!(numbers, [3, 7, 8, 10, 11]);
    }

    #[test]
    fn texts_fit_the_parameter_object() {
        for row in &ROWS {
            for (text, limit) in [(row.short_name, 16), (row.unit, 4), (row.help, 64)] {
                assert!(text.len() <= limit, "{text}: {} of {limit}", text.len());
                assert!(text.bytes().all(|octet| (b' '..=b'~').contains(&octet)), "{text}");
            }
            assert!(row.values.iter().all(|name| name.len() <= 16));
        }
    }

    #[test]
    fn keys_are_unique_and_fit_a_command_line() {
        for (place, row) in ROWS.iter().enumerate() {
            assert!(row.key.bytes().all(|octet| octet.is_ascii_lowercase() || octet == b'-'));
            assert!(ROWS[place + 1..].iter().all(|other| other.key != row.key));
            assert!(!row.help.is_empty());
        }
    }
}
