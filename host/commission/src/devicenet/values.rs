//! Octets of the bus as values for people, and back.

use codewheel_device::devicenet::rows::{DataType, Row, Source};
use codewheel_devicenet::explicit::Path;
use codewheel_devicenet::scanner::{DataType as ParameterType, Parameter};

use super::objects::{Attribute, Form};
use crate::{Reading, Real, Value};

/// The attribute whose write is the preset function: an act, though its row is a parameter.
pub(super) const PRESET: u8 = 10;

/// A number, low octet first; `None` without octets or with more than eight.
pub(super) fn unsigned(octets: &[u8]) -> Option<i64> {
    let mut all = [0; 8];
    if octets.is_empty() || octets.len() > all.len() {
        return None;
    }
    for (to, from) in all.iter_mut().zip(octets) {
        *to = *from;
    }
    i64::try_from(u64::from_le_bytes(all)).ok()
}

/// The same with a sign.
pub(super) fn signed(octets: &[u8]) -> Option<i64> {
    let negative = octets.last().is_some_and(|octet| octet & 0x80 != 0);
    let mut all = [if negative { 0xFF } else { 0 }; 8];
    if octets.is_empty() || octets.len() > all.len() {
        return None;
    }
    for (to, from) in all.iter_mut().zip(octets) {
        *to = *from;
    }
    Some(i64::from_le_bytes(all))
}

/// A text after its length, ISO 8859-1; what cannot be printed as `?`.
pub(super) fn short_string(octets: &[u8]) -> String {
    let [length, characters @ ..] = octets else { return String::new() };
    let characters = characters.get(..usize::from(*length)).unwrap_or(characters);
    let printed = |octet: &u8| {
        let character = char::from(*octet);
        if character.is_control() { '?' } else { character }
    };
    characters.iter().map(printed).collect()
}

/// The version of the software in attribute 89, BCD in the high word: `1.01`.
pub(super) fn firmware(octets: &[u8]) -> Option<String> {
    let [_, _, minor, major] = *octets else { return None };
    Some(format!("{major:x}.{minor:02x}"))
}

/// The name of the value `number`, where there is one.
fn label(values: &[&str], number: i64) -> Option<String> {
    let name = values.get(usize::try_from(number).ok()?)?;
    (!name.is_empty()).then(|| (*name).to_owned())
}

/// Class, instance and attribute as manuals print them: `2Fh/1/7`.
fn place(path: Path) -> String {
    format!("{:02X}h/{}/{}", path.class, path.instance, path.attribute)
}

/// The number in the octets of a row's type; `None` where they are no such number.
pub(super) fn number_of_row(row: &Row, octets: &[u8]) -> Option<i64> {
    if octets.len() != row.data_type.octets() {
        return None;
    }
    match row.data_type {
        DataType::Dint => signed(octets),
        DataType::UsintArray => None,
        DataType::Bool | DataType::Usint | DataType::Uint | DataType::Udint => unsigned(octets),
    }
}

/// The value of an attribute of class 2Fh.
pub(super) fn of_row(row: &Row, octets: &[u8], range: Option<(i64, i64)>) -> Value {
    let number = number_of_row(row, octets);
    let help = if row.note.is_empty() {
        row.help.to_owned()
    } else {
        format!("{}. {}", row.help, row.note)
    };
    Value {
        name: row.key.to_owned(),
        place: place(path_of(row)),
        title: row.name.to_owned(),
        reading: number.map_or_else(|| Reading::Octets(octets.to_vec()), Reading::Number),
        label: number.and_then(|number| label(row.values, number)),
        unit: row.unit.to_owned(),
        writable: row.write.is_some(),
        setting: row.source == Source::Parameter && row.attribute != PRESET,
        range,
        help,
    }
}

/// Where a row lies.
pub(super) const fn path_of(row: &Row) -> Path {
    Path {
        class: codewheel_device::devicenet::rows::ENCODER_POSITION,
        instance: 1,
        attribute: row.attribute,
    }
}

/// The value of an attribute of the bus.
pub(super) fn of_attribute(attribute: &Attribute, octets: &[u8]) -> Value {
    let reading = match attribute.form {
        Form::Unsigned(length) if octets.len() == length => unsigned(octets).map(Reading::Number),
        Form::Unsigned(_) => None,
        Form::Revision => match *octets {
            [major, minor] => Some(Reading::Text(format!("{major}.{minor}"))),
            _ => None,
        },
        Form::ShortString => Some(Reading::Text(short_string(octets))),
        Form::Allocation => match *octets {
            [_, 0xFF] => Some(Reading::Text("none".to_owned())),
            [choice, master] => {
                Some(Reading::Text(format!("choice {choice:02X}, master {master}")))
            }
            _ => None,
        },
        Form::AssemblyPath { .. } => assembly(octets).map(|number| Reading::Number(number.into())),
    };
    let reading = reading.unwrap_or_else(|| Reading::Octets(octets.to_vec()));
    let label = match &reading {
        Reading::Number(number) => label(attribute.values, *number),
        Reading::Real(_) | Reading::Text(_) | Reading::Octets(_) => None,
    };
    Value {
        name: attribute.key.to_owned(),
        place: place(attribute.path),
        title: attribute.title.to_owned(),
        reading,
        label,
        unit: attribute.unit.to_owned(),
        writable: attribute.range.is_some(),
        setting: attribute.setting,
        range: attribute.range,
        help: attribute.help.to_owned(),
    }
}

/// The assembly that a produced path names: `20 04 24 01`, also with `30 03` behind.
fn assembly(path: &[u8]) -> Option<u8> {
    match *path {
        [0x20, 0x04, 0x24, instance] | [0x20, 0x04, 0x24, instance, 0x30, 0x03] => Some(instance),
        _ => None,
    }
}

/// The value of an attribute that nobody knows: octets, and the number that they may be.
pub(super) fn of_path(path: Path, octets: &[u8]) -> Value {
    let number = matches!(octets.len(), 1 | 2 | 4).then(|| unsigned(octets)).flatten();
    Value {
        name: path.to_string(),
        place: place(path),
        title: String::new(),
        reading: Reading::Octets(octets.to_vec()),
        label: number.map(|number| number.to_string()),
        unit: String::new(),
        // Whether it takes a value is for the device to say.
        writable: true,
        setting: false,
        range: None,
        help: String::new(),
    }
}

/// Descriptor bit 5 of a parameter: it changes by itself, so it is a reading.
const MONITOR: u16 = 1 << 5;

/// The codes of data types, old and new (CIP volume 1, appendix C).
const SHORT_STRING: u8 = 0xDA;
const REAL: [u8; 2] = [0xCA, 0x0B];
const LREAL: [u8; 2] = [0xCB, 0x0C];

/// What the octets of a type are.
fn of_type(data_type: ParameterType, octets: &[u8]) -> Reading {
    let reading = match *octets {
        _ if data_type.0 == SHORT_STRING => Some(Reading::Text(short_string(octets))),
        [a, b, c, d] if REAL.contains(&data_type.0) => {
            Some(Reading::Real(Real::Single(f32::from_le_bytes([a, b, c, d]))))
        }
        [a, b, c, d, e, f, g, h] if LREAL.contains(&data_type.0) => {
            Some(Reading::Real(Real::Double(f64::from_le_bytes([a, b, c, d, e, f, g, h]))))
        }
        _ => data_type.number(octets).and_then(|it| i64::try_from(it).ok()).map(Reading::Number),
    };
    reading.unwrap_or_else(|| Reading::Octets(octets.to_vec()))
}

/// The octets of a text or a number with a fraction; `None` where the type takes no such thing.
pub(super) fn to_type(data_type: ParameterType, reading: &Reading) -> Option<Vec<u8>> {
    if data_type.0 == SHORT_STRING {
        let Reading::Text(text) = reading else { return None };
        let characters = text.chars().map(|it| u8::try_from(u32::from(it)).ok());
        let characters: Vec<u8> = characters.collect::<Option<_>>()?;
        let length = u8::try_from(characters.len()).ok()?;
        return Some(std::iter::once(length).chain(characters).collect());
    }
    let number = match reading {
        Reading::Number(number) => *number as f64,
        Reading::Real(real) => real.number(),
        Reading::Text(_) | Reading::Octets(_) => return None,
    };
    if REAL.contains(&data_type.0) {
        Some((number as f32).to_le_bytes().to_vec())
    } else if LREAL.contains(&data_type.0) {
        Some(number.to_le_bytes().to_vec())
    } else {
        None
    }
}

/// What a scaled number means in its unit, with the number itself: (raw + offset) × multiplier × base
/// ÷ divisor (CIP volume 1, chapter 5-14). `None` where that is the number, or a device divides by 0.
pub(super) fn scaled(raw: i64, scaling: [i64; 4], decimals: u8) -> Option<String> {
    let [multiplier, divisor, base, offset] = scaling;
    if divisor == 0 || (offset == 0 && multiplier.saturating_mul(base) == divisor) {
        return None;
    }
    let value = (raw as f64 + offset as f64) * multiplier as f64 * base as f64 / divisor as f64;
    let shown = match decimals.min(9) {
        // Some leave the decimals at zero, though what they mean has a fraction.
        0 => value.to_string(),
        decimals => format!("{value:.places$}", places = decimals.into()),
    };
    Some(format!("{shown} (raw {raw})"))
}

/// The value of a parameter, in the words of the device. `label` is the name of the value.
pub(super) fn of_parameter(parameter: &Parameter, label: Option<String>) -> Value {
    let number = |octets| {
        let number = parameter.data_type.number(octets)?;
        i64::try_from(number).ok()
    };
    let reading = of_type(parameter.data_type, parameter.value.as_slice());
    let range = number(parameter.minimum.as_slice()).zip(number(parameter.maximum.as_slice()));
    let place = match *parameter.link.as_slice() {
        [0x20, class, 0x24, instance, 0x30, attribute] => {
            format!("0Fh/{}, which is {class:02X}h/{instance}/{attribute}", parameter.number)
        }
        _ => format!("0Fh/{}", parameter.number),
    };
    Value {
        name: format!("parameter/{}", parameter.number),
        place,
        title: parameter.name.to_string(),
        reading,
        label,
        unit: parameter.units.to_string(),
        writable: !parameter.is_read_only(),
        setting: !parameter.is_read_only() && parameter.descriptor & MONITOR == 0,
        // Twice the same number, mostly zero, is what devices give that have no limits to tell.
        range: range.filter(|(minimum, maximum)| minimum < maximum),
        help: parameter.help.to_string(),
    }
}

/// `number` in so many octets, low octet first; `None` where it does not fit. Numbers below zero fit
/// types with a sign alone.
pub(super) fn octets_of(number: i64, length: usize, is_signed: bool) -> Option<Vec<u8>> {
    let all = number.to_le_bytes();
    let octets = all.get(..length)?;
    let back = if is_signed { signed(octets) } else { unsigned(octets) };
    (back == Some(number)).then(|| octets.to_vec())
}

/// The number of the value with this name, whatever its case.
pub(super) fn number_of_label(values: &[&str], text: &str) -> Option<i64> {
    let is_meant = |value: &&str| !value.is_empty() && value.eq_ignore_ascii_case(text);
    values.iter().position(is_meant).and_then(|place| i64::try_from(place).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_there_and_back_and_nowhere_else() {
        for (number, length, is_signed, octets) in [
            (8_192, 4, false, Some(vec![0, 0x20, 0, 0])),
            (-1, 4, true, Some(vec![0xFF; 4])),
            (-1, 4, false, None),
            (256, 1, false, None),
            (128, 1, true, None),
            (4_294_967_295, 4, false, Some(vec![0xFF; 4])),
        ] {
            assert_eq!(octets_of(number, length, is_signed), octets, "{number} in {length}");
        }
        assert_eq!(unsigned(&[]), None);
        assert_eq!(signed(&[0xFE]), Some(-2));
    }

    #[test]
    fn the_version_is_the_one_on_the_manual() {
        assert_eq!(firmware(&[0x10, 0x01, 0x01, 0x01]).as_deref(), Some("1.01"));
        assert_eq!(firmware(&[1]), None);
    }

    #[test]
    fn a_path_names_an_assembly_in_both_forms() {
        assert_eq!(assembly(&[0x20, 0x04, 0x24, 2]), Some(2));
        assert_eq!(assembly(&[0x20, 0x04, 0x24, 1, 0x30, 3]), Some(1));
        assert_eq!(assembly(&[0x20, 0x05, 0x24, 1]), None);
    }

    #[test]
    fn scaled_numbers_are_told_in_their_unit_with_the_number_itself() {
        assert_eq!(scaled(237, [1, 10, 1, 0], 1).as_deref(), Some("23.7 (raw 237)"));
        assert_eq!(scaled(5, [3, 2, 1, -1], 0).as_deref(), Some("6 (raw 5)"));
        assert_eq!(scaled(5, [3, 2, 1, 0], 0).as_deref(), Some("7.5 (raw 5)"));
        assert_eq!(scaled(5, [2, 2, 1, 0], 1), None);
        assert_eq!(scaled(5, [1, 0, 1, 0], 1), None);
    }

    #[test]
    fn a_text_that_lies_about_its_length_is_what_there_is() {
        assert_eq!(short_string(&[9, b'A', 7]), "A?");
        assert_eq!(short_string(&[]), "");
    }
}
