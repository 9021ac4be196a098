//! What the project of a master must say of an encoder.

use std::fmt;

use codewheel_device::product::Bus;
use codewheel_device::profibus::configuration;
use codewheel_device::profibus::parameters::{self, Field};
use serde::Serialize;

use super::Passport;

/// What the project of the master must say, since no device keeps it.
///
/// On PROFIBUS these are the parameters: they last as long as the master that sent them. On
/// DeviceNet it is how the scanner talks to the encoder; only a capture shows it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub struct Project {
    /// The GSD or EDS file.
    pub data_sheet: Option<String>,
    /// PROFIBUS: the octets of Set_Prm from octet 8 on.
    pub user_parameters: Option<Vec<u8>>,
    /// PROFIBUS: the identifiers of Chk_Cfg.
    pub configuration: Option<Vec<u8>>,
    /// DeviceNet: what the scanner allocates: `explicit`, `poll`.
    pub allocation: Vec<String>,
    /// DeviceNet: how often it expects to hear.
    pub expected_packet_rates: ExpectedPacketRates,
}

/// The expected packet rates of the connections, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ExpectedPacketRates {
    /// Of the explicit connection.
    pub explicit: Option<u16>,
    /// Of the poll connection.
    pub poll: Option<u16>,
    /// Of the change of state or cyclic connection.
    pub change_of_state: Option<u16>,
}

/// One word of Set_Prm, as configuration programs ask for it (PROFIBUS manual §8).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ProjectWord {
    /// Its first octet in Set_Prm.
    pub octet: u8,
    /// Its name in the GSD file.
    pub name: &'static str,
    /// What it must be.
    pub value: u16,
}

impl fmt::Display for ProjectWord {
    /// `octets 10–11: Measuring units per rev. hi = 0`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { octet, name, value } = self;
        write!(f, "octets {octet}–{}: {name} = {value}", octet + 1)
    }
}

impl Project {
    /// The words that the user parameters hold; none on DeviceNet.
    #[must_use]
    pub fn words(&self) -> Vec<ProjectWord> {
        let Some(user) = &self.user_parameters else { return Vec::new() };
        let mut words = Vec::new();
        for row in parameters::ROWS {
            if let (Field::Unsigned32 { words: [high, low] }, Some(value)) =
                (row.field, row.read(user))
            {
                let octet = row.octets.first;
                words.push(ProjectWord { octet, name: high, value: (value >> 16) as u16 });
                words.push(ProjectWord { octet: octet + 2, name: low, value: value as u16 });
            }
        }
        words
    }

    /// The user parameters that the settings of `passport` are; `None` where one of them is missing.
    fn user_parameters_of(passport: &Passport) -> Option<Vec<u8>> {
        let mut user = vec![0; parameters::USER_OCTETS];
        for row in parameters::ROWS {
            match passport.number(row.key) {
                Some(value) => row.write(u32::try_from(value).ok()?, &mut user),
                // Commissioning diagnostics have no effect, and without scaling n and T have none.
                None if row.class == 1 && row.key != "commissioning-diagnostics" => return None,
                None if row.class == 2 && !passport.is_unscaled() => return None,
                None => {}
            }
        }
        Some(user)
    }

    /// Whether it says anything.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for Project {
    /// One line for each thing to enter.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(sheet) = &self.data_sheet {
            writeln!(f, "data sheet {sheet}")?;
        }
        if let Some(user) = &self.user_parameters {
            writeln!(f, "user parameters (Set_Prm from octet 8 on) {}", hex(user))?;
            for row in parameters::ROWS {
                if let (Field::Bit(bit), Some(value)) = (row.field, row.read(user)) {
                    let named = row.values.get(value as usize).copied().unwrap_or_default();
                    writeln!(f, "  {} bit {bit}: {} = {named}", row.octets, row.name)?;
                }
            }
            for word in self.words() {
                writeln!(f, "  {word}")?;
            }
        }
        if let Some(identifiers) = &self.configuration {
            write!(f, "configuration (Chk_Cfg) {}", hex(identifiers))?;
            if let Ok(row) = configuration::Row::judge(identifiers) {
                write!(f, ": {}", row.name)?;
            }
            writeln!(f)?;
        }
        if !self.allocation.is_empty() {
            writeln!(f, "allocation {}", self.allocation.join(", "))?;
        }
        let rates = self.expected_packet_rates;
        for (name, rate) in [
            ("explicit", rates.explicit),
            ("poll", rates.poll),
            ("change of state or cyclic", rates.change_of_state),
        ] {
            if let Some(rate) = rate {
                writeln!(f, "expected packet rate, {name}: {rate} ms")?;
            }
        }
        Ok(())
    }
}

/// `0A 00 2F`
pub(super) fn hex(octets: &[u8]) -> String {
    let octets: Vec<String> = octets.iter().map(|octet| format!("{octet:02X}")).collect();
    octets.join(" ")
}

impl Passport {
    /// Completes the project with what follows from the rest: the data sheet where all candidates
    /// share it, the user parameters of a PROFIBUS encoder.
    pub(super) fn derive_project(&mut self) {
        let mut sheets: Vec<&str> =
            self.nameplate.models.iter().map(|product| product.data_sheet).collect();
        sheets.dedup();
        if let [sheet] = *sheets {
            self.project.data_sheet = Some(sheet.to_owned());
        }
        if self.bus == Bus::Profibus && self.project.user_parameters.is_none() {
            self.project.user_parameters = Project::user_parameters_of(self);
        }
    }
}
