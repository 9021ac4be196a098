//! What can be read of a PROFIBUS encoder and set: its parameters, which are its master's, and its
//! diagnosis.

use codewheel_device::profibus::diagnosis::{self, DataType};
use codewheel_device::profibus::parameters::{
    self, CLASS_2, DIRECTION, Field, SCALING, STEPS_PER_TURN, TOTAL_RESOLUTION,
};
use codewheel_device::profibus::{IDENT_NUMBER, parameters::Row};
use codewheel_device::{Network, ProfibusEncoder};
use codewheel_encoder::{Direction, Sensor};
use codewheel_station::Instant;

use super::Profibus;
use crate::field_bus::Outfit;
use crate::{Object, ObjectGroup, Value};

/// Why settings cannot be written here.
pub(super) const NOT_SERVED: &str =
    "it belongs to the master, and no master of this plant serves the device";

/// The objects of a device; `told` are the user octets of Set_Prm that a master of this plant gives it.
pub(super) fn objects<S: Sensor>(
    outfit: &Outfit<Profibus>,
    encoder: Option<&ProfibusEncoder<S>>,
    told: Option<&[u8]>,
) -> Vec<ObjectGroup> {
    let parameters = parameters::ROWS.into_iter().map(|row| parameter(row, outfit, encoder, told));
    let diagnosis = diagnosis::ROWS.iter().map(|row| reading(row, encoder));
    vec![
        ObjectGroup { title: "Parameters, Set_Prm", objects: parameters.collect() },
        ObjectGroup { title: "Diagnosis, Slave_Diag", objects: diagnosis.collect() },
        ObjectGroup { title: "Identity", objects: vec![ident_number()] },
    ]
}

fn parameter<S: Sensor>(
    row: &'static Row,
    outfit: &Outfit<Profibus>,
    encoder: Option<&ProfibusEncoder<S>>,
    told: Option<&[u8]>,
) -> Object {
    let (minimum, maximum) = (row.range)(outfit.model()).into_inner();
    let in_force = encoder.and_then(|encoder| in_force(row, encoder));
    // What the encoder makes nothing of is known only by who sent it.
    let sent = told.and_then(|user| row.read(user));
    Object {
        key: row.key.to_owned(),
        place: format!("{} of Set_Prm", row.octets),
        title: row.name,
        data_type: match row.field {
            Field::Bit(_) => "bit",
            Field::Unsigned32 { .. } => "Unsigned32",
        },
        unit: row.unit,
        help: row.help,
        note: row.note,
        setting: true,
        why_not: told.is_none().then(|| NOT_SERVED.to_owned()),
        range: Some((minimum.into(), maximum.into())),
        values: row.values,
        value: in_force.or(sent).map(|value| Value::Number(value.into())),
        saved: None,
    }
}

/// What the encoder works with.
fn in_force<S: Sensor>(row: &Row, encoder: &ProfibusEncoder<S>) -> Option<u32> {
    let settings = encoder.encoder().settings();
    let is = |other: &Row| std::ptr::eq(row, other);
    if is(&DIRECTION) {
        Some((settings.direction == Direction::Ccw).into())
    } else if is(&SCALING) {
        Some(settings.scaling.into())
    } else if is(&STEPS_PER_TURN) {
        Some(settings.steps_per_turn)
    } else if is(&TOTAL_RESOLUTION) {
        Some(settings.total_resolution)
    } else if is(&CLASS_2) {
        match encoder.snapshot(Instant::ZERO).network {
            Network::Profibus(state) => Some(state.class_2.into()),
            Network::DeviceNet(_) => None,
        }
    } else {
        None
    }
}

fn reading<S: Sensor>(
    row: &'static diagnosis::Row,
    encoder: Option<&ProfibusEncoder<S>>,
) -> Object {
    Object {
        // Some values are told back, under the names of the parameters that set them.
        key: format!("diagnosis-{}", row.key),
        place: format!("{} of Slave_Diag", row.octets),
        title: row.name,
        data_type: match row.data_type {
            DataType::Bits => "bits",
            DataType::Unsigned => "unsigned",
            DataType::Signed => "signed",
            DataType::Version => "BCD",
            DataType::Text => "text",
        },
        unit: row.unit,
        help: row.help,
        note: "",
        setting: false,
        why_not: Some("the device tells it".to_owned()),
        range: None,
        values: &[],
        value: encoder.map(|encoder| match encoder.read(row) {
            diagnosis::Value::Number(number) => Value::Number(number),
            diagnosis::Value::Octets(octets) => {
                Value::Text(String::from_utf8_lossy(octets).into_owned())
            }
        }),
        saved: None,
    }
}

fn ident_number() -> Object {
    Object {
        key: "ident-number".to_owned(),
        place: "octets 5–6 of Slave_Diag".to_owned(),
        title: "Ident number",
        data_type: "Unsigned16",
        unit: "",
        help: "What the PROFIBUS organisation knows the product by",
        note: "",
        setting: false,
        why_not: Some("the factory has set it".to_owned()),
        range: None,
        values: &[],
        value: Some(Value::Number(IDENT_NUMBER.into())),
        saved: None,
    }
}
