//! The buses of a capture.

use std::fmt;

use codewheel_station::can::BitRate;
use codewheel_station::rs485::BaudRate;

/// What a bus carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Medium {
    /// CAN frames.
    DeviceNet,
    /// Telegrams.
    Profibus,
}

impl fmt::Display for Medium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::DeviceNet => "DeviceNet",
            Self::Profibus => "PROFIBUS",
        })
    }
}

/// A bus of a capture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bus {
    /// Its name, one word without blanks; formats that know numbers alone count the buses from 1.
    pub name: String,
    /// What it carries.
    pub medium: Medium,
    /// Its rate; `None` where the file does not say.
    pub bits_per_second: Option<u32>,
}

impl Bus {
    /// A DeviceNet segment. Blanks in its name become underscores.
    #[must_use]
    pub fn devicenet(name: &str, rate: BitRate) -> Self {
        Self {
            name: word(name),
            medium: Medium::DeviceNet,
            bits_per_second: Some(rate.bits_per_second()),
        }
    }

    /// A PROFIBUS line. Blanks in its name become underscores.
    #[must_use]
    pub fn profibus(name: &str, rate: BaudRate) -> Self {
        Self {
            name: word(name),
            medium: Medium::Profibus,
            bits_per_second: Some(rate.bits_per_second()),
        }
    }
}

/// `name` as formats take it that separate words by blanks, and as a terminal can show it.
pub(crate) fn word(name: &str) -> String {
    let joined: Vec<&str> = name.split(|c: char| c.is_whitespace() || c.is_control()).collect();
    let joined = joined.join("_");
    if joined.is_empty() { "bus".to_owned() } else { joined }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_one_word_whatever_a_plant_calls_its_bus() {
        assert_eq!(Bus::devicenet("hall 3\tleft", BitRate::Kbit125).name, "hall_3_left");
        assert_eq!(Bus::profibus("", BaudRate::Mbit12).name, "bus");
    }
}
