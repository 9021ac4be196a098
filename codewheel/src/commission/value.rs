//! Values as people write and read them.

use codewheel_commission::{Name, Reading, Value};
use codewheel_device::devicenet::rows;
use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters;
use serde::Serialize;

use crate::failure::Failure;

/// Reads a name: `steps-per-turn`, `2f/1/7`, `parameter/3`, `octet/32`.
pub(super) fn name(text: &str) -> Result<Name, Failure> {
    let parts: Vec<&str> = text.split('/').collect();
    let hexadecimal = |part: &str| u8::from_str_radix(part, 16).ok();
    let read = match *parts.as_slice() {
        [key] if !key.is_empty() => Some(Name::Key(key.to_owned())),
        ["parameter", number] => number.parse().ok().map(Name::Parameter),
        ["octet", number] => number.parse().ok().map(Name::Octet),
        [class, instance, attribute] => hexadecimal(class)
            .zip(hexadecimal(instance))
            .zip(hexadecimal(attribute))
            .map(|((class, instance), attribute)| Name::Path { class, instance, attribute }),
        _ => None,
    };
    read.ok_or_else(|| {
        Failure::Usage(format!(
            "{text:?} is no name of a value: write a key such as steps-per-turn, \
             CLASS/INSTANCE/ATTRIBUTE in hexadecimal such as 2f/1/7, parameter/3, or octet/32"
        ))
    })
}

/// Reads names.
pub(super) fn names(texts: &[String]) -> Result<Vec<Name>, Failure> {
    texts.iter().map(|text| name(text)).collect()
}

/// What our own devices say of a value besides: the names of its numbers, and what a change does.
pub(super) fn known(bus: Bus, value: &Value) -> (&'static [&'static str], &'static str) {
    let row = match bus {
        Bus::DeviceNet => {
            rows::ROWS.iter().find(|row| row.key == value.name).map(|row| (row.values, row.note))
        }
        Bus::Profibus => parameters::Row::find(&value.name).map(|row| (row.values, row.note)),
    };
    row.unwrap_or_default()
}

/// Reads what is to be written in place of `value`: one of `labels`, a number, octets between colons.
pub(super) fn parse(text: &str, value: &Value, labels: &[&str]) -> Result<Reading, Failure> {
    if let Some(number) = labels.iter().position(|label| label.eq_ignore_ascii_case(text)) {
        return Ok(Reading::Number(number as i64));
    }
    let read = match &value.reading {
        Reading::Text(_) => Some(Reading::Text(text.to_owned())),
        _ if text.contains(':') => octets(text).map(Reading::Octets),
        Reading::Real(real) => real.parse(text).map(Reading::Real),
        _ => number(text).map(Reading::Number),
    };
    read.ok_or_else(|| {
        let names = match labels {
            [] => String::new(),
            labels => format!(", one of {}", labels.join(", ")),
        };
        Failure::Usage(format!(
            "cannot write {text:?} to {}: write a number, decimal or 0x…{names}, or octets between \
             colons, such as 20:04:24:02",
            value.name
        ))
    })
}

fn number(text: &str) -> Option<i64> {
    match text.strip_prefix('-') {
        Some(text) => crate::hilo::number(text).ok().map(|number| -i64::from(number)),
        None => crate::hilo::number(text).ok().map(i64::from),
    }
}

fn octets(text: &str) -> Option<Vec<u8>> {
    let parts = text.split(':').filter(|part| !part.is_empty());
    parts.map(|part| u8::from_str_radix(part, 16).ok()).collect()
}

/// A reading as [`parse`] takes it.
pub(super) fn plain(reading: &Reading) -> String {
    match reading {
        Reading::Number(number) => number.to_string(),
        Reading::Real(number) => number.to_string(),
        Reading::Text(text) => text.clone(),
        // One octet alone would be read as a number.
        Reading::Octets(octets) if octets.len() == 1 => format!("{}:", hexadecimal(octets)),
        Reading::Octets(octets) => hexadecimal(octets),
    }
}

fn hexadecimal(octets: &[u8]) -> String {
    let octets: Vec<String> = octets.iter().map(|octet| format!("{octet:02X}")).collect();
    octets.join(":")
}

/// A value as a command writes it: the name of its number, where [`parse`] knows it.
pub(super) fn writable(bus: Bus, value: &Value) -> String {
    let (labels, _) = known(bus, value);
    match &value.label {
        Some(label) if labels.contains(&label.as_str()) => label.clone(),
        _ => plain(&value.reading),
    }
}

/// A value as people read it: the name of its number, where there is one.
pub(super) fn shown(value: &Value) -> String {
    match (&value.label, &value.reading) {
        (Some(label), _) => label.clone(),
        (None, Reading::Text(text)) => printable(text),
        (None, Reading::Octets(octets)) => hexadecimal(octets),
        (None, reading) => plain(reading),
    }
}

/// What a device says of itself, without the control characters that a terminal would obey.
pub(super) fn printable(text: &str) -> String {
    text.chars().filter(|letter| !letter.is_control()).collect()
}

/// [`shown`] with its unit.
pub(super) fn with_unit(value: &Value) -> String {
    let unit = &value.unit;
    format!("{}{}{unit}", shown(value), if unit.is_empty() { "" } else { " " })
}

/// A value as JSON.
#[derive(Serialize)]
pub(super) struct Line<'a> {
    name: &'a str,
    place: &'a str,
    title: &'a str,
    /// A number, a text, or octets as hexadecimal text.
    value: serde_json::Value,
    label: Option<&'a str>,
    unit: &'a str,
    writable: bool,
    setting: bool,
    range: Option<[i64; 2]>,
}

impl<'a> From<&'a Value> for Line<'a> {
    fn from(value: &'a Value) -> Self {
        Self {
            name: &value.name,
            place: &value.place,
            title: &value.title,
            value: json(&value.reading),
            label: value.label.as_deref(),
            unit: &value.unit,
            writable: value.writable,
            setting: value.setting,
            range: value.range.map(|(least, most)| [least, most]),
        }
    }
}

/// A reading as JSON.
pub(super) fn json(reading: &Reading) -> serde_json::Value {
    match reading {
        Reading::Number(number) => (*number).into(),
        Reading::Real(real) => real.number().into(),
        Reading::Text(text) => text.as_str().into(),
        Reading::Octets(octets) => hexadecimal(octets).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_commission::Real;

    fn value(reading: Reading) -> Value {
        Value {
            name: "direction".to_owned(),
            place: "2Fh/1/3".to_owned(),
            title: "Sense of rotation".to_owned(),
            reading,
            label: None,
            unit: String::new(),
            writable: true,
            setting: true,
            range: None,
            help: String::new(),
        }
    }

    #[test]
    fn names_are_read_as_the_manuals_write_them() {
        assert_eq!(name("position").ok(), Some(Name::Key("position".to_owned())));
        let path = Name::Path { class: 0x2F, instance: 1, attribute: 0x0C };
        assert_eq!(name("2f/1/c").ok(), Some(path));
        assert_eq!(name("parameter/19").ok(), Some(Name::Parameter(19)));
        assert_eq!(name("octet/32").ok(), Some(Name::Octet(32)));
        for text in ["", "2f/1", "2f/1/100", "parameter/x", "octet/256", "1/2/3/4"] {
            assert!(name(text).is_err(), "{text:?}");
        }
    }

    #[test]
    fn values_are_read_as_numbers_labels_and_octets() {
        let old = value(Reading::Number(0));
        let (labels, note) = known(Bus::DeviceNet, &old);
        assert!(note.contains("clears preset"), "{note}");
        for (text, wanted) in [
            ("ccw", Reading::Number(1)),
            ("0xE1000", Reading::Number(921_600)),
            ("-5", Reading::Number(-5)),
            ("20:04:24:02", Reading::Octets(vec![0x20, 0x04, 0x24, 0x02])),
        ] {
            assert_eq!(parse(text, &old, labels).ok(), Some(wanted), "{text}");
        }
        for text in ["", "widdershins", "1.5", "20:xx", "--5"] {
            let Err(Failure::Usage(why)) = parse(text, &old, labels) else { panic!("{text:?}") };
            assert!(why.contains("CW, CCW"), "{why}");
        }
    }

    #[test]
    fn what_is_shown_can_be_written_again() {
        for reading in [
            Reading::Number(-7),
            Reading::Octets(vec![0x20]),
            Reading::Octets(vec![0x20, 0x04]),
            Reading::Text("a text".to_owned()),
            Reading::Real(Real::Single(0.1)),
        ] {
            let old = value(reading.clone());
            assert_eq!(parse(&plain(&reading), &old, &[]).ok(), Some(reading));
        }
    }

    #[test]
    fn a_text_of_a_device_cannot_command_the_terminal() {
        let name = value(Reading::Text("AMG\x1b[2J 11".to_owned()));
        assert_eq!(shown(&name), "AMG[2J 11");
    }
}
