//! What does not change while a plant runs.

use codewheel_device::product::Bus;
use codewheel_plant::{
    BusDescription, DeviceDescription, DipSwitch, FaultDescription, FaultParameter,
    MasterDescription, ParameterKind, RotarySwitch,
};
use serde::Serialize;
use utoipa::ToSchema;

/// The plant.
#[derive(Serialize, ToSchema)]
pub(crate) struct PlantDocument {
    /// The version of the program.
    version: &'static str,
    /// Whether nobody may change anything here.
    read_only: bool,
    /// What the plant is called, such as the name of its file.
    name: String,
    /// Its buses, in the order of the plan.
    buses: Vec<BusDocument>,
}

#[derive(Serialize, ToSchema)]
struct BusDocument {
    /// Its name in addresses and in the state.
    id: String,
    /// `DeviceNet` or `PROFIBUS`.
    bus: &'static str,
    /// Where it is, with the port it really got.
    uri: String,
    /// `500k`.
    bit_rate: String,
    devices: Vec<DeviceDocument>,
    masters: Vec<MasterDocument>,
}

#[derive(Serialize, ToSchema)]
struct DeviceDocument {
    /// Its name in addresses and in the state.
    id: String,
    /// `amg11-d29`.
    model: &'static str,
    /// `AMG 11 D29`.
    title: &'static str,
    /// The family in the manual: `AMG 11 - Multiturn`.
    product_name: &'static str,
    /// `solid`, `hollow` or `none (SSI)`.
    shaft: String,
    /// S, raw steps per turn.
    steps: u32,
    /// M, how many turns it tells apart.
    turns: u32,
    serial: u32,
    /// The rates it can have: `125k`.
    bit_rates: Vec<String>,
    switches: SwitchesDocument,
    /// What can go wrong with it.
    faults: Vec<FaultDocument>,
    /// Whether its settings can be written here.
    editable: bool,
    /// Why not.
    why_not_editable: Option<&'static str>,
    /// Whether its shaft can be turned here.
    can_turn: bool,
    /// Why not.
    why_not_turned: Option<&'static str>,
}

#[derive(Serialize, ToSchema)]
struct SwitchesDocument {
    /// The tens and the units of the address.
    rotary: Vec<RotaryDocument>,
    /// DIP switches 1, 2, …, without the terminating resistor.
    dip: Vec<DipDocument>,
}

#[derive(Serialize, ToSchema)]
struct RotaryDocument {
    /// What is printed beside it.
    label: &'static str,
    meaning: &'static str,
    /// How many positions it has.
    digits: u8,
    /// How it is delivered.
    delivered: u8,
}

#[derive(Serialize, ToSchema)]
struct DipDocument {
    /// What is printed beside it.
    label: &'static str,
    meaning: &'static str,
    /// How it is delivered.
    on: bool,
}

#[derive(Serialize, ToSchema)]
struct FaultDocument {
    /// `late-answers`.
    kind: &'static str,
    title: &'static str,
    help: &'static str,
    /// Whether it lasts until somebody ends it; otherwise it is over at once.
    ends: bool,
    parameters: Vec<ParameterDocument>,
}

#[derive(Serialize, ToSchema)]
struct ParameterDocument {
    name: &'static str,
    /// `integer`, `probability` (0 to 1) or `time` (`500ms`).
    #[serde(rename = "type")]
    kind: &'static str,
    required: bool,
    /// What it is where it is left out.
    default: Option<&'static str>,
    help: &'static str,
}

#[derive(Serialize, ToSchema)]
struct MasterDocument {
    /// Its name in the state.
    id: String,
    address: u8,
}

impl PlantDocument {
    pub(crate) fn new(name: &str, read_only: bool, buses: &[BusDescription]) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            read_only,
            name: name.to_owned(),
            buses: buses.iter().map(BusDocument::from).collect(),
        }
    }
}

impl From<&BusDescription> for BusDocument {
    fn from(bus: &BusDescription) -> Self {
        Self {
            id: bus.name.clone(),
            bus: match bus.bus {
                Bus::DeviceNet => "DeviceNet",
                Bus::Profibus => "PROFIBUS",
            },
            uri: bus.uri.clone(),
            bit_rate: bus.bit_rate.clone(),
            devices: bus.devices.iter().map(DeviceDocument::from).collect(),
            masters: bus.masters.iter().map(MasterDocument::from).collect(),
        }
    }
}

impl From<&DeviceDescription> for DeviceDocument {
    fn from(device: &DeviceDescription) -> Self {
        Self {
            id: device.name.clone(),
            model: device.product.model,
            title: device.product.title,
            product_name: device.product.product_name,
            shaft: device.product.family.shaft().to_string(),
            steps: device.singleturn_resolution,
            turns: device.revolutions,
            serial: device.serial,
            bit_rates: device.bit_rates.clone(),
            switches: SwitchesDocument {
                rotary: device.rotary.iter().map(RotaryDocument::from).collect(),
                dip: device.dip.iter().map(DipDocument::from).collect(),
            },
            faults: device.faults.iter().map(FaultDocument::from).collect(),
            editable: device.settings_fixed.is_none(),
            why_not_editable: device.settings_fixed,
            can_turn: device.shaft_fixed.is_none(),
            why_not_turned: device.shaft_fixed,
        }
    }
}

impl From<&RotarySwitch> for RotaryDocument {
    fn from(switch: &RotarySwitch) -> Self {
        let RotarySwitch { label, meaning, delivered } = *switch;
        Self { label, meaning, digits: 10, delivered }
    }
}

impl From<&DipSwitch> for DipDocument {
    fn from(switch: &DipSwitch) -> Self {
        let DipSwitch { label, meaning, delivered } = *switch;
        Self { label, meaning, on: delivered }
    }
}

impl From<&FaultDescription> for FaultDocument {
    fn from(fault: &FaultDescription) -> Self {
        Self {
            kind: fault.kind,
            title: fault.title,
            help: fault.help,
            ends: fault.lasts,
            parameters: fault.parameters.iter().map(ParameterDocument::from).collect(),
        }
    }
}

impl From<&FaultParameter> for ParameterDocument {
    fn from(parameter: &FaultParameter) -> Self {
        let FaultParameter { name, kind, required, default, help } = *parameter;
        let kind = match kind {
            ParameterKind::Integer => "integer",
            ParameterKind::Probability => "probability",
            ParameterKind::Time => "time",
        };
        Self { name, kind, required, default, help }
    }
}

impl From<&MasterDescription> for MasterDocument {
    fn from(master: &MasterDescription) -> Self {
        Self { id: master.name.clone(), address: master.address }
    }
}
