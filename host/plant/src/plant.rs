//! A plant that makes sense: what runs, and the text that describes it.

use std::fs;
use std::path::{Path, PathBuf};

use codewheel_device::{Product, Switches};
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::Trigger;
use codewheel_link::BusUri;
use codewheel_sim::can::Faults;
use codewheel_sim::shaft::Shaft;
use codewheel_station::Duration;
use codewheel_station::can::BitRate;

use crate::check::check;
use crate::fault::Fault;
use crate::print::print;
use crate::{Complaint, PlantError};

/// Buses with their devices and masters.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// The buses, in the order of the file.
    pub buses: Vec<BusPlan>,
}

/// One bus.
#[derive(Clone, Debug, PartialEq)]
pub struct BusPlan {
    /// Its name.
    pub name: String,
    /// Where it is; `virtual:` is simulated.
    pub uri: BusUri,
    /// Its bit rate.
    pub bit_rate: BitRate,
    /// How often a virtual wire fails.
    pub faults: Faults,
    /// What all chance on it is drawn from.
    pub seed: u32,
    /// Its devices.
    pub devices: Vec<DevicePlan>,
    /// Its masters.
    pub masters: Vec<MasterPlan>,
}

/// One device.
#[derive(Clone, Debug, PartialEq)]
pub struct DevicePlan {
    /// What messages call it.
    pub name: String,
    /// The product.
    pub product: &'static Product,
    /// Its switches.
    pub switches: Switches,
    /// Its shaft, which begins with the plant.
    pub shaft: Shaft,
    /// The shaft as text.
    pub shaft_text: String,
    /// The file that holds its non-volatile memory; without one it forgets with the process.
    pub memory: Option<PathBuf>,
    /// Its serial number; by default what the memory holds, else the address.
    pub serial: Option<u32>,
    /// It has the address of an earlier station on purpose.
    pub duplicate: bool,
    /// What will go wrong, in the order of the file.
    pub faults: Vec<Fault>,
}

/// One master.
#[derive(Clone, Debug, PartialEq)]
pub struct MasterPlan {
    /// What messages call it.
    pub name: String,
    /// Its address.
    pub mac: MacId,
    /// How often it polls.
    pub interval: Duration,
    /// The shortest pause between two poll cycles.
    pub interscan_delay: Duration,
    /// Whether its terminating resistor is on.
    pub termination: bool,
    /// It has the address of an earlier station on purpose.
    pub duplicate: bool,
    /// Its scan list.
    pub slaves: Vec<SlavePlan>,
}

/// How the data of a slave is fetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// The master asks and the slave answers.
    Poll,
    /// The slave produces of its own accord.
    Change {
        /// What makes it produce.
        trigger: Trigger,
        /// Whether each production is acknowledged.
        acknowledged: bool,
        /// The shortest pause between two productions in ms; 0: none.
        production_inhibit: u16,
    },
    /// The slave is only kept reachable.
    Explicit,
}

/// One line of a scan list.
#[derive(Clone, Debug, PartialEq)]
pub struct SlavePlan {
    /// Its address.
    pub mac: MacId,
    /// How its data is fetched.
    pub exchange: Exchange,
    /// The expected packet rate in ms; 0: no time-out.
    pub expected_packet_rate: u16,
    /// The assembly it shall produce; `None` leaves what it has kept.
    pub assembly: Option<u8>,
    /// Vendor and product code it must have; `None` takes any.
    pub identity: Option<(u16, u16)>,
}

impl SlavePlan {
    /// Polls `mac`, whatever it is, with an expected packet rate of 200 ms.
    #[must_use]
    pub const fn poll(mac: MacId) -> Self {
        let exchange = Exchange::Poll;
        Self { mac, exchange, expected_packet_rate: 200, assembly: None, identity: None }
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

impl DevicePlan {
    /// A device without memory file and faults, named by its model and address.
    #[must_use]
    pub fn new(product: &'static Product, switches: Switches, shaft: Shaft) -> Self {
        Self {
            name: default_name(product.model, switches.address()),
            product,
            switches,
            shaft,
            shaft_text: "still".into(),
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
