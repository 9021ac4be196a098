//! Why parameters, a configuration or a preset are refused, and what else a person should know about
//! what the master sent.

use core::fmt;

use super::configuration::ROWS as CONFIGURATIONS;
use super::parameters::{LENGTHS, STEPS_PER_TURN, TOTAL_RESOLUTION};

/// Why something the master sent is refused. It has changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// Set_Prm has another length than the possible ones.
    Length {
        /// How many octets it has.
        octets: u8,
    },
    /// Set_Prm ends with octet 9 and switches on class 2 and scaling, which need the octets behind.
    Missing,
    /// The steps per turn are not 1 … S.
    StepsPerTurn {
        /// What was sent.
        given: u32,
        /// S.
        max: u32,
    },
    /// The total resolution is not 1 … n·M.
    TotalResolution {
        /// What was sent.
        given: u32,
        /// n, as it was sent.
        steps_per_turn: u32,
        /// M.
        revolutions: u32,
    },
    /// Chk_Cfg has another identifier than the possible ones.
    Identifier {
        /// What was sent.
        given: u8,
    },
    /// Chk_Cfg has no identifier, or several.
    Identifiers {
        /// How many.
        count: u8,
    },
    /// The preset is not 0 … T−1.
    Preset {
        /// What was sent.
        given: u32,
        /// T−1.
        max: u32,
    },
    /// There is no position to preset: the SSI line has brought no word since power-up, or it is at
    /// fault and the position is only held (decision).
    NoPosition,
}

/// Something about what the master sent that is no reason to refuse it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Remark {
    /// Octet 9 of Set_Prm has reserved bits set.
    ReservedBits {
        /// Which.
        bits: u8,
    },
    /// One of the reserved octets of Set_Prm is not 0.
    ReservedOctet {
        /// The first such octet.
        octet: u8,
        /// What it is.
        value: u8,
    },
    /// Scaling is switched on, and class 2 is off.
    ScalingWithoutClass2,
    /// The configuration carries one word, and the position may not fit.
    OneWord {
        /// How many bits the highest position has.
        bits: u8,
    },
    /// The configuration carries presets, and class 2 is off.
    PresetsIgnored,
    /// The clock bit of the preset is set since the beginning of the data exchange.
    ClockBitSet,
    /// The offset kept in memory belongs to these parameters and is in force.
    OffsetInForce {
        /// The offset in steps.
        offset: i32,
    },
    /// The offset kept in memory belongs to other parameters and is not in force.
    OffsetSetAside {
        /// The offset in steps.
        offset: i32,
    },
}

impl Refusal {
    /// What is refused.
    const fn subject(self) -> &'static str {
        match self {
            Self::Length { .. }
            | Self::Missing
            | Self::StepsPerTurn { .. }
            | Self::TotalResolution { .. } => "parameters",
            Self::Identifier { .. } | Self::Identifiers { .. } => "configuration",
            Self::Preset { .. } | Self::NoPosition => "preset",
        }
    }

    /// Writes it with what is refused at the head, as events are told.
    pub(crate) fn tell(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} refused: {self}", self.subject())
    }
}

impl Remark {
    /// Whether the data that the master gets, or its presets, are not what it may expect.
    pub(crate) const fn is_trouble(self) -> bool {
        matches!(
            self,
            Self::OneWord { .. }
                | Self::PresetsIgnored
                | Self::ClockBitSet
                | Self::ScalingWithoutClass2
        )
    }
}

impl fmt::Display for Refusal {
    /// What was sent and what is allowed, as a sentence without a full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (steps, total) = (STEPS_PER_TURN.octets, TOTAL_RESOLUTION.octets);
        match *self {
            Self::Length { octets } => {
                let [shortest, short, long, longest] = LENGTHS;
                write!(
                    f,
                    "Set_Prm has {octets} octets: {shortest}, {short}, {long} or {longest} are \
                     possible"
                )
            }
            Self::Missing => write!(
                f,
                "Set_Prm octets {}–{} missing: octet 9 switches on class 2 and scaling, which need \
                 them",
                steps.first, total.last
            ),
            Self::StepsPerTurn { given: 0, max } => {
                write!(f, "Set_Prm {steps}: steps per turn 0; 1 to {max} are possible")
            }
            Self::StepsPerTurn { given, max } => {
                write!(f, "Set_Prm {steps}: steps per turn {given} exceeds {max}")
            }
            Self::TotalResolution { given, steps_per_turn, revolutions } => {
                let max = u64::from(steps_per_turn) * u64::from(revolutions);
                if given == 0 {
                    return write!(
                        f,
                        "Set_Prm {total}: total resolution 0; 1 to {steps_per_turn} × \
                         {revolutions} = {max} are possible"
                    );
                }
                write!(
                    f,
                    "Set_Prm {total}: total resolution {given} exceeds {steps_per_turn} × \
                     {revolutions} = {max}"
                )
            }
            Self::Identifier { given } => {
                write!(f, "Chk_Cfg has identifier {given:02X}h: ")?;
                possible_identifiers(f)
            }
            Self::Identifiers { count } => {
                write!(f, "Chk_Cfg has {count} identifiers: one of ")?;
                possible_identifiers(f)
            }
            Self::Preset { given, max } => write!(f, "{given} is not 0 to {max}"),
            Self::NoPosition => {
                f.write_str("the SSI line brings no position now that could be preset")
            }
        }
    }
}

fn possible_identifiers(f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let last = CONFIGURATIONS.len() - 1;
    for (place, row) in CONFIGURATIONS.iter().enumerate() {
        let before = match place {
            0 => "",
            _ if place == last => " or ",
            _ => ", ",
        };
        write!(f, "{before}{:02X}h", row.identifier)?;
    }
    f.write_str(" is possible")
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReservedBits { bits } => {
                write!(f, "Set_Prm octet 9: the reserved bits {bits:02X}h are ignored")
            }
            Self::ReservedOctet { octet, value } => {
                write!(f, "Set_Prm octet {octet}: reserved, {value:02X}h is ignored")
            }
            Self::ScalingWithoutClass2 => f.write_str(
                "Set_Prm octet 9: scaling is on and class 2 off, so the position is not scaled",
            ),
            Self::OneWord { bits } => {
                write!(f, "position needs {bits} bits, 16 are sent: choose two words")
            }
            Self::ClockBitSet => f.write_str(
                "the clock bit of the preset is set since the start: send it as 0 first",
            ),
            Self::PresetsIgnored => {
                f.write_str("presets are ignored: class 2 is off (Set_Prm octet 9 bit 1)")
            }
            Self::OffsetInForce { offset } => {
                write!(f, "the kept offset {offset} is in force: it belongs to these parameters")
            }
            Self::OffsetSetAside { offset } => write!(
                f,
                "the kept offset {offset} is not in force: it belongs to other parameters; a new \
                 preset overwrites it"
            ),
        }
    }
}

impl core::error::Error for Refusal {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_refusal_names_the_octets_what_they_say_and_what_is_allowed() {
        let said = [
            (Refusal::Length { octets: 16 }, "Set_Prm has 16 octets: 7, 9, 17 or 25 are possible"),
            (
                Refusal::Missing,
                "Set_Prm octets 10–17 missing: octet 9 switches on class 2 and scaling, which \
                 need them",
            ),
            (
                Refusal::StepsPerTurn { given: 8_193, max: 8_192 },
                "Set_Prm octets 10–13: steps per turn 8193 exceeds 8192",
            ),
            (
                Refusal::TotalResolution {
                    given: 536_870_912,
                    steps_per_turn: 3_600,
                    revolutions: 65_536,
                },
                "Set_Prm octets 14–17: total resolution 536870912 exceeds 3600 × 65536 = 235929600",
            ),
            (
                Refusal::TotalResolution { given: 0, steps_per_turn: 100, revolutions: 1 },
                "Set_Prm octets 14–17: total resolution 0; 1 to 100 × 1 = 100 are possible",
            ),
            (
                Refusal::Identifier { given: 0x55 },
                "Chk_Cfg has identifier 55h: D1h, F1h, D0h or F0h is possible",
            ),
            (
                Refusal::Identifiers { count: 2 },
                "Chk_Cfg has 2 identifiers: one of D1h, F1h, D0h or F0h is possible",
            ),
            (Refusal::Preset { given: 5_000, max: 4_095 }, "5000 is not 0 to 4095"),
        ];
        for (refusal, text) in said {
            assert_eq!(refusal.to_string(), text);
        }
        assert_eq!(
            Remark::OneWord { bits: 29 }.to_string(),
            "position needs 29 bits, 16 are sent: choose two words"
        );
    }
}
