//! The parameters of Set_Prm that a session has chosen.

use codewheel_device::profibus::parameters::{
    CLASS_2, COMMISSIONING, DIRECTION, Field, ROWS, Row, SCALING, STEPS_PER_TURN, TOTAL_RESOLUTION,
};
use codewheel_device::profibus::{IDENT_NUMBER, configuration};
use codewheel_encoder::Model;

use super::SlaveSettings;
use super::identity::Told;
use crate::Reading;

/// Octets 8 to 17 of Set_Prm, and 8 and 9, which is all of class 1.
const LONG: usize = 10;
const SHORT: usize = 2;

/// A value for each row of Set_Prm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chosen {
    user: [u8; LONG],
}

impl Chosen {
    /// What an encoder works with, as its diagnosis tells it. A short diagnosis is that of class 1,
    /// which has no scaling.
    pub(super) fn in_force(told: Told<'_>, model: Model) -> Self {
        let mut chosen = Self { user: [0; LONG] };
        for row in ROWS {
            chosen.set(row, (row.default)(model));
        }
        chosen.set(&COMMISSIONING, 0);
        chosen.set(&CLASS_2, told.is_long().into());
        chosen.set(&DIRECTION, told.is_ccw().unwrap_or(false).into());
        chosen.set(&SCALING, (told.is_long() && told.is_scaling() == Some(true)).into());
        for row in [&STEPS_PER_TURN, &TOTAL_RESOLUTION] {
            if let Some(value) = told.number(row.key).and_then(|value| u32::try_from(value).ok()) {
                chosen.set(row, value);
            }
        }
        chosen
    }

    pub(super) fn value(&self, row: &Row) -> u32 {
        row.read(&self.user).unwrap_or_default()
    }

    pub(super) fn set(&mut self, row: &Row, value: u32) {
        row.write(value, &mut self.user);
    }

    pub(super) fn is_on(&self, row: &Row) -> bool {
        self.value(row) == 1
    }

    /// Octets 8 and following of Set_Prm: in class 1, which has no scaling, 8 and 9.
    pub(super) fn user_octets(&self) -> Vec<u8> {
        let length = if self.is_on(&CLASS_2) { LONG } else { SHORT };
        self.user.iter().copied().take(length).collect()
    }

    /// The largest value that `row` takes beside the others: T is at most n·M.
    pub(super) fn largest(&self, row: &Row, model: Model) -> u32 {
        let largest = *(row.range)(model).end();
        if row.key != TOTAL_RESOLUTION.key || !self.is_on(&SCALING) {
            return largest;
        }
        largest.min(self.value(&STEPS_PER_TURN).saturating_mul(model.geometry.revolutions()))
    }

    /// What a master is told about the slave.
    pub(super) fn slave(&self, address: u8, configuration: &configuration::Row) -> SlaveSettings {
        SlaveSettings {
            address,
            ident_number: IDENT_NUMBER,
            user_parameters: self.user_octets(),
            configuration: vec![configuration.identifier],
            inputs: configuration.inputs.into(),
            outputs: configuration.outputs.into(),
            ..SlaveSettings::default()
        }
    }
}

/// The number that `reading` is for `row`: a number, or the name of one. The device judges whether it
/// takes it; here only what its octets cannot say is refused, with what they can.
pub(super) fn number_for(row: &Row, reading: &Reading) -> Result<u32, String> {
    let possible = || match row.field {
        Field::Bit(_) => {
            let names =
                (0..).zip(row.values).map(|(value, name): (u32, _)| format!("{value} ({name})"));
            format!("it takes {}", names.collect::<Vec<_>>().join(" or "))
        }
        Field::Unsigned32 { .. } => "it takes a number of 32 bits".to_owned(),
    };
    let number = match reading {
        Reading::Number(number) => u32::try_from(*number).ok(),
        Reading::Text(text) => (0..)
            .zip(row.values)
            .find_map(|(value, name)| name.eq_ignore_ascii_case(text).then_some(value))
            .or_else(|| text.parse().ok()),
        Reading::Real(_) | Reading::Octets(_) => None,
    };
    let fits = |number: &u32| !matches!(row.field, Field::Bit(_)) || *number <= 1;
    number.filter(fits).ok_or_else(possible)
}
