//! Who a slave is, and where it stands, by what its diagnosis says.

use codewheel_device::Product;
use codewheel_device::product::PROFIBUS;
use codewheel_device::profibus::IDENT_NUMBER;
use codewheel_device::profibus::diagnosis::Row;

use super::Diagnosis;
use crate::{Identity, Owner};

/// Slave_Diag octet 1.
const STATION_NOT_READY: u8 = 1 << 1;
const CONFIGURATION_FAULT: u8 = 1 << 2;
const PARAMETER_FAULT: u8 = 1 << 6;
/// Slave_Diag octet 2.
const PARAMETERS_REQUIRED: u8 = 1 << 0;

/// The low cell, in the word of the supported warnings.
const CELL: i64 = 1 << 5;

/// What a diagnosis says of an encoder (PROFIBUS manual §7).
#[derive(Clone, Copy, Debug)]
pub(super) struct Told<'a> {
    pub(super) diagnosis: &'a Diagnosis,
}

impl Diagnosis {
    /// Whether the ident number is that of the encoders.
    #[must_use]
    pub const fn is_encoder(&self) -> bool {
        self.ident_number == IDENT_NUMBER
    }

    /// All its octets, as they stand in Slave_Diag from octet 1 on.
    #[must_use]
    pub fn octets(&self) -> Vec<u8> {
        let mut octets = self.status.to_vec();
        octets.push(self.master.unwrap_or(0xFF));
        octets.extend(self.ident_number.to_be_bytes());
        octets.extend_from_slice(&self.extended);
        octets
    }

    /// To whom the slave belongs.
    #[must_use]
    pub fn owner(&self) -> Owner {
        self.master.map_or(Owner::Nobody, Owner::Master)
    }

    /// Whether it exchanges data, as far as it depends on the slave.
    #[must_use]
    pub const fn is_ready(&self) -> bool {
        let [first, second, _] = self.status;
        first & (STATION_NOT_READY | CONFIGURATION_FAULT | PARAMETER_FAULT) == 0
            && second & PARAMETERS_REQUIRED == 0
            && self.master.is_some()
    }

    /// Where the slave stands, in a few words.
    #[must_use]
    pub const fn state(&self) -> &'static str {
        let [first, second, _] = self.status;
        if first & PARAMETER_FAULT != 0 {
            "refused its parameters"
        } else if first & CONFIGURATION_FAULT != 0 {
            "refused its configuration"
        } else if second & PARAMETERS_REQUIRED != 0 {
            "waits for parameters"
        } else if first & STATION_NOT_READY != 0 {
            "waits for a configuration"
        } else if self.master.is_some() {
            "exchanges data"
        } else {
            "ready"
        }
    }

    /// What the lamp of an encoder shows by it (PROFIBUS manual §9.5); `None` for other devices.
    #[must_use]
    pub fn lamp(&self) -> Option<&'static str> {
        if !self.is_encoder() {
            return None;
        }
        let told = Told { diagnosis: self };
        let [first, _, _] = self.status;
        Some(if told.alarm() == Some(true) {
            // One bit stands for both.
            "red (position error) or red flashing 5 Hz (preset out of range)"
        } else if first & (PARAMETER_FAULT | CONFIGURATION_FAULT) != 0 {
            "red flashing 1 Hz"
        } else if self.is_ready() {
            "green"
        } else {
            "yellow"
        })
    }

    /// Who the slave says it is. The products of the catalogue are those of its resolution, and where
    /// the long diagnosis tells, of its cell.
    #[must_use]
    pub fn identity(&self) -> Identity {
        let told = Told { diagnosis: self };
        Identity {
            product_code: self.ident_number,
            firmware: told.firmware(),
            models: told.models(),
            ..Identity::default()
        }
    }
}

impl Told<'_> {
    /// The number of the row with this key, where this diagnosis has it.
    pub(super) fn number(self, key: &str) -> Option<i64> {
        if !self.diagnosis.is_encoder() {
            return None;
        }
        Row::find(key)?.number_in(&self.diagnosis.octets())
    }

    fn bit(self, key: &str, bit: u8) -> Option<bool> {
        Some(self.number(key)? >> bit & 1 != 0)
    }

    pub(super) fn alarm(self) -> Option<bool> {
        self.bit("alarms", 0)
    }

    pub(super) fn warning(self) -> Option<bool> {
        Some(self.number("warnings")? & CELL != 0)
    }

    pub(super) fn is_ccw(self) -> Option<bool> {
        self.bit("operating-status", 0)
    }

    pub(super) fn is_scaling(self) -> Option<bool> {
        self.bit("operating-status", 3)
    }

    /// Whether it is the long one, of class 2.
    pub(super) fn is_long(self) -> bool {
        self.number("steps-per-turn").is_some()
    }

    fn firmware(self) -> Option<String> {
        let version = self.number("software-version")?;
        Some(format!("{:X}.{:02X}", version >> 8 & 0xFF, version & 0xFF))
    }

    pub(super) fn models(self) -> Vec<&'static Product> {
        let (Some(steps), Some(turns)) =
            (self.number("singleturn-resolution"), self.number("revolutions"))
        else {
            return Vec::new();
        };
        let cell = self.number("supported-warnings").map(|warnings| warnings & CELL != 0);
        let is_it = |product: &&Product| {
            i64::from(product.encoder.geometry.singleturn_resolution()) == steps
                && i64::from(product.number_of_revolutions()) == turns
                && cell.is_none_or(|cell| product.encoder.lithium_cell == cell)
        };
        PROFIBUS.iter().filter(is_it).collect()
    }

    /// What it works with, in a few words.
    pub(super) fn in_force(self) -> Option<String> {
        let direction = if self.is_ccw()? { "CCW" } else { "CW" };
        let Some((steps, total)) =
            self.number("steps-per-turn").zip(self.number("total-resolution"))
        else {
            return Some(format!("{direction}, class 1"));
        };
        let scaling = if self.is_scaling()? { "" } else { ", scaling off" };
        Some(format!("{direction}, {steps} steps per turn, {total} in all{scaling}"))
    }
}
