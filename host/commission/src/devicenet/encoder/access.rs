//! Reading and writing what has a name: rows, attributes of the bus, octets.

use codewheel_device::devicenet::parameter::LINKS;
use codewheel_device::devicenet::rows::{DataType, Row};
use codewheel_devicenet::MacId;
use codewheel_devicenet::explicit::{Error, GeneralStatus, Path, Service, class};
use codewheel_devicenet::scanner::{ANSWER_TIME, PARAMETER};

use super::super::console::Console;
use super::super::objects::{Attribute, Form};
use super::super::target::{Place, Target};
use super::super::{troubles, values};
use super::{Encoder, told};
use crate::{Reading, Seat, Trouble, Value};

/// Attributes of a parameter.
const MINIMUM: u8 = 10;
const MAXIMUM: u8 = 11;
/// Class 2Fh, attributes 8 and 11.
const TOTAL_RESOLUTION: u8 = 8;
const COS_DELTA: u8 = 11;

impl<S: Seat<Station = Console>> Encoder<S> {
    /// The octets of an attribute; `Err` within where the device refuses.
    fn read(&mut self, tried: &str, path: Path) -> Result<Result<Vec<u8>, Error>, Trouble> {
        let answer = self.dialogue.get(tried, self.mac, path)?;
        told(tried, answer)
    }

    fn read_number(&mut self, tried: &str, row: &Row) -> Result<Option<i64>, Trouble> {
        let octets = self.read(tried, values::path_of(row))?;
        Ok(octets.ok().and_then(|octets| values::number_of_row(row, &octets)))
    }

    /// The smallest and the largest value that `row` takes now, as the device says.
    fn range(&mut self, tried: &str, row: &Row) -> Result<Option<(i64, i64)>, Trouble> {
        if row.range.is_none() {
            return Ok(None);
        }
        if let Some(last) = row.values.len().checked_sub(1) {
            return Ok(Some((0, last as i64)));
        }
        if row.attribute == COS_DELTA {
            // No parameter is linked to it.
            let Some(total) = Row::find(TOTAL_RESOLUTION) else { return Ok(None) };
            return Ok(self.read_number(tried, total)?.map(|total| (1, total)));
        }
        let place = LINKS.iter().position(|attribute| *attribute == row.attribute);
        let Some(instance) = place.and_then(|place| u8::try_from(place + 1).ok()) else {
            return Ok(None);
        };
        let mut limit = |attribute| -> Result<Option<i64>, Trouble> {
            let octets = self.read(tried, Path { class: PARAMETER, instance, attribute })?;
            Ok(octets.ok().and_then(|octets| values::number_of_row(row, &octets)))
        };
        Ok(limit(MINIMUM)?.zip(limit(MAXIMUM)?))
    }

    pub(super) fn row_value(
        &mut self,
        tried: &str,
        row: &Row,
    ) -> Result<Result<Value, Error>, Trouble> {
        match self.read(tried, values::path_of(row))? {
            Ok(octets) => Ok(Ok(values::of_row(row, &octets, self.range(tried, row)?))),
            Err(error) => Ok(Err(error)),
        }
    }

    pub(super) fn attribute_value(
        &mut self,
        tried: &str,
        attribute: &Attribute,
    ) -> Result<Result<Value, Error>, Trouble> {
        let octets = match attribute.form {
            Form::AssemblyPath { choice } => {
                self.with_connection(tried, choice, |session| session.read(tried, attribute.path))?
            }
            _ => self.read(tried, attribute.path)?,
        };
        Ok(octets.map(|octets| values::of_attribute(attribute, &octets)))
    }

    /// Does something while the I/O connection of `choice` exists, not yet established.
    fn with_connection<T>(
        &mut self,
        tried: &str,
        choice: u8,
        act: impl FnOnce(&mut Self) -> Result<Result<T, Error>, Trouble>,
    ) -> Result<Result<T, Error>, Trouble> {
        self.leave_io(tried)?;
        let own = self.dialogue.console().mac().map_or(0, MacId::value);
        let allocate = [Service::ALLOCATE.0, class::DEVICENET, 1, choice, own];
        let release = [Service::RELEASE.0, class::DEVICENET, 1, choice];
        let result = match self.serve(tried, &allocate, ANSWER_TIME) {
            Ok(Ok(_)) => act(self),
            Ok(Err(error)) => return Ok(Err(error)),
            // It may have been done, though nobody has seen the answer.
            Err(trouble) => Err(trouble),
        };
        let result = result.and_then(|result| {
            let released = self.serve(tried, &release, ANSWER_TIME)?;
            released.map_err(|error| troubles::refused(tried, error))?;
            Ok(result)
        });
        if result.is_err() {
            let _ = self.serve(tried, &release, ANSWER_TIME);
        }
        result
    }

    pub(super) fn set(
        &mut self,
        tried: &str,
        path: Path,
        octets: &[u8],
    ) -> Result<Result<(), Error>, Trouble> {
        let answer = self.dialogue.set(tried, self.mac, path, octets)?;
        Ok(told(tried, answer)?.map(|_| ()))
    }

    pub(super) fn target_value(&mut self, tried: &str, target: Target) -> Result<Value, Trouble> {
        let value = match target {
            Target::Row(row) => self.row_value(tried, row)?,
            Target::Attribute(attribute) => self.attribute_value(tried, attribute)?,
            Target::Parameter(number) => {
                let (parameter, label) = self.parameter(tried, number)?;
                Ok(values::of_parameter(&parameter, label))
            }
            Target::Octets(path) => {
                self.read(tried, path)?.map(|octets| values::of_path(path, &octets))
            }
        };
        value.map_err(|error| troubles::refused(tried, error))
    }

    pub(super) fn write_row(
        &mut self,
        tried: &str,
        row: &Row,
        reading: &Reading,
    ) -> Result<(), Trouble> {
        if row.write.is_none() {
            return Err(troubles::refused(tried, GeneralStatus::ATTRIBUTE_NOT_SETTABLE.into()));
        }
        let is_signed = row.data_type == DataType::Dint;
        let place = Place { values: row.values, octets: row.data_type.octets(), is_signed };
        let octets = place.octets(tried, place.number(tried, reading)?)?;
        match self.set(tried, values::path_of(row), &octets)? {
            Ok(()) => Ok(()),
            Err(error) => {
                let range = self.range(tried, row)?;
                Err(out_of_range(tried, error, range))
            }
        }
    }

    pub(super) fn write_attribute(
        &mut self,
        tried: &str,
        attribute: &Attribute,
        reading: &Reading,
    ) -> Result<(), Trouble> {
        let Some(range) = attribute.range else {
            return Err(troubles::refused(tried, GeneralStatus::ATTRIBUTE_NOT_SETTABLE.into()));
        };
        let octets = match attribute.form {
            Form::Unsigned(octets) => octets,
            _ => 1,
        };
        let place = Place { values: attribute.values, octets, is_signed: false };
        let octets = place.octets(tried, place.number(tried, reading)?)?;
        let done = match attribute.form {
            Form::AssemblyPath { choice } => {
                let path: Vec<u8> =
                    [0x20, class::ASSEMBLY, 0x24].into_iter().chain(octets).collect();
                self.with_connection(tried, choice, |session| {
                    session.set(tried, attribute.path, &path)
                })?
            }
            _ => self.set(tried, attribute.path, &octets)?,
        };
        done.map_err(|error| out_of_range(tried, error, Some(range)))
    }
}

/// A value was refused: which ones are not.
pub(super) fn out_of_range(tried: &str, error: Error, range: Option<(i64, i64)>) -> Trouble {
    let mut trouble = troubles::refused(tried, error);
    if let Some((minimum, maximum)) = range
        && error.general == GeneralStatus::INVALID_ATTRIBUTE_VALUE
    {
        trouble.remedy = if minimum == maximum {
            format!("it takes {minimum} alone")
        } else {
            format!("it takes {minimum} to {maximum}")
        };
    }
    trouble
}
