//! Changes of the settings of a slave, which are its master's: new parameters make it ready anew, a
//! preset goes through its outputs.

use codewheel_commission::profibus::SlaveState;
use codewheel_device::profibus::diagnosis;
use codewheel_device::profibus::parameters::{Parameters, Row, default_octets};
use codewheel_encoder::Model;
use codewheel_station::Instant;

use super::dp_master::DpMaster;
use super::presets::Presetting;
use crate::field_bus::{Begun, Change};
use crate::object::{number_of, unknown};
use crate::{Cause, Refusal, Value};

/// The user octets of Set_Prm that have a meaning, octets 8 to 17.
const USED_OCTETS: usize = 10;

impl DpMaster {
    /// Changes the settings of the slave at `place` of the plan, which measures with `model`.
    pub(super) fn change_slave(
        &mut self,
        now: Instant,
        place: usize,
        model: Model,
        change: Change<'_>,
    ) -> Result<Begun, Refusal> {
        let Some(planned) = self.planned.get(place) else { return Err(unknown("slave")) };
        let address = planned.address;
        match change {
            Change::Write(key, value) => {
                let (user, what) = self.written(address, model, key, value)?;
                self.parameterize(address, model, user, what)
            }
            Change::Restore => {
                let user = planned.user_parameters.clone();
                self.parameterize(
                    address,
                    model,
                    user,
                    "the parameters are those of the plan".into(),
                )
            }
            Change::Reset => {
                let octets = default_octets(model);
                let user = octets.get(..USED_OCTETS).unwrap_or(&octets).to_vec();
                let what = "the parameters are those that the GSD file proposes";
                self.parameterize(address, model, user, what.into())
            }
            Change::Preset(value) => {
                let outputs = planned.outputs;
                self.preset(now, address, model, outputs, value)
            }
            Change::Save => Err(Refusal::new(
                Cause::Impossible,
                "there is nothing to save: a PROFIBUS encoder keeps each preset at once, and its \
                 parameters are kept by the master, here in the plan",
            )),
        }
    }

    /// The user octets of Set_Prm with one value changed, and a sentence that says so.
    fn written(
        &self,
        address: u8,
        model: Model,
        key: &str,
        value: &Value,
    ) -> Result<(Vec<u8>, String), Refusal> {
        let refused = |allowed: &str| {
            let text = format!("cannot set {key} to {value}: {allowed}; nothing was changed");
            Refusal::new(Cause::Value, text)
        };
        let Some(row) = Row::find(key) else {
            let told = key
                .strip_prefix("diagnosis-")
                .is_some_and(|key| diagnosis::Row::find(key).is_some());
            let text = format!("cannot set {key}: the device tells it; nothing was changed");
            let told = told || key == "ident-number";
            return Err(if told { Refusal::new(Cause::Impossible, text) } else { unknown(key) });
        };
        let number = number_of(value, row.values).map_err(|allowed| refused(&allowed))?;
        let range = (row.range)(model);
        let number = u32::try_from(number).ok().filter(|number| range.contains(number));
        let number = number
            .ok_or_else(|| refused(&format!("it is {} to {}", range.start(), range.end())))?;
        let mut user = self.user_parameters(address).unwrap_or_default().to_vec();
        row.write(number, &mut user);
        if row.read(&user) != Some(number) || Parameters::read(model, &user).is_err() {
            // Class 1 sends no more than octet 9; what was not said is as in a new device.
            let octets = default_octets(model);
            user.extend(octets.get(user.len()..USED_OCTETS).unwrap_or_default());
            row.write(number, &mut user);
        }
        if let Err(refusal) = Parameters::read(model, &user) {
            return Err(refused(&refusal.to_string()));
        }
        Ok((user, format!("{key} is {value}, in the parameters of the master")))
    }

    /// Makes the slave ready anew.
    fn parameterize(
        &mut self,
        address: u8,
        model: Model,
        user: Vec<u8>,
        what: String,
    ) -> Result<Begun, Refusal> {
        if let Err(refusal) = Parameters::read(model, &user) {
            let text = format!("the device would refuse this: {refusal}; nothing was changed");
            return Err(Refusal::new(Cause::Value, text));
        }
        let answers = self
            .master
            .station()
            .slave(address)
            .is_some_and(|slave| slave.state != SlaveState::Absent);
        self.master
            .station_mut()
            .set_user_parameters(address, user)
            .map_err(|error| Refusal::new(Cause::Failed, error.to_string()))?;
        Ok(if answers {
            Begun::Parameterizing(what)
        } else {
            Begun::Done(format!(
                "{what}; the device does not answer now and gets them when it does"
            ))
        })
    }

    fn preset(
        &mut self,
        now: Instant,
        address: u8,
        model: Model,
        outputs: u8,
        value: u32,
    ) -> Result<Begun, Refusal> {
        let refused = |cause, why: &str| {
            let text = format!("cannot preset {value}: {why}; nothing was changed");
            Err(Refusal::new(cause, text))
        };
        let bits = match outputs {
            4 => 31,
            2 => 15,
            _ => {
                let why = "the configuration has no outputs: choose F1 or F0 in the plan";
                return refused(Cause::State, why);
            }
        };
        let parameters = self.user_parameters(address).map(|user| Parameters::read(model, user));
        let Some(Ok(parameters)) = parameters else {
            return refused(Cause::State, "the master has no parameters that the device takes");
        };
        if !parameters.class_2 {
            return refused(Cause::State, "class 2 is off: set class-2 to ON first");
        }
        let max = parameters.settings.total_in_force(model).saturating_sub(1).min((1 << bits) - 1);
        if value > max {
            return refused(Cause::Value, &format!("it is 0 to {max}"));
        }
        if self
            .master
            .station()
            .slave(address)
            .is_none_or(|slave| slave.state != SlaveState::DataExchange)
        {
            return refused(Cause::State, "the master exchanges no data with the device now");
        }
        let id = self.next_preset;
        self.next_preset += 1;
        let known = self.agenda.iter().position(|presetting| presetting.address == address);
        let place = known.unwrap_or_else(|| {
            self.agenda.push(Presetting::new(address, outputs, &[]));
            self.agenda.len() - 1
        });
        if let Some(presetting) = self.agenda.get_mut(place) {
            presetting.ask(now, value, id);
        }
        Ok(Begun::Presetting(id, value))
    }
}
