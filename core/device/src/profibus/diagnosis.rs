//! The extended diagnosis: octets 7 to 57 of Slave_Diag, one row each (PROFIBUS manual §7).
//!
//! From these rows the slave writes its diagnosis, and a master and all that shows or documents it
//! can read it. Octets 1 to 6 belong to the standard and to the stack.

use codewheel_encoder::{Direction, Encoder};
use codewheel_station::{Full, Writer};

use super::octets::{Octets, number};
use crate::Product;

/// What a row reads from.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The product.
    pub product: &'a Product,
    /// The encoder.
    pub encoder: &'a Encoder,
    /// The device class whose diagnosis it is.
    pub class: u8,
    /// A position error, or a preset out of range.
    pub alarm: bool,
}

/// The value of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Value {
    /// A number; below 0 only where the row is signed.
    Number(i64),
    /// Octets.
    Octets(&'static [u8]),
}

/// What the octets of a row are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DataType {
    /// Bits with meanings of their own.
    Bits,
    /// A number.
    Unsigned,
    /// A number with a sign.
    Signed,
    /// Revision and index, each of two decimal digits.
    Version,
    /// Characters.
    Text,
}

/// One bit with a meaning of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Bit {
    /// Its number in the value, 0 the lowest.
    pub bit: u8,
    /// What it means when it is set.
    pub name: &'static str,
}

/// One value of the diagnosis.
#[derive(Debug)]
pub struct Row {
    /// Where it lies, counted from the first octet of Slave_Diag.
    pub octets: Octets,
    /// The device class whose diagnosis carries it.
    pub class: u8,
    /// Its name.
    pub name: &'static str,
    /// Its name on the command line.
    pub key: &'static str,
    /// What its octets are.
    pub data_type: DataType,
    /// The unit; empty where there is none.
    pub unit: &'static str,
    /// One sentence that helps.
    pub help: &'static str,
    /// Its bits, where they have names.
    pub bits: &'static [Bit],
    /// Reads the value.
    pub read: fn(&View<'_>) -> Value,
}

/// The number of Slave_Diag's first octet that is ours.
pub const FIRST_OCTET: u8 = 7;
/// How many octets Slave_Diag has in class 1.
pub const CLASS_1_OCTETS: u8 = 16;
/// How many octets Slave_Diag has in class 2 (decision: the manual's "57 byte" is the whole of it;
/// octets 58 and 59, which it calls not supported, are not sent).
pub const CLASS_2_OCTETS: u8 = 57;

const ALARM: i64 = 1 << 0;
const CCW: i64 = 1 << 0;
const CLASS_2_SUPPORTED: i64 = 1 << 1;
const SCALING_ON: i64 = 1 << 3;
/// Decision: bit 5 of the word, so octet 21; the manual's "octet 20 bit 5" names the word.
const CELL: i64 = 1 << 5;
const CELL_BIT: Bit = Bit { bit: 5, name: "lithium cell voltage too low" };
const ALARM_BIT: Bit = Bit { bit: 0, name: "position error or preset out of range" };
/// Encoder profile 1.1, BCD.
const PROFILE_VERSION: i64 = 0x0110;
/// Firmware 1.21, BCD.
const SOFTWARE_VERSION: i64 = 0x0121;
/// Decision: the value the profile has for "not supported".
const NO_OPERATING_HOURS: i64 = 0xFFFF_FFFF;

fn number_if(condition: bool, value: i64) -> Value {
    Value::Number(if condition { value } else { 0 })
}

/// All values, in the order of their octets.
pub static ROWS: [Row; 18] = [
    Row {
        octets: Octets::one(7),
        class: 1,
        name: "Extended diagnosis header",
        key: "extended-diagnosis-length",
        data_type: DataType::Unsigned,
        unit: "octet",
        help: "Length of the diagnosis from here on, this octet included",
        bits: &[],
        read: |view| {
            let last = if view.class == 1 { CLASS_1_OCTETS } else { CLASS_2_OCTETS };
            Value::Number(i64::from(last - FIRST_OCTET) + 1)
        },
    },
    Row {
        octets: Octets::one(8),
        class: 1,
        name: "Alarm signals",
        key: "alarms",
        data_type: DataType::Bits,
        unit: "",
        help: "What may make the position wrong",
        bits: &[ALARM_BIT],
        read: |view| number_if(view.alarm, ALARM),
    },
    Row {
        octets: Octets::one(9),
        class: 1,
        name: "Operating status",
        key: "operating-status",
        data_type: DataType::Bits,
        unit: "",
        help: "What is in force, and that class 2 is supported",
        bits: &[
            Bit { bit: 0, name: "CCW" },
            Bit { bit: 1, name: "class 2 supported" },
            Bit { bit: 3, name: "scaling on" },
        ],
        read: |view| {
            let settings = view.encoder.settings();
            let direction = if settings.direction == Direction::Ccw { CCW } else { 0 };
            let scaling = if settings.scaling { SCALING_ON } else { 0 };
            Value::Number(CLASS_2_SUPPORTED | direction | scaling)
        },
    },
    Row {
        octets: Octets::one(10),
        class: 1,
        name: "Encoder type",
        key: "encoder-type",
        data_type: DataType::Unsigned,
        unit: "",
        help: "0 singleturn, 1 multiturn",
        bits: &[],
        read: |view| number_if(view.product.encoder.geometry.is_multiturn(), 1),
    },
    Row {
        octets: Octets::span(11, 14),
        class: 1,
        name: "Singleturn resolution",
        key: "singleturn-resolution",
        data_type: DataType::Unsigned,
        unit: "step",
        help: "Internal steps per turn",
        bits: &[],
        read: |view| {
            Value::Number(i64::from(view.product.encoder.geometry.singleturn_resolution()))
        },
    },
    Row {
        octets: Octets::span(15, 16),
        class: 1,
        name: "Max. number of revolutions",
        key: "revolutions",
        data_type: DataType::Unsigned,
        unit: "",
        help: "Internal number of revolutions; 65535 stands for 65536, 0 for a singleturn encoder",
        bits: &[],
        read: |view| Value::Number(i64::from(view.product.number_of_revolutions())),
    },
    Row {
        octets: Octets::one(17),
        class: 2,
        name: "Additional alarm signals",
        key: "additional-alarms",
        data_type: DataType::Bits,
        unit: "",
        help: "Not supported",
        bits: &[],
        read: |_| Value::Number(0),
    },
    Row {
        octets: Octets::span(18, 19),
        class: 2,
        name: "Supported alarm signals",
        key: "supported-alarms",
        data_type: DataType::Bits,
        unit: "",
        help: "Which alarm signals there can be",
        bits: &[ALARM_BIT],
        read: |_| Value::Number(ALARM),
    },
    Row {
        octets: Octets::span(20, 21),
        class: 2,
        name: "Warnings",
        key: "warnings",
        data_type: DataType::Bits,
        unit: "",
        help: "What is not in order, while the position is right",
        bits: &[CELL_BIT],
        read: |view| number_if(view.encoder.warning(), CELL),
    },
    Row {
        octets: Octets::span(22, 23),
        class: 2,
        name: "Supported warning signals",
        key: "supported-warnings",
        data_type: DataType::Bits,
        unit: "",
        help: "Which warnings there can be",
        bits: &[CELL_BIT],
        read: |view| number_if(view.product.encoder.lithium_cell, CELL),
    },
    Row {
        octets: Octets::span(24, 25),
        class: 2,
        name: "Profile version",
        key: "profile-version",
        data_type: DataType::Version,
        unit: "",
        help: "Version of the encoder profile",
        bits: &[],
        read: |_| Value::Number(PROFILE_VERSION),
    },
    Row {
        octets: Octets::span(26, 27),
        class: 2,
        name: "Software version",
        key: "software-version",
        data_type: DataType::Version,
        unit: "",
        help: "Version of the firmware",
        bits: &[],
        read: |_| Value::Number(SOFTWARE_VERSION),
    },
    Row {
        octets: Octets::span(28, 31),
        class: 2,
        name: "Hours-run counter",
        key: "operating-hours",
        data_type: DataType::Unsigned,
        unit: "",
        help: "Not supported",
        bits: &[],
        read: |_| Value::Number(NO_OPERATING_HOURS),
    },
    Row {
        octets: Octets::span(32, 35),
        class: 2,
        name: "Offset value",
        key: "offset",
        data_type: DataType::Signed,
        unit: "step",
        help: "What the preset function adds to the scaled position",
        bits: &[],
        read: |view| Value::Number(i64::from(view.encoder.offset())),
    },
    Row {
        octets: Octets::span(36, 39),
        class: 2,
        name: "Manufacturer offset",
        key: "manufacturer-offset",
        data_type: DataType::Signed,
        unit: "step",
        help: "Not supported",
        bits: &[],
        read: |_| Value::Number(0),
    },
    Row {
        octets: Octets::span(40, 43),
        class: 2,
        name: "Steps per revolution",
        key: "steps-per-turn",
        data_type: DataType::Unsigned,
        unit: "step",
        help: "Steps per turn in force",
        bits: &[],
        read: |view| {
            let settings = view.encoder.settings();
            Value::Number(i64::from(settings.steps_in_force(view.encoder.model())))
        },
    },
    Row {
        octets: Octets::span(44, 47),
        class: 2,
        name: "Total resolution in steps",
        key: "total-resolution",
        data_type: DataType::Unsigned,
        unit: "step",
        help: "Measuring range in force",
        bits: &[],
        read: |view| {
            let settings = view.encoder.settings();
            Value::Number(i64::from(settings.total_in_force(view.encoder.model())))
        },
    },
    Row {
        octets: Octets::span(48, 57),
        class: 2,
        name: "Serial number",
        key: "serial-number",
        data_type: DataType::Text,
        unit: "",
        help: "Not supported",
        bits: &[],
        read: |_| Value::Octets(b"**********"),
    },
];

impl Row {
    /// The row with this key.
    #[must_use]
    pub fn find(key: &str) -> Option<&'static Self> {
        ROWS.iter().find(|row| row.key == key)
    }

    /// Writes the value into its octets.
    fn write(&self, view: &View<'_>, out: &mut Writer<'_>) -> Result<(), Full> {
        match (self.read)(view) {
            Value::Octets(octets) => out.octets(octets),
            Value::Number(number) => {
                let octets = number.to_be_bytes();
                let first = octets.len().saturating_sub(self.octets.count());
                out.octets(octets.get(first..).unwrap_or_default())
            }
        }
    }

    /// The number in its octets of a whole Slave_Diag; `None` where that ends before them, or where
    /// they are text.
    #[must_use]
    pub fn number_in(&self, diagnosis: &[u8]) -> Option<i64> {
        let octets = self.octets.of(diagnosis, 1)?;
        match self.data_type {
            DataType::Text => None,
            DataType::Signed => Some(i64::from((number(octets) as u32).cast_signed())),
            _ => Some(number(octets) as i64),
        }
    }
}

/// Writes the diagnosis of the class that `view` says, from octet 7 on.
pub(super) fn write(view: &View<'_>, out: &mut Writer<'_>) -> Result<(), Full> {
    ROWS.iter().filter(|row| row.class <= view.class).try_for_each(|row| row.write(view, out))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn written(view: &View<'_>) -> Vec<u8> {
        // Octets 1 to 6 belong to the stack.
        let mut octets = [0; 64];
        let mut out = Writer::new(&mut octets);
        out.octets(&[0; 6]).unwrap();
        write(view, &mut out).unwrap();
        out.written().to_vec()
    }

    #[test]
    fn the_rows_follow_each_other_without_a_gap_and_end_where_their_class_does() {
        let mut next = FIRST_OCTET;
        for row in &ROWS {
            assert_eq!(row.octets.first, next, "{}", row.name);
            next = row.octets.last + 1;
            assert_eq!(row.class, if next <= CLASS_1_OCTETS + 1 { 1 } else { 2 }, "{}", row.name);
            assert!(row.data_type == DataType::Text || row.octets.count() <= 4);
        }
        assert_eq!(next, CLASS_2_OCTETS + 1);
    }

    #[test]
    fn every_row_reads_back_what_it_wrote_and_class_1_is_the_front_of_class_2() {
        for product in &crate::product::PROFIBUS {
            let encoder = Encoder::with_defaults(product.encoder);
            let view = View { product, encoder: &encoder, class: 2, alarm: true };
            let diagnosis = written(&view);
            assert_eq!(diagnosis.len(), 57);
            assert_eq!(diagnosis[6], 0x33);
            for row in &ROWS {
                let expected = match (row.read)(&view) {
                    Value::Number(number) => Some(number),
                    Value::Octets(_) => None,
                };
                assert_eq!(row.number_in(&diagnosis), expected, "{}", row.name);
            }
            let short = written(&View { class: 1, ..view });
            assert_eq!((short.len(), short[6]), (16, 0x0A));
            assert_eq!(short[7..], diagnosis[7..16]);
            assert_eq!(Row::find("offset").unwrap().number_in(&short), None);
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
