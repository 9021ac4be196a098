//! The parameters of Set_Prm from octet 9 on: one row each (PROFIBUS manual §6.1).
//!
//! From these rows the slave reads what its master sent, and a master, a GSD file and all that shows
//! or documents a parameter can grow. Octets 1 to 8 belong to the standard and to the stack.

use core::ops::RangeInclusive;

use codewheel_encoder::{Direction, Model, Refusal as SettingsRefusal, Settings};

use super::octets::{Octets, number};
use super::{Refusal, Remark};

/// The lengths of Set_Prm that are possible: the standard's part alone, then as far as octet 9, 17
/// and 25 (decision: the manual ends with octet 17, the vendor's GSD file sends 18 user octets).
pub const LENGTHS: [u8; 4] = [7, 9, 17, 25];

/// The number of Set_Prm's first user octet.
pub const FIRST_USER_OCTET: u8 = 8;

/// How many user octets the longest Set_Prm has.
pub const USER_OCTETS: usize = 18;

/// The octets from 18 on, which mean nothing.
pub const RESERVED: Octets = Octets::span(18, 25);

/// What of its octets a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Field {
    /// One bit of one octet, 0 … 7.
    Bit(u8),
    /// Four octets, the highest first. GSD files give it as two words, since many configuration
    /// programs know no longer ones (PROFIBUS manual §8).
    Unsigned32 {
        /// The names of the high and the low word there.
        words: [&'static str; 2],
    },
}

/// One parameter.
#[derive(Debug)]
pub struct Row {
    /// Where it lies, counted from the first octet of Set_Prm.
    pub octets: Octets,
    /// What of them it takes.
    pub field: Field,
    /// Its name, at most 32 printable characters: the GSD file carries it.
    pub name: &'static str,
    /// Its name on the command line.
    pub key: &'static str,
    /// The unit; empty where there is none.
    pub unit: &'static str,
    /// One sentence that helps.
    pub help: &'static str,
    /// What else is worth knowing; empty where nothing is.
    pub note: &'static str,
    /// The names of the values 0, 1 where they are enumerated.
    pub values: &'static [&'static str],
    /// What a new device works with, and the GSD file proposes.
    pub default: fn(Model) -> u32,
    /// The values it takes. What the others say may narrow it: T is at most n·M.
    pub range: fn(Model) -> RangeInclusive<u32>,
    /// The device class that it belongs to.
    pub class: u8,
}

/// One of the two words a GSD file makes of an [`Unsigned32`](Field::Unsigned32).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// Its first octet in Set_Prm.
    pub octet: u8,
    /// Its name.
    pub name: &'static str,
    /// What the GSD file proposes.
    pub default: u16,
    /// What it allows.
    pub range: RangeInclusive<u16>,
}

/// Octet 9, the operating parameters.
const OPERATING: Octets = Octets::one(9);

const SWITCH: &[&str] = &["OFF", "ON"];

/// The sense of rotation.
pub static DIRECTION: Row = Row {
    octets: OPERATING,
    field: Field::Bit(0),
    name: "Sense of rotation",
    key: "direction",
    unit: "",
    help: "Position grows CW or CCW, seen looking at the flange",
    note: "Of a converter: with growing or with falling SSI values.",
    values: &["CW", "CCW"],
    default: |_| 0,
    range: |_| 0..=1,
    class: 1,
};

/// Device class 2.
pub static CLASS_2: Row = Row {
    octets: OPERATING,
    field: Field::Bit(1),
    name: "Class 2 functionality",
    key: "class-2",
    unit: "",
    help: "Scaling, preset and the long diagnosis",
    note: "Off: no scaling, no preset, no offset, whatever else is sent.",
    values: SWITCH,
    default: |_| 1,
    range: |_| 0..=1,
    class: 1,
};

/// Commissioning diagnostics.
pub static COMMISSIONING: Row = Row {
    octets: OPERATING,
    field: Field::Bit(2),
    name: "Commissioning diagnostics",
    key: "commissioning-diagnostics",
    unit: "",
    help: "Accepted, without effect",
    note: "",
    values: SWITCH,
    default: |_| 0,
    range: |_| 0..=1,
    class: 1,
};

/// The scaling function.
pub static SCALING: Row = Row {
    octets: OPERATING,
    field: Field::Bit(3),
    name: "Scaling function",
    key: "scaling",
    unit: "",
    help: "Whether steps per turn and total resolution are used",
    note: "Off: the steps and the range of the product itself. Only with class 2.",
    values: SWITCH,
    default: |_| 1,
    range: |_| 0..=1,
    class: 1,
};

/// n.
pub static STEPS_PER_TURN: Row = Row {
    octets: Octets::span(10, 13),
    field: Field::Unsigned32 {
        words: ["Measuring units per rev. hi", "Measuring units per rev. lo"],
    },
    name: "Steps per turn",
    key: "steps-per-turn",
    unit: "step",
    help: "Number of steps per turn",
    note: "",
    values: &[],
    default: |model| model.geometry.singleturn_resolution(),
    range: |model| 1..=model.geometry.singleturn_resolution(),
    class: 2,
};

/// T.
pub static TOTAL_RESOLUTION: Row = Row {
    octets: Octets::span(14, 17),
    field: Field::Unsigned32 {
        words: ["Total measuring range (units) hi", "Total measuring range (units) lo"],
    },
    name: "Total resolution",
    key: "total-resolution",
    unit: "step",
    help: "Steps over the whole measuring range: steps per turn x turns",
    note: "At most the steps per turn times the turns that the product can tell apart.",
    values: &[],
    default: |model| model.geometry.range(),
    range: |model| 1..=model.geometry.range(),
    class: 2,
};

/// All parameters, in the order of their octets and bits.
pub static ROWS: [&Row; 6] =
    [&DIRECTION, &CLASS_2, &COMMISSIONING, &SCALING, &STEPS_PER_TURN, &TOTAL_RESOLUTION];

impl Row {
    /// The row with this key.
    #[must_use]
    pub fn find(key: &str) -> Option<&'static Self> {
        ROWS.into_iter().find(|row| row.key == key)
    }

    /// The length of the shortest Set_Prm that carries it: 9 or 17.
    #[must_use]
    pub fn length(&self) -> u8 {
        LENGTHS.into_iter().find(|length| *length >= self.octets.last).unwrap_or(u8::MAX)
    }

    /// Its value in the user octets of Set_Prm, the ones from 8 on; `None` where they end before.
    #[must_use]
    pub fn read(&self, user: &[u8]) -> Option<u32> {
        let value = number(self.octets.of(user, FIRST_USER_OCTET)?) as u32;
        Some(match self.field {
            Field::Bit(bit) => value >> bit & 1,
            Field::Unsigned32 { .. } => value,
        })
    }

    /// Writes `value` into the user octets of Set_Prm; nothing where they end before.
    pub fn write(&self, value: u32, user: &mut [u8]) {
        let first = usize::from(self.octets.first - FIRST_USER_OCTET);
        let Some(octets) = user.get_mut(first..first + self.octets.count()) else { return };
        match self.field {
            Field::Bit(bit) => {
                for octet in octets {
                    *octet = *octet & !(1 << bit) | ((value & 1) as u8) << bit;
                }
            }
            Field::Unsigned32 { .. } => octets.copy_from_slice(&value.to_be_bytes()),
        }
    }

    /// The two words a GSD file makes of it; `None` for a bit.
    ///
    /// The low word is judged alone, so it takes everything as soon as the high one can be more
    /// than 0.
    #[must_use]
    pub fn words(&self, model: Model) -> Option<[Word; 2]> {
        let Field::Unsigned32 { words: [high, low] } = self.field else { return None };
        let default = (self.default)(model);
        let (minimum, maximum) = (self.range)(model).into_inner();
        let low_range = match (u16::try_from(minimum), u16::try_from(maximum)) {
            (Ok(minimum), Ok(maximum)) => minimum..=maximum,
            _ => 0..=u16::MAX,
        };
        Some([
            Word {
                octet: self.octets.first,
                name: high,
                default: (default >> 16) as u16,
                range: 0..=(maximum >> 16) as u16,
            },
            Word {
                octet: self.octets.first + 2,
                name: low,
                default: default as u16,
                range: low_range,
            },
        ])
    }
}

/// The user octets that the GSD file proposes: octet 8 without a bit, then the defaults.
#[must_use]
pub fn default_octets(model: Model) -> [u8; USER_OCTETS] {
    let mut user = [0; USER_OCTETS];
    for row in ROWS {
        row.write((row.default)(model), &mut user);
    }
    user
}

/// What a master may ask of the encoder with one Set_Prm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// Whether class 2 is on.
    pub class_2: bool,
    /// The settings that come into force.
    pub settings: Settings,
}

impl Parameters {
    /// Reads and judges the user octets of Set_Prm, the ones from 8 on, none in its shortest form:
    /// CW, class 1.
    ///
    /// Steps and range are looked at only where they are used: with class 2 and scaling on.
    ///
    /// # Errors
    /// [`Refusal`], by the limits of `model`.
    pub fn read(model: Model, user: &[u8]) -> Result<Self, Refusal> {
        let length = user.len().saturating_add(usize::from(FIRST_USER_OCTET) - 1);
        let octets = u8::try_from(length).unwrap_or(u8::MAX);
        if !LENGTHS.contains(&octets) {
            return Err(Refusal::Length { octets });
        }
        let is_on = |row: &Row| row.read(user) == Some(1);
        let direction = if is_on(&DIRECTION) { Direction::Ccw } else { Direction::Cw };
        let class_2 = is_on(&CLASS_2);
        if !class_2 || !is_on(&SCALING) {
            return Ok(Self { class_2, settings: Settings::unscaled(model, direction) });
        }
        let values = STEPS_PER_TURN.read(user).zip(TOTAL_RESOLUTION.read(user));
        let (steps_per_turn, total_resolution) = values.ok_or(Refusal::Missing)?;
        let settings = Settings { direction, steps_per_turn, total_resolution, scaling: true };
        settings.check(model).map_err(|refusal| match refusal {
            SettingsRefusal::StepsPerTurn { max } => {
                Refusal::StepsPerTurn { given: steps_per_turn, max }
            }
            _ => Refusal::TotalResolution {
                given: total_resolution,
                steps_per_turn,
                revolutions: model.geometry.revolutions(),
            },
        })?;
        Ok(Self { class_2, settings })
    }
}

/// The bits of octet 9 that no row takes.
fn reserved_bits() -> u8 {
    ROWS.into_iter().fold(0xFF, |free, row| match row.field {
        Field::Bit(bit) => free & !(1 << bit),
        Field::Unsigned32 { .. } => free,
    })
}

/// What the user octets of a Set_Prm ask for in vain.
pub(super) fn ignored(user: &[u8]) -> impl Iterator<Item = Remark> {
    let operating = OPERATING.of(user, FIRST_USER_OCTET).and_then(|octets| octets.first());
    let bits = operating.map_or(0, |octet| octet & reserved_bits());
    let reserved = RESERVED.of(user, FIRST_USER_OCTET).unwrap_or_default();
    let reserved = (RESERVED.first..).zip(reserved).find(|(_, value)| **value != 0);
    let scaled_in_vain = SCALING.read(user) == Some(1) && CLASS_2.read(user) == Some(0);
    let remarks = [
        (bits != 0).then_some(Remark::ReservedBits { bits }),
        reserved.map(|(octet, value)| Remark::ReservedOctet { octet, value: *value }),
        scaled_in_vain.then_some(Remark::ScalingWithoutClass2),
    ];
    remarks.into_iter().flatten()
}
