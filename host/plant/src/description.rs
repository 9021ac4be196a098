//! What does not change while a plant runs.

use codewheel_device::{Product, product};

/// A bus with all that is on it.
#[derive(Clone, Debug, PartialEq)]
pub struct BusDescription {
    /// Its name.
    pub name: String,
    /// What is spoken on it.
    pub bus: product::Bus,
    /// Where it is, with the port it really got.
    pub uri: String,
    /// Its bit rate as people write it: `500k`.
    pub bit_rate: String,
    /// Its devices, in the order of the plan.
    pub devices: Vec<DeviceDescription>,
    /// Its masters, in the order of the plan.
    pub masters: Vec<MasterDescription>,
}

/// A device.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceDescription {
    /// What messages call it.
    pub name: String,
    /// The product.
    pub product: &'static Product,
    /// Its serial number.
    pub serial: u32,
    /// S, the raw steps per turn of what it measures with.
    pub singleturn_resolution: u32,
    /// M, how many turns its sensor tells apart.
    pub revolutions: u32,
    /// The bit rates it can have: `125k`, `250k`, `500k`.
    pub bit_rates: Vec<String>,
    /// Its rotary switches.
    pub rotary: [RotarySwitch; 2],
    /// Its DIP switches, without the terminating resistor.
    pub dip: Vec<DipSwitch>,
    /// Why nobody can turn its shaft: a real encoder is at its SSI line. `None` where one can.
    pub shaft_fixed: Option<&'static str>,
    /// Why its settings cannot be written here; `None` where they can.
    pub settings_fixed: Option<&'static str>,
    /// What can go wrong with it.
    pub faults: Vec<FaultDescription>,
}

/// A rotary switch with ten positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RotarySwitch {
    /// What is printed beside it.
    pub label: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// How it is delivered, 0 … 9.
    pub delivered: u8,
}

/// A DIP switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DipSwitch {
    /// What is printed beside it.
    pub label: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// How it is delivered, true for ON.
    pub delivered: bool,
}

/// A fault that a device can have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultDescription {
    /// Its kind in plant files and commands: `late-answers`.
    pub kind: &'static str,
    /// What happens, in a few words.
    pub title: &'static str,
    /// One sentence that helps.
    pub help: &'static str,
    /// Whether it lasts until it is ended; otherwise it is over at once.
    pub lasts: bool,
    /// What it takes.
    pub parameters: Vec<FaultParameter>,
}

/// A parameter of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultParameter {
    /// Its name: `delay`.
    pub name: &'static str,
    /// What is written behind it.
    pub kind: ParameterKind,
    /// Whether the fault needs it.
    pub required: bool,
    /// What it is where it is left out; `None`: nothing.
    pub default: Option<&'static str>,
    /// One sentence that helps.
    pub help: &'static str,
}

/// What a parameter of a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ParameterKind {
    /// A whole number.
    Integer,
    /// A number from 0 to 1.
    Probability,
    /// A time with its unit: `500ms`.
    Time,
}

/// A master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MasterDescription {
    /// What messages call it.
    pub name: String,
    /// Its address.
    pub address: u8,
}
