//! One device on DeviceNet as a session.

use codewheel_device::devicenet::parameter::LINKS;
use codewheel_device::devicenet::rows::{DataType, ENCODER_POSITION, ROWS, Row};
use codewheel_device::product::Bus;
use codewheel_devicenet::MacId;
use codewheel_devicenet::explicit::{Error, GeneralStatus, Path, Service, class};
use codewheel_devicenet::scanner::{
    ANSWER_TIME, PARAMETER, Parameter, ParameterWalk, Response, SlaveSettings, Walked,
};
use codewheel_station::{Duration, Instant};

use super::console::Console;
use super::dialogue::{Answer, Dialogue};
use super::objects::{ATTRIBUTES, Attribute, Form};
use super::target::{Place, Target};
use super::watch::{self, Watch};
use super::{LISTEN_TIME, OWN_MAC, identity, troubles, values};
use crate::{Identity, Kind, Name, Reading, Sample, Seat, Session, Trouble, Value};

/// How long a Save may take: a device writes its memory for up to five seconds (AMG manual §8.3).
const SAVE_TIME: Duration = Duration::from_secs(6);
/// How long Restore and Reset may take.
const SERVICE_TIME: Duration = Duration::from_secs(2);
/// Attributes of a parameter.
const MINIMUM: u8 = 10;
const MAXIMUM: u8 = 11;
/// Class 2Fh, attributes 8 and 11.
const TOTAL_RESOLUTION: u8 = 8;
const COS_DELTA: u8 = 11;

/// How to open a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpenSettings {
    /// Our own MAC ID; default [`OWN_MAC`].
    pub mac: MacId,
    /// How long to listen first; at least, and by default, [`LISTEN_TIME`]. What the seat has
    /// listened already counts.
    pub listen: Duration,
}

impl Default for OpenSettings {
    fn default() -> Self {
        Self { mac: OWN_MAC, listen: LISTEN_TIME }
    }
}

/// A device that is ours to ask: it has an explicit connection to us, and while it is sampled a poll
/// connection.
///
/// Encoders of the catalogue are read and written by the rows of class 2Fh. Any other device tells
/// what its Parameter object says; its position is not known. The order in which settings must be
/// written is that of the [module](super#the-order-of-writing).
#[derive(Debug)]
pub struct Encoder<S> {
    dialogue: Dialogue<S>,
    mac: MacId,
    identity: Identity,
    watch: Option<Watch>,
}

impl<S: Seat<Station = Console>> Encoder<S> {
    /// Listens, goes on line where the console is not yet, allocates an explicit connection to the
    /// device at `address`, and asks it who it is. That takes some three seconds the first time.
    ///
    /// # Errors
    /// [`Kind::Refused`] where it belongs to another master, who is named where he is known: watch
    /// it with an [`Eavesdropper`](super::Eavesdropper). [`Kind::TimeOut`] where nobody answers,
    /// [`Kind::Bus`] where the bus cannot be used or our own address is taken.
    pub fn open(seat: S, address: MacId, settings: OpenSettings) -> Result<Self, Trouble> {
        let tried = format!("open the device at MAC ID {address}");
        let mut dialogue = Dialogue::new(seat);
        if address == settings.mac {
            return Err(Trouble::new(
                Kind::Usage,
                tried,
                format!("MAC ID {address} is our own"),
                "choose another one for us",
            ));
        }
        dialogue.listen(&tried, settings.listen.max(LISTEN_TIME), |_| {})?;
        let now = dialogue.now();
        if let Some(owner) = dialogue.console().owner(now, address) {
            return Err(dialogue.owned(&tried, address, owner));
        }
        dialogue.go_on_line(&tried, settings.mac)?;
        dialogue.allocate(&tried, SlaveSettings::explicit(address))?;
        match identity::identify(&mut dialogue, &tried, address) {
            Ok(known) => Ok(Self { dialogue, mac: address, identity: known.identity, watch: None }),
            Err(trouble) => {
                // What went wrong before is what people must hear.
                let _ = dialogue.release(&tried, address);
                Err(trouble)
            }
        }
    }

    fn is_ours(&self) -> bool {
        !self.identity.models.is_empty()
    }

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

    fn row_value(&mut self, tried: &str, row: &Row) -> Result<Result<Value, Error>, Trouble> {
        match self.read(tried, values::path_of(row))? {
            Ok(octets) => Ok(Ok(values::of_row(row, &octets, self.range(tried, row)?))),
            Err(error) => Ok(Err(error)),
        }
    }

    fn attribute_value(
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
        if let Err(error) = self.serve(tried, &allocate, ANSWER_TIME)? {
            return Ok(Err(error));
        }
        let result = act(self);
        let release = [Service::RELEASE.0, class::DEVICENET, 1, choice];
        let released = self.serve(tried, &release, ANSWER_TIME);
        let result = result?;
        released?.map_err(|error| troubles::refused(tried, error))?;
        Ok(result)
    }

    /// Asks a service; the data of the response.
    fn serve(
        &mut self,
        tried: &str,
        body: &[u8],
        patience: Duration,
    ) -> Result<Result<Vec<u8>, Error>, Trouble> {
        let answer = self.dialogue.ask(tried, self.mac, body, patience)?;
        told(tried, answer)
    }

    /// Gives the poll connection back, if there is one.
    fn leave_io(&mut self, tried: &str) -> Result<(), Trouble> {
        if self.watch.take().is_some() {
            Watch::end(&mut self.dialogue, tried, self.mac)?;
        }
        Ok(())
    }

    /// Walks one instance of the Parameter object, or all; `see` gets each with the name of its
    /// value.
    fn walk(
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
                let label = self.enum_string(tried, &parameter)?;
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
        let number = parameter.data_type.number(&parameter.value);
        let value = number.and_then(|number| u8::try_from(number).ok());
        let Some(value) = value.filter(|_| parameter.is_enumerated()) else { return Ok(None) };
        let body = [Service::GET_ENUM_STRING.0, PARAMETER, parameter.number, value];
        let octets = self.serve(tried, &body, ANSWER_TIME)?;
        let name = octets.ok().map(|octets| values::short_string(&octets));
        Ok(name.filter(|name| !name.is_empty()))
    }

    /// Parameter `number`.
    fn parameter(
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

    fn target_value(&mut self, tried: &str, target: Target) -> Result<Value, Trouble> {
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

    fn write_row(&mut self, tried: &str, row: &Row, reading: &Reading) -> Result<(), Trouble> {
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

    fn write_attribute(
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

    fn write_parameter(
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
            Reading::Number(_) | Reading::Text(_) if !parameter.data_type.is_integer() => {
                let name = parameter.data_type.name().unwrap_or("of an unknown type");
                return Err(Trouble::new(
                    Kind::Usage,
                    tried,
                    format!("the parameter is {name}, which is no integer"),
                    format!("give its {length} octets"),
                ));
            }
            Reading::Number(_) | Reading::Text(_) => {
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

    fn set(
        &mut self,
        tried: &str,
        path: Path,
        octets: &[u8],
    ) -> Result<Result<(), Error>, Trouble> {
        let answer = self.dialogue.set(tried, self.mac, path, octets)?;
        Ok(told(tried, answer)?.map(|_| ()))
    }

    /// Save, Restore and Reset: of class 2Fh on ours, else of the Parameter object for all its
    /// parameters.
    fn memory_service(
        &mut self,
        tried: &str,
        service: Service,
        patience: Duration,
    ) -> Result<(), Trouble> {
        let (class, instance) = if self.is_ours() { (ENCODER_POSITION, 1) } else { (PARAMETER, 0) };
        let done = self.serve(tried, &[service.0, class, instance], patience)?;
        done.map(|_| ()).map_err(|error| troubles::refused(tried, error))
    }

    fn tried(&self, what: &str) -> String {
        format!("{what} the device at MAC ID {}", self.mac)
    }

    /// Whether the position is known to be where ours have it.
    fn expect_ours(&self, tried: &str) -> Result<(), Trouble> {
        if self.is_ours() {
            return Ok(());
        }
        Err(Trouble::new(
            Kind::Refused,
            tried,
            "the device is none of ours, and nobody knows where its position lies",
            "read and write its parameters by parameter/N or class/instance/attribute",
        ))
    }
}

/// An answer that is whole.
fn told(tried: &str, answer: Answer) -> Result<Result<Vec<u8>, Error>, Trouble> {
    match answer {
        Answer::Done(octets) => Ok(Ok(octets)),
        Answer::Refused(error) => Ok(Err(error)),
        Answer::TooLong => Err(Trouble::new(
            Kind::Refused,
            tried,
            "its answer is longer than the 256 octets there is room for",
            "read its parts by attributes of their own",
        )),
    }
}

/// A value was refused: which ones are not.
fn out_of_range(tried: &str, error: Error, range: Option<(i64, i64)>) -> Trouble {
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

/// A name as people write it.
fn written(name: &Name) -> String {
    match name {
        Name::Key(key) => key.clone(),
        Name::Path { class, instance, attribute } => {
            Path { class: *class, instance: *instance, attribute: *attribute }.to_string()
        }
        Name::Parameter(number) => format!("parameter/{number}"),
        Name::Octet(octet) => format!("octet/{octet}"),
    }
}

impl<S: Seat<Station = Console>> Session for Encoder<S> {
    fn bus(&self) -> Bus {
        Bus::DeviceNet
    }

    fn address(&self) -> u8 {
        self.mac.value()
    }

    fn now(&self) -> Instant {
        self.dialogue.now()
    }

    fn identify(&mut self) -> Result<Identity, Trouble> {
        let tried = self.tried("identify");
        self.identity = identity::identify(&mut self.dialogue, &tried, self.mac)?.identity;
        Ok(self.identity.clone())
    }

    /// What a device refuses to tell is left out.
    fn values(&mut self) -> Result<Vec<Value>, Trouble> {
        let tried = self.tried("read");
        let mut told = Vec::new();
        if self.is_ours() {
            for row in &ROWS {
                told.extend(self.row_value(&tried, row)?.ok());
            }
        } else {
            self.walk(&tried, ParameterWalk::new(), |parameter, label| {
                told.push(values::of_parameter(parameter, label));
            })?;
        }
        let is_ours = self.is_ours();
        for attribute in ATTRIBUTES.iter().filter(|attribute| is_ours || !attribute.ours) {
            told.extend(self.attribute_value(&tried, attribute)?.ok());
        }
        Ok(told)
    }

    fn value(&mut self, name: &Name) -> Result<Value, Trouble> {
        let tried = self.tried(&format!("read {} of", written(name)));
        let target = Target::of(&tried, name, self.is_ours())?;
        self.target_value(&tried, target)
    }

    fn write(&mut self, name: &Name, reading: &Reading) -> Result<Value, Trouble> {
        let tried = self.tried(&format!("write {} of", written(name)));
        let target = Target::of(&tried, name, self.is_ours())?;
        match target {
            Target::Row(row) => self.write_row(&tried, row, reading)?,
            Target::Attribute(attribute) => self.write_attribute(&tried, attribute, reading)?,
            Target::Parameter(number) => self.write_parameter(&tried, number, reading)?,
            Target::Octets(path) => {
                let Reading::Octets(octets) = reading else {
                    return Err(Trouble::new(
                        Kind::Usage,
                        tried,
                        "nobody knows how many octets this attribute has",
                        "give the octets themselves, low one first",
                    ));
                };
                let done = self.set(&tried, path, octets)?;
                done.map_err(|error| troubles::refused(&tried, error))?;
            }
        }
        self.target_value(&tried, target)
    }

    /// The position is read back by a message of its own, with its flags.
    fn preset(&mut self, position: u32) -> Result<Sample, Trouble> {
        let tried = self.tried(&format!("make {position} the position of"));
        self.expect_ours(&tried)?;
        if let Some(row) = Row::find(values::PRESET) {
            self.write_row(&tried, row, &Reading::Number(position.into()))?;
        }
        watch::ask(&mut self.dialogue, &tried, self.mac)
    }

    fn save(&mut self) -> Result<(), Trouble> {
        let tried = self.tried("save the settings of");
        self.memory_service(&tried, Service::SAVE, SAVE_TIME)
    }

    fn restore(&mut self) -> Result<(), Trouble> {
        let tried = self.tried("restore the settings of");
        self.memory_service(&tried, Service::RESTORE, SERVICE_TIME)
    }

    fn reset(&mut self) -> Result<(), Trouble> {
        let tried = self.tried("reset the settings of");
        self.memory_service(&tried, Service::RESET, SERVICE_TIME)
    }

    /// The first call allocates a poll connection; the assembly that it brings is left as the device
    /// has kept it. Where that has no flags, they are asked for twice a second.
    fn sample(&mut self) -> Result<Sample, Trouble> {
        let tried = self.tried("watch");
        self.expect_ours(&tried)?;
        let mut watch = match self.watch.take() {
            Some(watch) => watch,
            None => Watch::begin(&mut self.dialogue, &tried, self.mac)?,
        };
        let sample = watch.sample(&mut self.dialogue, &tried, self.mac);
        self.watch = Some(watch);
        sample
    }

    fn release(&mut self) -> Result<(), Trouble> {
        let tried = self.tried("release");
        self.watch = None;
        self.dialogue.release(&tried, self.mac)
    }

    fn take_notices(&mut self) -> Vec<String> {
        self.dialogue.take_notices()
    }
}
