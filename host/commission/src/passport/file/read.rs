//! From the text of a file to a passport.

use std::fmt;
use std::ops::Range;

use codewheel_device::Product;
use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters;
use jiff::Timestamp;
use serde::Deserialize;
use serde::de::{
    DeserializeSeed, Deserializer, Error as _, MapAccess, SeqAccess, Unexpected, Visitor,
};
use toml_edit::{Document, DocumentMut};

use super::super::project::ExpectedPacketRates;
use super::super::{FORMAT, Nameplate, Passport, Position, Project, Setting, Source};
use super::FileError;
use crate::{Reading, Real};

pub(super) fn read(text: &str) -> Result<Passport, FileError> {
    let wrong = |error: &dyn fmt::Display| FileError { text: error.to_string() };
    let file: File = toml_edit::de::from_str(text).map_err(|error| wrong(&error))?;
    let mut passport = file.into_passport();
    let document: DocumentMut = text.parse().map_err(|error| wrong(&error))?;
    for setting in &mut passport.settings {
        let value = document.get("settings").and_then(|table| table.get(&setting.name));
        let suffix = value.and_then(|item| item.as_value()?.decor().suffix()?.as_str());
        let note = suffix.unwrap_or_default().trim().trim_start_matches('#').trim();
        note.clone_into(&mut setting.note);
    }
    agree(&passport, text)?;
    Ok(passport)
}

/// The same is said twice on PROFIBUS, as octets and as settings; whoever edits one must not believe
/// to have edited the other.
fn agree(passport: &Passport, text: &str) -> Result<(), FileError> {
    let Some(user) = &passport.project.user_parameters else { return Ok(()) };
    for row in parameters::ROWS {
        let (Some(octets), Some(setting)) = (row.read(user), passport.number(row.key)) else {
            continue;
        };
        if i64::from(octets) != setting {
            let key = row.key;
            let what = format!(
                "user-parameters say {key} = {octets}, the settings {setting}; change both, or take \
                 user-parameters away"
            );
            return Err(at_key(text, "project", "user-parameters", &what));
        }
    }
    Ok(())
}

/// An error at the line of a key, as the parser shows its own.
fn at_key(text: &str, table: &str, key: &str, what: &str) -> FileError {
    let span = Document::parse(text).ok().and_then(|document| {
        let (key, _) = document.get(table)?.as_table_like()?.get_key_value(key)?;
        key.span()
    });
    let Range { start, .. } = span.unwrap_or_default();
    let before = text.get(..start).unwrap_or_default();
    let number = before.matches('\n').count() + 1;
    let line = text.lines().nth(number - 1).unwrap_or_default();
    let margin = " ".repeat(number.to_string().len());
    FileError {
        text: format!(
            "error at line {number}\n{margin} |\n{number} | {line}\n{margin} |\n{what}\n"
        ),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct File {
    #[serde(rename = "format")]
    _format: Format,
    taken: Moment,
    program: String,
    source: SourceName,
    #[serde(default)]
    absent: Vec<String>,
    bus: BusTable,
    identity: IdentityTable,
    #[serde(default)]
    settings: Settings,
    #[serde(default)]
    position: PositionTable,
    #[serde(default)]
    project: ProjectTable,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum SourceName {
    Device,
    Capture,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum BusName {
    #[serde(rename = "devicenet")]
    DeviceNet,
    Profibus,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct BusTable {
    kind: BusName,
    address: Address,
    bit_rate: Option<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct IdentityTable {
    #[serde(default)]
    models: Vec<ModelName>,
    vendor: Option<u16>,
    device_type: Option<u16>,
    product_code: Option<u16>,
    revision: Option<Revision>,
    serial: Option<u32>,
    product_name: Option<String>,
    firmware: Option<String>,
    singleturn_resolution: Option<u32>,
    revolutions: Option<u32>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PositionTable {
    preset: Option<i64>,
    offset: Option<i64>,
    steps: Option<u32>,
    at_rest: Option<bool>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct ProjectTable {
    data_sheet: Option<String>,
    user_parameters: Option<UserParameters>,
    configuration: Option<Vec<u8>>,
    #[serde(default)]
    allocation: Vec<String>,
    expected_packet_rate_explicit: Option<u16>,
    expected_packet_rate_poll: Option<u16>,
    expected_packet_rate_change: Option<u16>,
}

#[derive(Deserialize)]
#[serde(try_from = "u32")]
struct Format;

impl TryFrom<u32> for Format {
    type Error = String;

    fn try_from(format: u32) -> Result<Self, String> {
        if format == FORMAT {
            Ok(Self)
        } else {
            Err(format!("this program reads passports of format {FORMAT}, not {format}"))
        }
    }
}

#[derive(Deserialize)]
#[serde(try_from = "String")]
struct Moment(Timestamp);

impl TryFrom<String> for Moment {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
            .map(Self)
            .map_err(|error| format!("no moment as in \"2026-01-31T12:00:00Z\": {error}"))
    }
}

/// 0 … 126: PROFIBUS has no more stations, DeviceNet has 0 … 63.
#[derive(Deserialize)]
#[serde(try_from = "u8")]
struct Address(u8);

impl TryFrom<u8> for Address {
    type Error = String;

    fn try_from(address: u8) -> Result<Self, String> {
        if address <= 126 { Ok(Self(address)) } else { Err("an address is 0 to 126".to_owned()) }
    }
}

#[derive(Deserialize)]
#[serde(try_from = "String")]
struct ModelName(&'static Product);

impl TryFrom<String> for ModelName {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let found = Product::find(&name).map(Self);
        found.ok_or_else(|| format!("there is no model \"{name}\"; `codewheel models` lists them"))
    }
}

#[derive(Deserialize)]
#[serde(try_from = "String")]
struct Revision(u8, u8);

impl TryFrom<String> for Revision {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let parts = text.split_once('.');
        let numbers = parts.and_then(|(a, b)| a.parse().ok().zip(b.parse().ok()));
        numbers
            .map(|(major, minor)| Self(major, minor))
            .ok_or_else(|| "a revision is two numbers up to 255, as in \"1.1\"".to_owned())
    }
}

#[derive(Deserialize)]
#[serde(try_from = "Vec<u8>")]
struct UserParameters(Vec<u8>);

impl TryFrom<Vec<u8>> for UserParameters {
    type Error = String;

    fn try_from(octets: Vec<u8>) -> Result<Self, String> {
        // 244 octets of data, of which the standard takes 7.
        if octets.len() <= 237 {
            Ok(Self(octets))
        } else {
            Err("Set_Prm has room for 237 user octets".to_owned())
        }
    }
}

/// The settings, in the order of the file.
#[derive(Default)]
struct Settings(Vec<Setting>);

impl<'de> Deserialize<'de> for Settings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Settings;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of settings")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Settings, A::Error> {
                let mut settings = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    // Our own settings are whole numbers; only strangers have others.
                    let takes_fractions = name.starts_with("parameter/");
                    let reading = map.next_value_seed(Entry { takes_fractions })?;
                    settings.push(Setting { name, reading, note: String::new() });
                }
                Ok(Settings(settings))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

/// The value of a setting: a number, a text, or octets.
struct Entry {
    takes_fractions: bool,
}

impl<'de> DeserializeSeed<'de> for Entry {
    type Value = Reading;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Reading, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Entry {
    type Value = Reading;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a text or octets such as [0x20, 0x04]")
    }

    fn visit_i64<E>(self, number: i64) -> Result<Reading, E> {
        Ok(Reading::Number(number))
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Reading, E> {
        let number = i64::try_from(number).map_err(|_| E::custom("a number too large"))?;
        self.visit_i64(number)
    }

    fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Reading, E> {
        if !self.takes_fractions {
            return Err(E::invalid_type(Unexpected::Float(number), &self));
        }
        Ok(Reading::Real(Real::Double(number)))
    }

    fn visit_str<E>(self, text: &str) -> Result<Reading, E> {
        Ok(Reading::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Reading, A::Error> {
        let mut octets = Vec::new();
        while let Some(octet) = seq.next_element::<i64>()? {
            octets.push(
                u8::try_from(octet).map_err(|_| {
                    A::Error::custom(format!("{octet} is no octet: it has 0 to 255"))
                })?,
            );
        }
        Ok(Reading::Octets(octets))
    }
}

impl File {
    fn into_passport(self) -> Passport {
        let Self {
            taken, program, source, absent, bus, identity, settings, position, project, ..
        } = self;
        Passport {
            taken: taken.0,
            program,
            source: match source {
                SourceName::Device => Source::Device,
                SourceName::Capture => Source::Capture,
            },
            absent,
            bus: match bus.kind {
                BusName::DeviceNet => Bus::DeviceNet,
                BusName::Profibus => Bus::Profibus,
            },
            address: bus.address.0,
            bit_rate: bus.bit_rate,
            nameplate: Nameplate {
                models: identity.models.into_iter().map(|model| model.0).collect(),
                vendor: identity.vendor,
                device_type: identity.device_type,
                product_code: identity.product_code,
                revision: identity.revision.map(|Revision(major, minor)| (major, minor)),
                serial: identity.serial,
                product_name: identity.product_name,
                firmware: identity.firmware,
                singleturn_resolution: identity.singleturn_resolution,
                revolutions: identity.revolutions,
            },
            settings: settings.0,
            position: Position {
                preset: position.preset,
                offset: position.offset,
                steps: position.steps,
                at_rest: position.at_rest,
            },
            project: Project {
                data_sheet: project.data_sheet,
                user_parameters: project.user_parameters.map(|user| user.0),
                configuration: project.configuration,
                allocation: project.allocation,
                expected_packet_rates: ExpectedPacketRates {
                    explicit: project.expected_packet_rate_explicit,
                    poll: project.expected_packet_rate_poll,
                    change_of_state: project.expected_packet_rate_change,
                },
            },
        }
    }
}
