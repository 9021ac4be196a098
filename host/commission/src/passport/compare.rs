//! What two passports have not in common.

use std::fmt;

use codewheel_device::product::Bus;
use serde::{Serialize, Serializer};

use super::measure::modulo;
use super::take::TOTAL_RESOLUTION;
use super::{Nameplate, Passport};
use crate::Reading;

/// What a difference is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Subject {
    /// The serial number: these are two encoders. No fault, but worth knowing.
    Unit,
    /// Who the device is: its vendor, product code, revision and so on.
    Identity,
    /// A setting.
    Setting,
    /// What presets add to the scaled code, of one and the same encoder.
    Offset,
    /// The address or the bit rate.
    Bus,
}

/// One thing that two passports say differently. What one of them does not say is `None`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// What it is about.
    pub subject: Subject,
    /// Its name: a setting as the command line has it, `serial`, `offset`.
    pub name: String,
    /// What the first passport says.
    #[serde(serialize_with = "optional")]
    pub was: Option<Reading>,
    /// What the second one says.
    #[serde(serialize_with = "optional")]
    pub is: Option<Reading>,
}

impl Difference {
    /// Whether something is not as it should be. Another unit and another address are what happens
    /// when an encoder is replaced.
    #[must_use]
    pub const fn counts(&self) -> bool {
        !matches!(self.subject, Subject::Unit | Subject::Bus)
    }
}

impl fmt::Display for Difference {
    /// `steps-per-turn: 8192 → 3600`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [was, is] = [&self.was, &self.is].map(|reading| told(reading.as_ref()));
        write!(f, "{}: {was} → {is}", self.name)?;
        if self.subject == Subject::Unit { f.write_str(" (another unit)") } else { Ok(()) }
    }
}

/// A reading as people write it.
pub(super) fn told(reading: Option<&Reading>) -> String {
    match reading {
        None => "nothing".to_owned(),
        Some(Reading::Number(number)) => number.to_string(),
        Some(Reading::Real(real)) => real.to_string(),
        Some(Reading::Text(text)) => text.clone(),
        Some(Reading::Octets(octets)) => super::project::hex(octets),
    }
}

/// Writes a reading as a number, a string or an array of octets.
pub(super) fn optional<S: Serializer>(
    reading: &Option<Reading>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match reading {
        None => serializer.serialize_none(),
        Some(Reading::Number(number)) => serializer.serialize_some(number),
        Some(Reading::Real(real)) => serializer.serialize_some(&real.number()),
        Some(Reading::Text(text)) => serializer.serialize_some(text),
        Some(Reading::Octets(octets)) => serializer.serialize_some(octets),
    }
}

/// What `is` says otherwise than `was`, which may be passports of one encoder at two times, or of
/// two encoders.
///
/// Readings such as the position are no difference, and neither is what the passport from a capture
/// could not know. The offset is one only of the same encoder: of another one it must differ. Where
/// the bus tells no serial numbers, two offsets that differ count.
#[must_use]
pub fn compare(was: &Passport, is: &Passport) -> Vec<Difference> {
    let mut differences = Vec::new();
    let mut differ = |subject, name: &str, was: Option<Reading>, is: Option<Reading>| {
        if was != is {
            differences.push(Difference { subject, name: name.to_owned(), was, is });
        }
    };
    let is_other_unit = was.nameplate.is_same_unit(&is.nameplate) == Some(false);
    if let (Some(was), Some(is)) = (was.nameplate.serial, is.nameplate.serial) {
        differ(Subject::Unit, "serial", number(Some(was)), number(Some(is)));
    }
    if was.bus != is.bus {
        let [was, is] = [was.bus, is.bus].map(|bus: Bus| Some(Reading::Text(bus.to_string())));
        differ(Subject::Identity, "bus", was, is);
    }
    differ(Subject::Bus, "address", number(Some(was.address)), number(Some(is.address)));
    if was.bit_rate.is_some() && is.bit_rate.is_some() {
        differ(Subject::Bus, "bit-rate", number(was.bit_rate), number(is.bit_rate));
    }
    for ((name, was), (_, is)) in plate(&was.nameplate).into_iter().zip(plate(&is.nameplate)) {
        // A device says these always or never; a capture may have missed them.
        if was.is_some() && is.is_some() {
            differ(Subject::Identity, name, was, is);
        }
    }
    let names = was.settings.iter().chain(&is.settings).map(|setting| &setting.name);
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if seen.contains(&name.as_str()) {
            continue;
        }
        seen.push(name);
        let (before, now) = (was.setting(name), is.setting(name));
        let unknown =
            before.is_none() && was.is_incomplete() || now.is_none() && is.is_incomplete();
        if !unknown {
            differ(Subject::Setting, name, before.cloned(), now.cloned());
        }
    }
    if let (Some(before), Some(now)) = (was.position.offset, is.position.offset)
        && !is_other_unit
        && !same_offset(was, before, now)
    {
        differ(Subject::Offset, "offset", number(Some(before)), number(Some(now)));
    }
    differences
}

/// Whether two offsets give the same positions: they are the same on the ring of the measuring range.
pub(super) fn same_offset(passport: &Passport, one: i64, other: i64) -> bool {
    match passport.total_in_force() {
        Some(total) => modulo(one, total) == modulo(other, total),
        None => one == other,
    }
}

impl Passport {
    /// Whether it comes from traffic, which does not show everything.
    pub(super) fn is_incomplete(&self) -> bool {
        self.source == super::Source::Capture
    }

    /// T, as far as the passport knows it; without scaling what the disc has.
    pub(super) fn total_in_force(&self) -> Option<u32> {
        if self.is_unscaled() {
            let plate = &self.nameplate;
            return plate.singleturn_resolution?.checked_mul(plate.revolutions?);
        }
        self.number(TOTAL_RESOLUTION).and_then(|total| u32::try_from(total).ok())
    }

    /// PROFIBUS: class 2 or the scaling function is off.
    pub(super) fn is_unscaled(&self) -> bool {
        self.bus == Bus::Profibus
            && (self.number("class-2") == Some(0) || self.number("scaling") == Some(0))
    }
}

fn number(value: Option<impl Into<i64>>) -> Option<Reading> {
    value.map(|value| Reading::Number(value.into()))
}

fn plate(plate: &Nameplate) -> [(&'static str, Option<Reading>); 8] {
    let text = |text: &Option<String>| text.clone().map(Reading::Text);
    let revision = plate.revision.map(|(major, minor)| Reading::Text(format!("{major}.{minor}")));
    [
        ("vendor", number(plate.vendor)),
        ("device-type", number(plate.device_type)),
        ("product-code", number(plate.product_code)),
        ("revision", revision),
        ("product-name", text(&plate.product_name)),
        ("firmware", text(&plate.firmware)),
        ("singleturn-resolution", number(plate.singleturn_resolution)),
        ("revolutions", number(plate.revolutions)),
    ]
}
