//! What an encoder tells, as values with names.

use codewheel_device::profibus::parameters::{
    self, CLASS_2, COMMISSIONING, DIRECTION, FIRST_USER_OCTET, SCALING, STEPS_PER_TURN,
    TOTAL_RESOLUTION,
};
use codewheel_device::profibus::{configuration, diagnosis};
use codewheel_encoder::Model;

use super::Diagnosis;
use super::chosen::Chosen;
use super::identity::Told;
use crate::{Reading, Value};

/// What is known of an encoder.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known<'a> {
    pub(super) diagnosis: &'a Diagnosis,
    pub(super) model: Model,
    /// The parameters that were sent; `None` where another master sent them.
    pub(super) chosen: Option<&'a Chosen>,
    pub(super) configuration: Option<&'static configuration::Row>,
    pub(super) position: Option<u32>,
}

impl Known<'_> {
    /// The parameters, the diagnosis, the configuration and the position.
    pub(super) fn values(&self) -> Vec<Value> {
        let parameters = parameters::ROWS.into_iter().filter_map(|row| self.parameter(row));
        let octets = self.diagnosis.octets();
        // n and T stand in both tables.
        let is_new = |row: &&diagnosis::Row| parameters::Row::find(row.key).is_none();
        let readings = diagnosis::ROWS.iter().filter(is_new);
        let readings = readings.filter_map(|row| reading(row, &octets));
        let rest = [self.configuration(), self.position()];
        parameters.chain(readings).chain(rest.into_iter().flatten()).collect()
    }

    /// A parameter as it is in force. Class 1 has no steps per turn and no total resolution.
    fn parameter(&self, row: &'static parameters::Row) -> Option<Value> {
        let told = Told { diagnosis: self.diagnosis };
        let value = match row.key {
            key if key == DIRECTION.key => told.is_ccw()?.into(),
            key if key == SCALING.key => told.is_scaling()?.into(),
            key if key == CLASS_2.key => told.is_long().into(),
            // No diagnosis tells it.
            key if key == COMMISSIONING.key => self.chosen?.value(row).into(),
            key => told.number(key)?,
        };
        let label = usize::try_from(value).ok().and_then(|value| row.values.get(value));
        let place = match diagnosis::Row::find(row.key) {
            Some(told) => format!("{} of Set_Prm, {} of Slave_Diag", row.octets, told.octets),
            None => format!("{} of Set_Prm", row.octets),
        };
        Some(Value {
            name: row.key.to_owned(),
            place,
            title: row.name.to_owned(),
            reading: Reading::Number(value),
            label: label.map(ToString::to_string),
            unit: row.unit.to_owned(),
            writable: self.chosen.is_some(),
            setting: true,
            range: Some(self.range(row)),
            help: row.help.to_owned(),
        })
    }

    fn range(&self, row: &parameters::Row) -> (i64, i64) {
        let in_force = Chosen::in_force(Told { diagnosis: self.diagnosis }, self.model);
        let smallest = *(row.range)(self.model).start();
        (smallest.into(), in_force.largest(row, self.model).into())
    }

    fn configuration(&self) -> Option<Value> {
        let row = self.configuration?;
        Some(Value {
            place: "Chk_Cfg".to_owned(),
            title: "Configuration".to_owned(),
            label: Some(row.name.to_owned()),
            help: row.help.to_owned(),
            ..only_read("configuration", Reading::Octets(vec![row.identifier]))
        })
    }

    fn position(&self) -> Option<Value> {
        let total = Told { diagnosis: self.diagnosis }.number(TOTAL_RESOLUTION.key);
        Some(Value {
            place: "inputs of Data_Exchange".to_owned(),
            title: "Position".to_owned(),
            unit: STEPS_PER_TURN.unit.to_owned(),
            range: total.map(|total| (0, total - 1)),
            help: "Where the shaft stands".to_owned(),
            ..only_read("position", Reading::Number(self.position?.into()))
        })
    }
}

/// The octets of a slave of which nothing else is known, one by one.
pub(super) fn raw_values(diagnosis: &Diagnosis) -> Vec<Value> {
    let octets = diagnosis.octets();
    (1..=u8::MAX).zip(octets).map(|(number, octet)| raw_value(number, octet)).collect()
}

/// One octet of Slave_Diag.
pub(super) fn raw_value(number: u8, octet: u8) -> Value {
    let title = match number {
        1..=3 => format!("Station status {number}"),
        4 => "Diag.Master_Add".to_owned(),
        5 => "Ident number, high".to_owned(),
        6 => "Ident number, low".to_owned(),
        _ => "Extended diagnosis".to_owned(),
    };
    Value {
        place: format!("octet {number} of Slave_Diag"),
        title,
        ..only_read(&format!("octet/{number}"), Reading::Octets(vec![octet]))
    }
}

/// A row of the diagnosis; `None` where it ends before.
fn reading(row: &diagnosis::Row, octets: &[u8]) -> Option<Value> {
    let raw = row.octets.of(octets, 1)?;
    let reading = match row.data_type {
        diagnosis::DataType::Text => Reading::Text(String::from_utf8_lossy(raw).into_owned()),
        diagnosis::DataType::Version => Reading::Text(
            raw.iter().map(|octet| format!("{octet:02X}")).collect::<Vec<_>>().join("."),
        ),
        _ => Reading::Number(row.number_in(octets)?),
    };
    let set = match reading {
        Reading::Number(number) => row
            .bits
            .iter()
            .filter(|bit| number >> bit.bit & 1 != 0)
            .map(|bit| bit.name)
            .collect::<Vec<_>>(),
        _ => Vec::new(),
    };
    Some(Value {
        place: format!("{} of Slave_Diag", row.octets),
        title: row.name.to_owned(),
        label: (!set.is_empty()).then(|| set.join(", ")),
        unit: row.unit.to_owned(),
        help: row.help.to_owned(),
        ..only_read(row.key, reading)
    })
}

/// A value that nobody writes.
fn only_read(name: &str, reading: Reading) -> Value {
    Value {
        name: name.to_owned(),
        place: String::new(),
        title: String::new(),
        reading,
        label: None,
        unit: String::new(),
        writable: false,
        setting: false,
        range: None,
        help: String::new(),
    }
}

/// What makes the device of `chosen` in the project of another master: octets and words.
pub(super) fn for_the_project(chosen: &Chosen, data_sheet: &str) -> String {
    let octets = chosen.user_octets();
    let last = usize::from(FIRST_USER_OCTET) + octets.len() - 1;
    let hex = octets.iter().map(|octet| format!("{octet:02X}")).collect::<Vec<_>>().join(" ");
    format!(
        "the parameters belong into the project of its master, with {data_sheet}: octets \
         {FIRST_USER_OCTET} to {last} of Set_Prm are {hex}"
    )
}
