//! The values of attributes and of I/O data.

use codewheel_device::devicenet::rows::{DataType, Row};

use super::super::line::Line;
use super::objects::{self, Attribute, Form};

/// What an I/O connection produces: assembly 1 or 2 of an encoder, by its length.
pub(super) fn produced(data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    match *data {
        [a, b, c, d] if is_encoder => position([a, b, c, d], line),
        [a, b, c, d, flags] if is_encoder => {
            position([a, b, c, d], line);
            line.bits("flags", "flags", flags.into(), &[(0, "alarm"), (1, "warning")]);
        }
        _ => line.octets("data", "data", data),
    }
}

fn position(octets: [u8; 4], line: &mut Line<'_>) {
    line.number("position", "position", i32::from_le_bytes(octets).into(), "step");
}

/// The value of an attribute whose name the line has told already.
pub(super) fn told_attribute(
    class: u8,
    instance: u8,
    number: u8,
    data: &[u8],
    is_encoder: bool,
    line: &mut Line<'_>,
) {
    let known = objects::attribute(class, instance, number);
    // Two values of one attribute need their names.
    let is_one = known.is_some_and(|known| {
        !matches!(known.form, Form::Allocation | Form::Assembly | Form::Revision)
            && (is_encoder || !known.is_ours())
            // Octets of another length are no value: bare, `64` would look like one.
            && (known.octets == 0 || known.octets == data.len())
    });
    if is_one && !data.is_empty() {
        line.name_is_told();
    }
    attribute(known, data, is_encoder, line);
}

/// The value of an attribute; octets where it is none that is known, or has another length than it.
pub(super) fn attribute(
    known: Option<Attribute>,
    data: &[u8],
    is_encoder: bool,
    line: &mut Line<'_>,
) {
    let Some(known) = known else { return line.octets("data", "data", data) };
    // Get has no data, and nor has the answer to most Sets.
    if data.is_empty() {
        return;
    }
    if known.octets != 0 && known.octets != data.len() {
        return line.octets("data", "data", data);
    }
    let (key, name) = (known.key(), known.name());
    match known.form {
        // Class 2Fh is a manufacturer's: of another one it is another object.
        Form::Row(row) if is_encoder => number_of_row(row, key, name, data, line),
        Form::OfRow(row) if is_encoder => number_of_row(row, key, name, data, line),
        Form::Row(_) | Form::OfRow(_) => line.octets("data", "data", data),
        Form::Unsigned => line.number(key, name, unsigned(data), known.unit),
        Form::Hex => match *data {
            [low, high] => line.hex(key, name, &[high, low]),
            _ => line.hex(key, name, data),
        },
        Form::Revision => {
            line.number("major-revision", "revision", data.first().map_or(0, number), "");
            line.number("minor-revision", "minor revision", data.last().map_or(0, number), "");
        }
        Form::ShortString => short_string(key, name, data, line),
        Form::Path => path(key, name, data, is_encoder, line),
        Form::Names(names) => named(names, key, name, data, line),
        Form::Bits(names) => line.bits(key, name, unsigned(data).cast_unsigned(), names),
        Form::Allocation => {
            let choice = data.first().copied().unwrap_or_default();
            line.bits("choice", "choice", choice.into(), objects::choices());
            match data.last() {
                Some(0xFF) | None => line.word("master", "master", b"none"),
                Some(master) => line.number("master", "master", (*master).into(), ""),
            }
        }
        Form::Assembly => produced(data, is_encoder, line),
    }
}

fn number(octet: &u8) -> i64 {
    (*octet).into()
}

/// At most four octets, low one first.
fn unsigned(octets: &[u8]) -> i64 {
    octets.iter().take(4).rev().fold(0, |value, octet| value << 8 | i64::from(*octet))
}

fn named(names: &[(u8, &str)], key: &str, name: &str, data: &[u8], line: &mut Line<'_>) {
    let value = unsigned(data);
    match names.iter().find(|(number, _)| i64::from(*number) == value) {
        Some((_, word)) => line.word(key, name, word.as_bytes()),
        None => line.number(key, name, value, ""),
    }
}

fn number_of_row(row: &Row, key: &str, name: &str, data: &[u8], line: &mut Line<'_>) {
    let value = match row.data_type {
        DataType::UsintArray => return line.octets(key, name, data),
        DataType::Dint => i64::from((unsigned(data) as u32).cast_signed()),
        DataType::Bool | DataType::Usint | DataType::Uint | DataType::Udint => unsigned(data),
    };
    let word = usize::try_from(value).ok().and_then(|value| row.values.get(value));
    match word.filter(|word| !word.is_empty()) {
        Some(word) => line.word(key, name, word.as_bytes()),
        None => line.number(key, name, value, row.unit),
    }
}

/// A length, and so many letters.
pub(super) fn short_string(key: &str, name: &str, data: &[u8], line: &mut Line<'_>) {
    match data.split_first() {
        Some((length, letters)) if letters.len() == usize::from(*length) => {
            line.word(key, name, letters);
        }
        _ => line.octets(key, name, data),
    }
}

/// A path of 8-bit segments: `20` class, `24` instance, `30` attribute.
fn path(key: &str, name: &str, data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    let (class, instance, attribute) = match *data {
        [0x20, class, 0x24, instance] => (class, instance, None),
        [0x20, class, 0x24, instance, 0x30, attribute] => (class, instance, Some(attribute)),
        _ => return line.octets(key, name, data),
    };
    line.octets(key, name, data);
    line.word("path-class", "", objects::class_name(class, is_encoder).as_bytes());
    line.number("path-instance", "instance", instance.into(), "");
    if let Some(attribute) = attribute {
        line.number("path-attribute", "attribute", attribute.into(), "");
    }
}

/// The values that Get_Attributes_All brings, as far as they can be told apart.
pub(super) fn all_attributes(
    class: u8,
    instance: u8,
    data: &[u8],
    is_encoder: bool,
    line: &mut Line<'_>,
) {
    let mut rest = data;
    for known in objects::all(class, instance) {
        let length = match known.form {
            Form::ShortString => rest.first().map_or(1, |length| usize::from(*length) + 1),
            _ => known.octets,
        };
        let Some((value, behind)) = rest.split_at_checked(length) else { break };
        attribute(Some(known), value, is_encoder, line);
        rest = behind;
    }
    line.octets("rest", if rest.len() == data.len() { "data" } else { "rest" }, rest);
}
