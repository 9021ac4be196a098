//! The Parameter object (class 0Fh): the rows once more, for scanners that configure what they have
//! never seen (AMG manual §7; CIP volume 1, chapter 5).

use codewheel_devicenet::explicit::{Error, GeneralStatus};
use codewheel_encoder::Encoder;
use codewheel_station::{Full, Writer};

use super::rows::{DataType, ENCODER_POSITION, Range, Row, Source, Value, View};

/// The class code of the Parameter object.
pub const PARAMETER: u8 = 0x0F;

/// The attribute of class 2Fh that each parameter instance, from 1 on, refers to (AMG manual §7).
pub static LINKS: [u8; 19] = [3, 4, 5, 6, 7, 8, 9, 10, 12, 80, 81, 82, 85, 83, 84, 88, 86, 87, 89];

/// Class attribute 8: instances, full attributes, storage commanded and done in non-volatile
/// memory.
pub const CLASS_DESCRIPTOR: u16 = 0x000F;
/// Class attribute 9: there is no configuration assembly.
pub const NO_CONFIGURATION_ASSEMBLY: u16 = 0;
/// Class attribute 10: English.
const NATIVE_LANGUAGE: u8 = 0;

/// Instance attribute 4: the value has names.
const ENUMERATED: u16 = 1 << 1;
/// Instance attribute 4: the value cannot be set.
const READ_ONLY: u16 = 1 << 4;
/// Instance attribute 4: the value changes by itself.
const MONITOR: u16 = 1 << 5;

/// The value attribute, the one that can be set.
pub(super) const VALUE: u8 = 1;
/// The last attribute of a full instance.
pub(super) const LAST_ATTRIBUTE: u8 = 21;

/// The row behind parameter `instance`, 1 … 19.
pub(super) fn row(instance: u8) -> Result<&'static Row, Error> {
    usize::from(instance)
        .checked_sub(1)
        .and_then(|place| LINKS.get(place))
        .and_then(|attribute| Row::find(*attribute))
        .ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST.into())
}

/// Writes class attribute `attribute`, beyond the two that every class has.
pub(super) fn class_attribute(attribute: u8, out: &mut Writer<'_>) -> Result<(), Error> {
    fits(match attribute {
        8 => out.u16_le(CLASS_DESCRIPTOR),
        9 => out.u16_le(NO_CONFIGURATION_ASSEMBLY),
        10 => out.u8(NATIVE_LANGUAGE),
        _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
    })
}

/// Writes all class attributes: 2, 8, 9, 10.
pub(super) fn all_class_attributes(out: &mut Writer<'_>) -> Result<(), Error> {
    fits(out.u16_le(LINKS.len() as u16))?;
    (8..=10).try_for_each(|attribute| class_attribute(attribute, out))
}

/// Writes attribute `attribute` of the parameter that `row` is.
pub(super) fn attribute(
    row: &Row,
    attribute: u8,
    view: View<'_>,
    out: &mut Writer<'_>,
) -> Result<(), Error> {
    let path = link_path(row);
    fits(match attribute {
        VALUE => row.encode(view, out),
        2 => out.u8(path.len() as u8),
        3 => out.octets(&path),
        4 => out.u16_le(descriptor(row)),
        5 => out.u8(type_code(row.data_type)),
        6 => out.u8(row.data_type.octets() as u8),
        7 => short_string(row.short_name, out),
        8 => short_string(row.unit, out),
        9 => short_string(row.help, out),
        10 => row.encode_number(range(row, view).minimum, out),
        11 => row.encode_number(range(row, view).maximum, out),
        12 => {
            let encoder = Encoder::with_defaults(view.product.encoder);
            row.encode(View { encoder: &encoder, ..view }, out)
        }
        13..=15 => out.u16_le(1),
        16..=20 => out.u16_le(0),
        LAST_ATTRIBUTE => out.u8(0),
        _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
    })
}

/// Writes all attributes of a full instance, 1 … 21, in their order.
pub(super) fn all_attributes(row: &Row, view: View<'_>, out: &mut Writer<'_>) -> Result<(), Error> {
    (VALUE..=LAST_ATTRIBUTE).try_for_each(|number| attribute(row, number, view, out))
}

/// Writes the name of an enumerated value (service 4Bh, data `[value]`).
///
/// # Errors
/// 08 where the parameter is not enumerated, 13 and 15 for the length, 20 for a value without a
/// name.
pub(super) fn enum_string(row: &Row, data: &[u8], out: &mut Writer<'_>) -> Result<(), Error> {
    if row.values.is_empty() {
        return Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into());
    }
    let value = match *data {
        [value] => value,
        [] => return Err(GeneralStatus::NOT_ENOUGH_DATA.into()),
        _ => return Err(GeneralStatus::TOO_MUCH_DATA.into()),
    };
    let name = row.values.get(usize::from(value)).filter(|name| !name.is_empty());
    let name = name.ok_or(Error::from(GeneralStatus::INVALID_PARAMETER))?;
    fits(short_string(name, out))
}

/// Instance attribute 3: the path of the attribute that the parameter refers to.
#[must_use]
pub const fn link_path(row: &Row) -> [u8; 6] {
    [0x20, ENCODER_POSITION, 0x24, 1, 0x30, row.attribute]
}

/// Instance attribute 4: whether the value has names, cannot be set, changes by itself.
#[must_use]
pub fn descriptor(row: &Row) -> u16 {
    let enumerated = if row.values.is_empty() { 0 } else { ENUMERATED };
    let read_only = if row.write.is_none() { READ_ONLY } else { 0 };
    // What never changes needs no watching.
    let monitor = if row.source == Source::Reading && row.changes { MONITOR } else { 0 };
    enumerated | read_only | monitor
}

/// Instance attribute 5: the data type codes of CIP volume 1, appendix C.
#[must_use]
pub const fn type_code(data_type: DataType) -> u8 {
    match data_type {
        DataType::Bool => 0xC1,
        DataType::Dint => 0xC4,
        DataType::Usint | DataType::UsintArray => 0xC6,
        DataType::Uint => 0xC7,
        DataType::Udint => 0xC8,
    }
}

/// Instance attributes 10 and 11, the values a parameter can have: its live limits, or what its names
/// or its type allow.
#[must_use]
pub fn range(row: &Row, view: View<'_>) -> Range {
    if let Some(range) = row.range {
        return range(view);
    }
    let last_name = row.values.len() as i64 - 1;
    let Range { minimum, mut maximum } = row.data_type.range();
    if last_name > 0 {
        maximum = last_name;
    }
    // A value that never changes is its own limit.
    match (row.read)(view) {
        Value::Number(value) if row.source == Source::Reading && !row.changes => {
            Range { minimum: value, maximum: value }
        }
        _ => Range { minimum, maximum },
    }
}

fn short_string(text: &str, out: &mut Writer<'_>) -> Result<(), Full> {
    out.u8(text.len() as u8)?;
    out.octets(text.as_bytes())
}

fn fits(result: Result<(), Full>) -> Result<(), Error> {
    result.map_err(|Full| GeneralStatus::RESOURCE_UNAVAILABLE.into())
}
