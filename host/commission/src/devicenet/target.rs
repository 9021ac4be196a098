//! What a name means on a device.

use codewheel_device::devicenet::rows::{ENCODER_POSITION, ROWS, Row};
use codewheel_devicenet::explicit::Path;
use codewheel_devicenet::scanner::PARAMETER;

use super::objects::Attribute;
use super::values;
use crate::{Kind, Name, Reading, Trouble};

/// What a name means.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// An attribute of class 2Fh of ours.
    Row(&'static Row),
    /// An attribute that every device has, or the produced path of ours.
    Attribute(&'static Attribute),
    /// An instance of the Parameter object.
    Parameter(u8),
    /// Any other attribute: octets.
    Octets(Path),
}

impl Target {
    /// What `name` means on a device that `is_ours`, or is not.
    pub(super) fn of(tried: &str, name: &Name, is_ours: bool) -> Result<Self, Trouble> {
        let usage =
            |came: String, remedy: &str| Err(Trouble::new(Kind::Usage, tried, came, remedy));
        match name {
            Name::Key(key) => {
                let row = ROWS.iter().find(|row| row.key == key);
                let attribute = Attribute::of_key(key);
                match (row, attribute) {
                    (Some(row), _) if is_ours => Ok(Self::Row(row)),
                    (_, Some(attribute)) if is_ours || !attribute.ours => {
                        Ok(Self::Attribute(attribute))
                    }
                    (None, None) => usage(
                        format!("there is no {key}"),
                        "get everything without a name to see what there is",
                    ),
                    _ => usage(
                        format!("the device is none of ours, and its {key} is not known"),
                        "name it by parameter/N or by class/instance/attribute, as its EDS file says",
                    ),
                }
            }
            Name::Path { class, instance, attribute } => {
                let path = Path { class: *class, instance: *instance, attribute: *attribute };
                Ok(Self::of_path(path, is_ours))
            }
            Name::Parameter(0) => {
                usage("parameters are counted from 1".to_owned(), "read the class itself by 0f/0/1")
            }
            Name::Parameter(number) => Ok(Self::Parameter(*number)),
            Name::Octet(_) => usage(
                "octets of a diagnosis are on PROFIBUS alone".to_owned(),
                "name it by its key, or by class/instance/attribute",
            ),
        }
    }

    fn of_path(path: Path, is_ours: bool) -> Self {
        let Path { class, instance, attribute } = path;
        match (class, instance) {
            (ENCODER_POSITION, 1) if is_ours => {
                Row::find(attribute).map_or(Self::Octets(path), Self::Row)
            }
            (PARAMETER, 1..) if attribute == 1 => Self::Parameter(instance),
            _ => Attribute::of_path(path)
                .filter(|attribute| is_ours || !attribute.ours)
                .map_or(Self::Octets(path), Self::Attribute),
        }
    }
}

/// What is to be written, with the octets and the sign its place has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    /// The names of the values 0, 1, …
    pub(super) values: &'a [&'a str],
    /// How many octets it has.
    pub(super) octets: usize,
    /// Whether numbers below zero are such.
    pub(super) is_signed: bool,
}

impl Place<'_> {
    /// The number that `reading` means here: itself, its name, or its octets.
    pub(super) fn number(self, tried: &str, reading: &Reading) -> Result<i64, Trouble> {
        let usage =
            |came: String, remedy: String| Err(Trouble::new(Kind::Usage, tried, came, remedy));
        match reading {
            Reading::Number(number) => Ok(*number),
            Reading::Text(text) => match values::number_of_label(self.values, text) {
                Some(number) => Ok(number),
                None if self.values.is_empty() => {
                    usage(format!("{text} is no number"), "give a number".to_owned())
                }
                None => {
                    let named: Vec<&str> =
                        self.values.iter().copied().filter(|value| !value.is_empty()).collect();
                    usage(
                        format!("there is no {text}"),
                        format!("give one of {}", named.join(", ")),
                    )
                }
            },
            Reading::Real(real) => usage(format!("{real} is no integer"), "give one".to_owned()),
            Reading::Octets(octets) => {
                let number = (octets.len() == self.octets).then(|| {
                    if self.is_signed { values::signed(octets) } else { values::unsigned(octets) }
                });
                match number.flatten() {
                    Some(number) => Ok(number),
                    None => usage(
                        format!("{} octets are given", octets.len()),
                        format!("give {} octets, or a number", self.octets),
                    ),
                }
            }
        }
    }

    /// The octets of `number`.
    pub(super) fn octets(self, tried: &str, number: i64) -> Result<Vec<u8>, Trouble> {
        values::octets_of(number, self.octets, self.is_signed).ok_or_else(|| {
            let bits = (self.octets * 8).clamp(1, 63);
            let (least, most) = if self.is_signed {
                (-(1_i64 << (bits - 1)), (1_i64 << (bits - 1)) - 1)
            } else {
                (0, i64::MAX >> (63 - bits))
            };
            Trouble::new(
                Kind::Usage,
                tried,
                format!("{number} does not fit {} octets", self.octets),
                format!("give a number from {least} to {most}"),
            )
        })
    }
}
