//! A plant that makes sense: what runs, and the text that describes it.

use std::fs;
use std::path::{Path, PathBuf};

use codewheel_capture as capture;
use codewheel_device::{Product, product};
use codewheel_link::BusUri;
use codewheel_sim::shaft::Shaft;

use crate::check::check;
use crate::fault::Fault;
use crate::field_bus::{FieldBus, Switches};
use crate::print::print;
use crate::{Complaint, DeviceNet, PlantError, Profibus, SensorPlan};

/// Buses with their devices and masters.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// The buses, in the order of the file.
    pub buses: Vec<AnyBusPlan>,
}

/// One bus, whichever it is.
#[derive(Clone, Debug, PartialEq)]
pub enum AnyBusPlan {
    /// A DeviceNet.
    DeviceNet(BusPlan<DeviceNet>),
    /// A PROFIBUS.
    Profibus(BusPlan<Profibus>),
}

/// Does the same with a bus, whichever it is.
macro_rules! any_bus {
    ($any:expr, $bus:ident => $what:expr) => {
        match $any {
            $crate::AnyBusPlan::DeviceNet($bus) => $what,
            $crate::AnyBusPlan::Profibus($bus) => $what,
        }
    };
}
pub(crate) use any_bus;

/// One bus.
#[derive(Clone, Debug, PartialEq)]
pub struct BusPlan<B: FieldBus = DeviceNet> {
    /// Its name.
    pub name: String,
    /// Where it is; `virtual:` is simulated.
    pub uri: BusUri,
    /// Its bit rate.
    pub bit_rate: B::Rate,
    /// Its cable.
    pub cable: B::Cable,
    /// How often a virtual wire fails.
    pub faults: B::Faults,
    /// What all chance on it is drawn from.
    pub seed: u32,
    /// Its devices.
    pub devices: Vec<DevicePlan<B>>,
    /// Its masters.
    pub masters: Vec<B::MasterPlan>,
}

/// One device.
#[derive(Clone, Debug, PartialEq)]
pub struct DevicePlan<B: FieldBus = DeviceNet> {
    /// What messages call it.
    pub name: String,
    /// The product.
    pub product: &'static Product,
    /// Its switches.
    pub switches: B::Switches,
    /// What else it is told at power-up.
    pub options: B::Options,
    /// Its shaft, which begins with the plant.
    pub shaft: Shaft,
    /// The shaft as text.
    pub shaft_text: String,
    /// How it comes from the shaft to its code.
    pub sensor: SensorPlan,
    /// The file that holds its non-volatile memory; without one it forgets with the process.
    pub memory: Option<PathBuf>,
    /// Its serial number; by default what the memory holds, else the address.
    pub serial: Option<u32>,
    /// It has the address of an earlier station on purpose.
    pub duplicate: bool,
    /// What will go wrong, in the order of the file.
    pub faults: Vec<Fault>,
}

impl AnyBusPlan {
    /// What is spoken on it.
    #[must_use]
    pub const fn bus(&self) -> product::Bus {
        match self {
            Self::DeviceNet(_) => product::Bus::DeviceNet,
            Self::Profibus(_) => product::Bus::Profibus,
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        any_bus!(self, bus => &bus.name)
    }

    /// Where it is.
    #[must_use]
    pub const fn uri(&self) -> &BusUri {
        any_bus!(self, bus => &bus.uri)
    }

    /// How many devices it has.
    #[must_use]
    pub const fn devices(&self) -> usize {
        any_bus!(self, bus => bus.devices.len())
    }

    /// How many masters it has.
    #[must_use]
    pub const fn masters(&self) -> usize {
        any_bus!(self, bus => bus.masters.len())
    }

    /// How a capture names it.
    #[must_use]
    pub fn captured(&self) -> capture::Bus {
        any_bus!(self, bus => bus.captured())
    }
}

impl<B: FieldBus> BusPlan<B> {
    /// A bus on which nobody is yet and nothing goes wrong.
    #[must_use]
    pub fn new(name: impl Into<String>, uri: BusUri, bit_rate: B::Rate) -> Self {
        Self {
            name: name.into(),
            uri,
            bit_rate,
            cable: B::Cable::default(),
            faults: B::Faults::default(),
            seed: 0,
            devices: Vec::new(),
            masters: Vec::new(),
        }
    }

    /// Whether it is simulated.
    #[must_use]
    pub const fn is_virtual(&self) -> bool {
        matches!(self.uri, BusUri::Virtual(_))
    }

    /// How a capture names it.
    #[must_use]
    pub fn captured(&self) -> capture::Bus {
        B::captured(self)
    }
}

impl Plant {
    /// The plant in the file at `path`; relative paths in it are meant from its folder.
    ///
    /// # Errors
    /// [`PlantError`], which shows the line.
    pub fn load(path: &Path) -> Result<Self, PlantError> {
        let text = fs::read_to_string(path)
            .map_err(|reason| PlantError::Read { path: path.to_owned(), reason })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Ok(Self::parse(&text, &path.display().to_string(), folder)?)
    }

    /// The plant that `text` describes. `name` is what complaints call the text, `folder` where its
    /// relative paths are meant from.
    ///
    /// # Errors
    /// [`Complaint`], which shows the line.
    pub fn parse(text: &str, name: &str, folder: &Path) -> Result<Self, Complaint> {
        check(text, name, folder)
    }

    /// The complete plant with its defaults filled in, as text that reads back to the same plant
    /// from anywhere.
    #[must_use]
    pub fn to_text(&self) -> String {
        print(self)
    }
}

impl<B: FieldBus> DevicePlan<B> {
    /// A device on a shaft at rest, without memory file and faults, named by its model and address.
    #[must_use]
    pub fn new(product: &'static Product, switches: B::Switches, shaft: Shaft) -> Self {
        Self {
            name: default_name(product.model, switches.position()),
            product,
            switches,
            options: B::Options::default(),
            shaft,
            shaft_text: "still".into(),
            sensor: SensorPlan::default(),
            memory: None,
            serial: None,
            duplicate: false,
            faults: Vec::new(),
        }
    }
}

pub(crate) fn default_name(kind: &str, address: u8) -> String {
    format!("{kind} at {address}")
}
