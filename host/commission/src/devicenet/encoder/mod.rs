//! One device on DeviceNet as a session.

mod access;
mod parameters;

use codewheel_device::devicenet::rows::{ENCODER_POSITION, ROWS, Row};
use codewheel_device::product::Bus;
use codewheel_devicenet::MacId;
use codewheel_devicenet::explicit::{Error, Path, Service};
use codewheel_devicenet::scanner::{PARAMETER, ParameterWalk, SlaveSettings};
use codewheel_station::{Duration, Instant};

use super::console::Console;
use super::dialogue::{Answer, Dialogue};
use super::objects::ATTRIBUTES;
use super::target::Target;
use super::watch::{self, Watch};
use super::{LISTEN_TIME, OWN_MAC, identity, survey, troubles, values};
use crate::{Identity, Kind, Name, Reading, Sample, Seat, Session, Trouble, Value};

/// How long a Save may take: our devices give their memory five seconds (decision).
const SAVE_TIME: Duration = Duration::from_secs(6);
/// How long Restore and Reset may take.
const SERVICE_TIME: Duration = Duration::from_secs(2);

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
        if dialogue.console().overheard().node(address).contested_at.is_some() {
            dialogue.notice(survey::contested(address));
        }
        let now = dialogue.now();
        if let Some(owner) = dialogue.console().owner(now, address) {
            return Err(dialogue.owned(&tried, address, owner));
        }
        dialogue.go_on_line(&tried, settings.mac)?;
        dialogue.allocate(&tried, SlaveSettings::explicit(address))?;
        match identity::identify(&mut dialogue, &tried, address) {
            Ok(known) => Ok(Self { dialogue, mac: address, identity: known.identity, watch: None }),
            Err(trouble) => {
                dialogue.abandon(&tried, address);
                Err(trouble)
            }
        }
    }

    fn is_ours(&self) -> bool {
        !self.identity.models.is_empty()
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
        self.watch = None;
        Watch::end(&mut self.dialogue, tried, self.mac)
    }

    /// What is sampled from now on is from after a change.
    fn note_change(&mut self) {
        let now = self.dialogue.now();
        if let Some(watch) = &mut self.watch {
            watch.change(now);
        }
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
        self.note_change();
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
        self.note_change();
        let written = self.target_value(&tried, target);
        written.map_err(|trouble| troubles::not_read_back("it", trouble))
    }

    /// The position is read back by a message of its own, with its flags.
    fn preset(&mut self, position: u32) -> Result<Sample, Trouble> {
        let tried = self.tried(&format!("make {position} the position of"));
        self.expect_ours(&tried)?;
        if let Some(row) = Row::find(values::PRESET) {
            self.write_row(&tried, row, &Reading::Number(position.into()))?;
        }
        self.note_change();
        let read = watch::ask(&mut self.dialogue, &tried, self.mac);
        read.map_err(|trouble| troubles::not_read_back(&position.to_string(), trouble))
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
