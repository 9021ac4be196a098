//! What PROFIBUS traffic tells of encoders.

use std::collections::BTreeMap;

use codewheel_capture::{ProfibusSaid, Timestamp};
use codewheel_device::product::{Bus, PROFIBUS};
use codewheel_device::profibus::diagnosis::Row as Diagnosis;
use codewheel_device::profibus::parameters::{self, Row as Parameter};
use codewheel_device::profibus::{IDENT_NUMBER, configuration};
use codewheel_profibus::sap;

use super::super::take::told_revolutions;
use super::super::{Nameplate, Passport, Position, Setting};
use super::{Seen, absent, blank, number};

// Set_Prm octet 1.
const LOCK: u8 = 1 << 7;
const UNLOCK: u8 = 1 << 6;
// Slave_Diag octets 1 and 2.
const CONFIGURATION_FAULT: u8 = 1 << 2;
const PARAMETER_FAULT: u8 = 1 << 6;
const PARAMETERS_REQUIRED: u8 = 1 << 0;
/// Slave_Diag has so many octets in class 2.
const CLASS_2_OCTETS: usize = codewheel_device::profibus::diagnosis::CLASS_2_OCTETS as usize;

/// What was said on a line.
#[derive(Default)]
pub(super) struct ProfibusTraces {
    pub(super) bit_rate: Option<u32>,
    slaves: BTreeMap<u8, Slave>,
}

/// What was said of one slave.
#[derive(Default)]
struct Slave {
    first: Option<Timestamp>,
    last: Timestamp,
    ident: Option<u16>,
    /// User octets that were acknowledged, before anything tells whether they were liked.
    sent: Option<Vec<u8>>,
    /// The identifiers that were acknowledged, likewise.
    checked: Option<Vec<u8>>,
    /// The user octets in force.
    user: Option<Vec<u8>>,
    /// The identifiers in force.
    configuration: Option<Vec<u8>>,
    /// The newest whole diagnosis of a slave that has parameters.
    diagnosis: Vec<u8>,
    /// Who it is, from any diagnosis.
    plate_diagnosis: Vec<u8>,
    offset: Option<i64>,
    preset: Option<i64>,
    /// The clock of the preset as it was last; 1 at the beginning, as the slave takes it.
    clock: Option<bool>,
    seen: Seen,
}

impl ProfibusTraces {
    pub(super) fn take_in(&mut self, at: Timestamp, said: &ProfibusSaid<'_>) {
        let slave = self.slaves.entry(said.slave).or_default();
        slave.first.get_or_insert(at);
        slave.last = at;
        match said.sap {
            Some(sap::SET_PARAMETERS) => slave.parameterized(said.request),
            Some(sap::CHECK_CONFIGURATION) => slave.checked = Some(said.request.to_vec()),
            Some(sap::SLAVE_DIAGNOSIS) => slave.diagnosed(said.response),
            None => slave.exchanged(at, said.request, said.response),
            Some(_) => {}
        }
    }

    pub(super) fn passports(&self, program: &str) -> Vec<Passport> {
        let ours = self.slaves.iter().filter(|(_, slave)| slave.ident == Some(IDENT_NUMBER));
        ours.map(|(address, slave)| slave.passport(*address, self.bit_rate, program)).collect()
    }
}

impl Slave {
    fn parameterized(&mut self, data: &[u8]) {
        let &[status, _, _, _, high, low, _, ref user @ ..] = data else { return };
        // A slave that is let go looks at nothing else in it.
        if status & LOCK != 0 && status & UNLOCK == 0 {
            self.ident = Some(u16::from_be_bytes([high, low]));
            self.sent = Some(user.to_vec());
        }
    }

    fn diagnosed(&mut self, data: &[u8]) {
        let &[first, second, _, _, high, low, ..] = data else { return };
        self.ident = Some(u16::from_be_bytes([high, low]));
        self.plate_diagnosis = data.to_vec();
        if first & (PARAMETER_FAULT | CONFIGURATION_FAULT) != 0 || second & PARAMETERS_REQUIRED != 0
        {
            (self.sent, self.checked, self.clock) = (None, None, None);
            return;
        }
        if let Some(user) = self.sent.take() {
            self.user = Some(user);
        }
        self.diagnosis = data.to_vec();
        if let Some(offset) = self.diagnosed_number("offset") {
            self.offset = Some(offset);
        }
    }

    fn diagnosed_number(&self, key: &str) -> Option<i64> {
        Diagnosis::find(key)?.number_in(&self.diagnosis)
    }

    fn exchanged(&mut self, at: Timestamp, outputs: &[u8], inputs: &[u8]) {
        if let Some(user) = self.sent.take() {
            self.user = Some(user);
        }
        if let Some(identifiers) = self.checked.take() {
            self.configuration = Some(identifiers);
        }
        let preset = match *outputs {
            [a, b, c, d] => Some((u32::from_be_bytes([a & 0x7F, b, c, d]), a & 0x80 != 0)),
            [high, low] => Some((u16::from_be_bytes([high & 0x7F, low]).into(), high & 0x80 != 0)),
            _ => None,
        };
        if let Some((value, clock)) = preset {
            if clock && self.clock == Some(false) {
                self.preset = Some(value.into());
                // Until the next diagnosis.
                self.offset = None;
                self.seen = Seen::default();
            }
            self.clock = Some(clock);
        }
        match *inputs {
            [a, b, c, d] => self.seen.add(at, u32::from_be_bytes([a, b, c, d])),
            [high, low] => self.seen.add(at, u16::from_be_bytes([high, low]).into()),
            _ => {}
        }
    }

    /// A parameter: as it was sent, or as the diagnosis tells what is in force.
    fn parameter(&self, row: &Parameter) -> Option<u32> {
        if let Some(user) = &self.user {
            // The shortest Set_Prm asks for CW, class 1, without scaling.
            let is_bit = matches!(row.field, parameters::Field::Bit(_));
            return row.read(user).or_else(|| is_bit.then_some(0));
        }
        let status = || self.diagnosed_number("operating-status");
        match row.key {
            "direction" => status().map(|status| (status & 1) as u32),
            "scaling" => status().map(|status| (status >> 3 & 1) as u32),
            "class-2" if !self.diagnosis.is_empty() => {
                Some((self.diagnosis.len() >= CLASS_2_OCTETS).into())
            }
            "steps-per-turn" | "total-resolution" => {
                self.diagnosed_number(row.key).and_then(|number| u32::try_from(number).ok())
            }
            _ => None,
        }
    }

    fn plate(&self) -> Nameplate {
        let told = |key: &str| Diagnosis::find(key)?.number_in(&self.plate_diagnosis);
        let disc = told("singleturn-resolution").and_then(|disc| u32::try_from(disc).ok());
        let turns = told("revolutions").and_then(told_revolutions);
        let models = PROFIBUS.iter().filter(|product| {
            let geometry = product.encoder.geometry;
            disc.is_some_and(|disc| disc == geometry.singleturn_resolution())
                && turns.is_some_and(|turns| turns == geometry.revolutions())
        });
        let firmware = told("software-version");
        Nameplate {
            models: models.collect(),
            product_code: self.ident,
            firmware: firmware.map(|v| format!("{:x}.{:02x}", v >> 8 & 0xFF, v & 0xFF)),
            singleturn_resolution: disc,
            revolutions: turns,
            ..Nameplate::default()
        }
    }

    fn passport(&self, address: u8, bit_rate: Option<u32>, program: &str) -> Passport {
        let mut passport = blank(Bus::Profibus, address, bit_rate, self.last, program);
        passport.nameplate = self.plate();
        for row in parameters::ROWS {
            // Without class 2 and scaling, n and T are sent in vain.
            let counts = row.class == 1 || !passport.is_unscaled();
            if let Some(value) = self.parameter(row).filter(|_| counts) {
                passport.settings.push(setting(row, value));
            }
        }
        passport.project.user_parameters.clone_from(&self.user);
        passport.project.configuration.clone_from(&self.configuration);
        let total = passport.total_in_force();
        passport.position = Position {
            preset: self.preset,
            offset: self.offset,
            steps: self.seen.last.filter(|_| !self.is_cut_short(total)),
            at_rest: self.seen.at_rest(self.first),
        };
        let plate = &passport.nameplate;
        let mut missing = absent([
            ("identity.singleturn-resolution", plate.singleturn_resolution.is_some()),
            ("identity.firmware", plate.firmware.is_some()),
        ]);
        let unknown = parameters::ROWS.iter().filter(|row| {
            passport.setting(row.key).is_none() && (row.class == 1 || !passport.is_unscaled())
        });
        missing.extend(unknown.map(|row| format!("settings.{}", row.key)));
        missing.extend(absent([
            ("position.offset", passport.position.offset.is_some()),
            ("position.steps", passport.position.steps.is_some()),
            ("position.at-rest", passport.position.at_rest.is_some()),
            ("project.configuration", passport.project.configuration.is_some()),
        ]));
        passport.absent = missing;
        passport.derive_project();
        passport
    }

    /// Whether only the low word of the position is sent, and that is not all of it.
    fn is_cut_short(&self, total: Option<u32>) -> bool {
        let row = self.configuration.as_deref().and_then(|ids| configuration::Row::judge(ids).ok());
        row.is_some_and(|row| row.inputs == 2) && total.is_none_or(|total| total > 1 << 16)
    }
}

fn setting(row: &Parameter, value: u32) -> Setting {
    let label = usize::try_from(value).ok().and_then(|value| row.values.get(value)).copied();
    let note = match label.unwrap_or(row.unit) {
        "" => row.name.to_owned(),
        before => format!("{before}: {}", row.name),
    };
    number(row.key, value.into(), note)
}
