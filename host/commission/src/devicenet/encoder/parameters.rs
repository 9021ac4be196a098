//! Devices by their Parameter object.

use codewheel_devicenet::explicit::{GeneralStatus, Path, Service};
use codewheel_devicenet::scanner::{
    ANSWER_TIME, PARAMETER, Parameter, ParameterWalk, Response, Walked,
};

use super::super::console::Console;
use super::super::dialogue::Answer;
use super::super::target::Place;
use super::super::{troubles, values};
use super::Encoder;
use super::access::out_of_range;
use crate::{Kind, Reading, Seat, Trouble};

impl<S: Seat<Station = Console>> Encoder<S> {
    /// Walks one instance of the Parameter object, or all; `see` gets each with the name of its
    /// value.
    pub(super) fn walk(
        &mut self,
        tried: &str,
        mut walk: ParameterWalk,
        mut see: impl FnMut(&Parameter, Option<String>),
    ) -> Result<(), Trouble> {
        while let Some(request) = walk.request() {
            let answer = self.dialogue.ask(tried, self.mac, &request, ANSWER_TIME)?;
            let response = match &answer {
                Answer::Done(data) => Response::Done(data),
                Answer::Refused(error) => Response::Refused(*error),
                Answer::TooLong => Response::TooLong,
            };
            if let Walked::Parameter(parameter) = walk.take(response) {
                let parameter = *parameter;
                let label = match self.enum_string(tried, &parameter)? {
                    None => self.scaled(tried, &parameter)?,
                    label => label,
                };
                see(&parameter, label);
            }
        }
        Ok(())
    }

    /// The name of the value that an enumerated parameter has.
    fn enum_string(
        &mut self,
        tried: &str,
        parameter: &Parameter,
    ) -> Result<Option<String>, Trouble> {
        let number = parameter.data_type.number(parameter.value.as_slice());
        let value = number.and_then(|number| u8::try_from(number).ok());
        let Some(value) = value.filter(|_| parameter.is_enumerated()) else { return Ok(None) };
        let body = [Service::GET_ENUM_STRING.0, PARAMETER, parameter.number, value];
        let octets = self.serve(tried, &body, ANSWER_TIME)?;
        let name = octets.ok().map(|octets| values::short_string(&octets));
        Ok(name.filter(|name| !name.is_empty()))
    }

    /// What a scaled parameter means in its unit. Its scaling may be values of other parameters.
    fn scaled(&mut self, tried: &str, parameter: &Parameter) -> Result<Option<String>, Trouble> {
        let number = parameter.data_type.number(parameter.value.as_slice());
        let raw = number.and_then(|number| i64::try_from(number).ok());
        let Some(raw) = raw.filter(|_| parameter.is_scaled()) else { return Ok(None) };
        let [multiplier, divisor, base, offset] = parameter.scaling;
        let offset = i64::from(offset.cast_signed());
        let mut scaling = [multiplier.into(), divisor.into(), base.into(), offset];
        for (value, link) in scaling.iter_mut().zip(parameter.scaling_links) {
            let Some(instance) = u8::try_from(link).ok().filter(|instance| *instance != 0) else {
                continue;
            };
            let path = Path { class: PARAMETER, instance, attribute: 1 };
            let octets = match self.dialogue.get(tried, self.mac, path)? {
                Answer::Done(octets) => values::signed(&octets),
                Answer::Refused(_) | Answer::TooLong => None,
            };
            let Some(linked) = octets else { return Ok(None) };
            *value = linked;
        }
        Ok(values::scaled(raw, scaling, parameter.decimals))
    }

    /// Parameter `number`.
    pub(super) fn parameter(
        &mut self,
        tried: &str,
        number: u8,
    ) -> Result<(Parameter, Option<String>), Trouble> {
        let mut found = None;
        self.walk(tried, ParameterWalk::of_one(number), |parameter, label| {
            found = Some((*parameter, label));
        })?;
        found.ok_or_else(|| troubles::refused(tried, GeneralStatus::OBJECT_DOES_NOT_EXIST.into()))
    }

    pub(super) fn write_parameter(
        &mut self,
        tried: &str,
        number: u8,
        reading: &Reading,
    ) -> Result<(), Trouble> {
        let (parameter, _) = self.parameter(tried, number)?;
        if parameter.is_read_only() {
            return Err(troubles::refused(tried, GeneralStatus::ATTRIBUTE_NOT_SETTABLE.into()));
        }
        let length = parameter.value.as_slice().len();
        let octets = match reading {
            Reading::Octets(octets) => octets.clone(),
            _ if !parameter.data_type.is_integer() => {
                let name = parameter.data_type.name().unwrap_or("of an unknown type");
                values::to_type(parameter.data_type, reading).ok_or_else(|| {
                    Trouble::new(
                        Kind::Usage,
                        tried,
                        format!("the parameter is {name}, and what is given is not"),
                        format!("give a value of that type, or its {length} octets"),
                    )
                })?
            }
            _ => {
                let is_signed = parameter.data_type.is_signed();
                let place = Place { values: &[], octets: length, is_signed };
                place.octets(tried, place.number(tried, reading)?)?
            }
        };
        let path = Path { class: PARAMETER, instance: number, attribute: 1 };
        let done = self.set(tried, path, &octets)?;
        done.map_err(|error| {
            out_of_range(tried, error, values::of_parameter(&parameter, None).range)
        })
    }
}
