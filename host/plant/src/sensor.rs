//! Where the devices of a plant get their codes from.

use codewheel_device::Product;
use codewheel_encoder::ssi::{self, Input};
use codewheel_encoder::{Geometry, Sample, Sensor};
use codewheel_sim::shaft::{Faulty, Shaft};
use codewheel_sim::ssi::{Behaviour, Fault, VirtualEncoder, VirtualLine};
#[cfg(target_os = "linux")]
use codewheel_spidev::SpidevLine;
use codewheel_spidev::SsiUri;
use codewheel_station::Instant;

use crate::StartError;
use crate::check::sensor_of_keys;
use crate::fault::Lever;

/// How a device comes from its shaft to its code.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum SensorPlan {
    /// A code disc on the shaft.
    #[default]
    Disc,
    /// A virtual SSI encoder on the shaft, and the line to it. What the converter expects of the
    /// encoder is what the encoder does, as long as nothing is wrong with it.
    Ssi(ssi::Settings),
    /// A real encoder at an SSI line of this computer; nobody looks at the shaft.
    SsiLine(ssi::Settings, SsiUri),
}

impl SensorPlan {
    /// How `product` comes to its code; a converter as the keys of an `ssi` table of plant files
    /// and their values say: `[("word", "25"), ("code", "binary")]`.
    ///
    /// # Errors
    /// What is wrong with them, as one sentence.
    pub fn parse(product: &Product, keys: &[(&str, String)]) -> Result<Self, String> {
        sensor_of_keys(product, keys)
    }

    /// What the encoder at an SSI line can tell apart; `None` for a disc, which is the product's.
    #[must_use]
    pub const fn geometry(&self) -> Option<Geometry> {
        match self {
            Self::Disc => None,
            Self::Ssi(settings) | Self::SsiLine(settings, _) => Some(settings.word.geometry()),
        }
    }

    /// Why nobody can turn the shaft from here.
    pub(crate) const fn fixed(&self) -> Option<&'static str> {
        match self {
            Self::Disc | Self::Ssi(_) => None,
            Self::SsiLine(..) => Some("a real encoder is at the SSI line: turn its shaft"),
        }
    }
}

/// The sensor of a device, which the power of the device does not touch.
#[derive(Debug)]
pub enum PlantSensor {
    /// A code disc on the shaft.
    Disc(Faulty<Shaft>),
    /// A virtual SSI encoder on the shaft.
    Ssi(Box<Input<VirtualLine<Faulty<Shaft>>>>),
    /// An encoder at an SPI controller.
    #[cfg(target_os = "linux")]
    Spidev(Box<Input<SpidevLine>>),
    /// Stands where a sensor was that has been taken out.
    Gone,
}

impl PlantSensor {
    /// The sensor of a plan, sound.
    ///
    /// # Errors
    /// [`StartError`] where an SSI line cannot be opened, or read as the plan says.
    pub(crate) fn new(plan: &SensorPlan, shaft: Shaft) -> Result<Self, StartError> {
        let codes = shaft.codes();
        let disc = Faulty::new(shaft, codes);
        Ok(match *plan {
            SensorPlan::Disc => Self::Disc(disc),
            SensorPlan::Ssi(settings) => {
                let ssi::Settings { word, code, monoflop, .. } = settings;
                let behaviour = Behaviour { code, monoflop, ..Behaviour::of_word(word) };
                let line = VirtualLine::new(VirtualEncoder::new(disc, behaviour));
                Self::Ssi(Box::new(Input::new(line, settings)?))
            }
            SensorPlan::SsiLine(ref settings, ref uri) => Self::open(settings, uri)?,
        })
    }

    #[cfg(target_os = "linux")]
    fn open(settings: &ssi::Settings, uri: &SsiUri) -> Result<Self, StartError> {
        match uri {
            SsiUri::Spidev(file) => {
                let line = SpidevLine::open(file, settings)?;
                Ok(Self::Spidev(Box::new(Input::new(line, *settings)?)))
            }
            uri => Err(StartError::SsiNotHere(uri.clone())),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn open(_: &ssi::Settings, uri: &SsiUri) -> Result<Self, StartError> {
        Err(StartError::SsiNotHere(uri.clone()))
    }

    /// Takes it out of where it is.
    pub(crate) const fn take(&mut self) -> Self {
        std::mem::replace(self, Self::Gone)
    }

    /// What it does about a fault of its own.
    pub(crate) fn suffer(&mut self, lever: Lever) {
        if let (Lever::Ssi(fault), Self::Ssi(input)) = (lever, &mut *self) {
            input.line_mut().encoder_mut().set_fault(fault);
        }
        let Some(disc) = self.disc() else { return };
        match lever {
            Lever::Jump(steps) => disc.jump(steps),
            Lever::CellLow(low) => disc.set_cell_low(low),
            Lever::Stuck(stuck) => disc.set_stuck(stuck),
            _ => {}
        }
    }

    /// The disc on the shaft of this plant, with its faults.
    pub(crate) const fn shaft(&self) -> Option<&Faulty<Shaft>> {
        match self {
            Self::Disc(disc) => Some(disc),
            Self::Ssi(input) => Some(input.line().encoder().sensor()),
            #[cfg(target_os = "linux")]
            Self::Spidev(_) => None,
            Self::Gone => None,
        }
    }

    /// Puts another shaft in the place of the one of this plant.
    pub(crate) fn set_shaft(&mut self, shaft: Shaft) {
        if let Some(disc) = self.disc() {
            *disc.sensor_mut() = shaft;
        }
    }

    /// What is wrong with the SSI line of this plant.
    pub(crate) const fn line_fault(&self) -> Option<Fault> {
        match self {
            Self::Ssi(input) => input.line().encoder().fault(),
            _ => None,
        }
    }

    /// The disc on the shaft of this plant.
    fn disc(&mut self) -> Option<&mut Faulty<Shaft>> {
        match self {
            Self::Disc(disc) => Some(disc),
            Self::Ssi(input) => Some(input.line_mut().encoder_mut().sensor_mut()),
            #[cfg(target_os = "linux")]
            Self::Spidev(_) => None,
            Self::Gone => None,
        }
    }
}

impl Sensor for PlantSensor {
    fn sample(&mut self, now: Instant) -> Sample {
        match self {
            Self::Disc(disc) => disc.sample(now),
            Self::Ssi(input) => input.sample(now),
            #[cfg(target_os = "linux")]
            Self::Spidev(input) => input.sample(now),
            Self::Gone => Sample::default(),
        }
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        match self {
            Self::Disc(disc) => disc.changes_at(now),
            Self::Ssi(input) => input.changes_at(now),
            #[cfg(target_os = "linux")]
            Self::Spidev(input) => input.changes_at(now),
            Self::Gone => None,
        }
    }
}
