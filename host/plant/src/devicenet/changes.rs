//! Changes of the settings of a DeviceNet encoder, by its own local services.

use codewheel_device::DeviceNetEncoder;
use codewheel_device::devicenet::rows::Row;
use codewheel_encoder::Sensor;
use codewheel_station::Instant;

use crate::field_bus::{Begun, Change};
use crate::object::number_of;
use crate::{Cause, Refusal};

pub(super) fn change<S: Sensor>(
    encoder: &mut DeviceNetEncoder<S>,
    now: Instant,
    change: Change<'_>,
) -> Result<Begun, Refusal> {
    let refused = |what: &str, error: codewheel_devicenet::explicit::Error| {
        let text = format!("the device refuses to {what}: {error}; nothing was changed");
        Refusal::new(Cause::State, text)
    };
    match change {
        Change::Write(key, value) => {
            let row = Row::with_key(key).ok_or_else(|| crate::object::unknown(key))?;
            let number = number_of(value, row.values).map_err(|allowed| {
                let text = format!("cannot set {key} to {value}: {allowed}; nothing was changed");
                Refusal::new(Cause::Value, text)
            })?;
            write(encoder, now, row, number)
        }
        Change::Preset(value) => {
            let row = Row::with_key("preset").ok_or_else(|| crate::object::unknown("preset"))?;
            write(encoder, now, row, value.into())
        }
        Change::Save => {
            let block = encoder.encoder().block();
            encoder.save(now).map_err(|error| refused("save", error))?;
            Ok(Begun::Saving(block))
        }
        Change::Restore => {
            encoder.restore(now).map_err(|error| refused("restore", error))?;
            Ok(Begun::Done("the saved settings are in force".into()))
        }
        Change::Reset => {
            encoder.reset(now).map_err(|error| refused("reset", error))?;
            Ok(Begun::Done("the settings of a new device are in force, unsaved".into()))
        }
    }
}

fn write<S: Sensor>(
    encoder: &mut DeviceNetEncoder<S>,
    now: Instant,
    row: &Row,
    value: i64,
) -> Result<Begun, Refusal> {
    let key = row.key;
    match encoder.write(now, row, value) {
        Ok(()) => {
            Ok(Begun::Done(format!("{key} is {value} until the next power-up, unless it is saved")))
        }
        Err(refusal) => {
            let text = format!("cannot set {key} to {value}: {refusal}; nothing was changed");
            Err(Refusal::new(Cause::Value, text))
        }
    }
}
