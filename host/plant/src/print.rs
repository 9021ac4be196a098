//! From a plant to the text of a plant file, every default filled in.

mod devicenet;
mod profibus;

use codewheel_encoder::ssi::{Code, Settings};
use codewheel_sim::ssi;
use codewheel_spidev::SsiUri;
use codewheel_station::{Duration, Instant};
use toml::Spanned;

use crate::fault::{Fault, Lever};
use crate::field_bus::FieldBus;
use crate::file::{
    BusKind, BusTable, CodeName, DeviceTable, FaultKind, FaultTable, MasterTable, PlantFile,
    SsiTable, SwitchesValue,
};
use crate::plant::any_bus;
use crate::{BusPlan, DevicePlan, Plant, SensorPlan, TimeSpan};

/// What the plans of one field bus are in tables.
trait Printed: FieldBus {
    /// What plant files call it.
    const KIND: BusKind;

    /// Adds what only this bus has.
    fn bus(bus: &BusPlan<Self>, table: &mut BusTable);

    /// The address where it says everything, else the switches.
    fn switches(
        device: &DevicePlan<Self>,
        bus: &BusPlan<Self>,
    ) -> (Option<u8>, Option<SwitchesValue>);

    /// Whether a device searches its rate, where that can be said.
    fn auto_baud(device: &DevicePlan<Self>) -> Option<bool>;

    /// A master.
    fn master_table(master: &Self::MasterPlan, bus: &BusPlan<Self>) -> MasterTable;
}

/// The text of a plant file.
pub(crate) fn print(plant: &Plant) -> String {
    let mut file = PlantFile::default();
    for bus in &plant.buses {
        any_bus!(bus, bus => add(bus, &mut file));
    }
    // Nothing in a plant file is a thing TOML cannot write.
    toml::to_string_pretty(&file).unwrap_or_default()
}

fn add<B: Printed>(bus: &BusPlan<B>, file: &mut PlantFile) {
    file.bus.push(bus_table(bus));
    file.device.extend(bus.devices.iter().map(|device| device_table(device, bus)));
    file.master.extend(bus.masters.iter().map(|master| B::master_table(master, bus)));
}

/// A value that stands nowhere in a text.
fn value<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

/// A probability, which only virtual buses have.
fn probability<B: FieldBus>(bus: &BusPlan<B>, probability: f64) -> Option<Spanned<f64>> {
    bus.is_virtual().then(|| value(probability))
}

fn bus_table<B: Printed>(bus: &BusPlan<B>) -> BusTable {
    let mut table = BusTable {
        name: value(bus.name.clone()),
        kind: B::KIND,
        uri: Some(value(bus.uri.to_string())),
        baud: Some(value(bus.bit_rate.to_string())),
        cable_m: None,
        loss: None,
        corruption: None,
        broken: None,
        flipped: None,
        pause: None,
        seed: Some(value(bus.seed)),
    };
    B::bus(bus, &mut table);
    table
}

fn device_table<B: Printed>(device: &DevicePlan<B>, bus: &BusPlan<B>) -> DeviceTable {
    let (address, switches) = B::switches(device, bus);
    DeviceTable {
        name: Some(device.name.clone()),
        bus: Some(value(bus.name.clone())),
        model: value(device.product.model.to_owned()),
        address: address.map(|address| value(address.into())),
        switches: switches.map(value),
        termination: crate::field_bus::Switches::termination(&device.switches),
        shaft: Some(value(device.shaft_text.clone())),
        auto_baud: B::auto_baud(device).map(value),
        ssi: match &device.sensor {
            SensorPlan::Disc => None,
            SensorPlan::Ssi(settings) => Some(value(ssi_table(settings, None))),
            SensorPlan::SsiLine(settings, uri) => Some(value(ssi_table(settings, Some(uri)))),
        },
        memory: device.memory.clone().map(value),
        serial: device.serial,
        duplicate: device.duplicate.then(|| value(true)),
        fault: device.faults.iter().map(fault_table).collect(),
    }
}

fn ssi_table(settings: &Settings, line: Option<&SsiUri>) -> SsiTable {
    SsiTable {
        word: Some(value(settings.word.bits())),
        code: Some(match settings.code {
            Code::Gray => CodeName::Gray,
            Code::Binary => CodeName::Binary,
        }),
        clock: Some(value(match settings.clock_hz {
            hertz if hertz.is_multiple_of(1_000) => format!("{}k", hertz / 1_000),
            hertz => hertz.to_string(),
        })),
        monoflop: Some(value(TimeSpan(settings.monoflop))),
        line: line.map(|uri| value(uri.to_string())),
        double_read: Some(settings.double_read),
    }
}

fn fault_table(fault: &Fault) -> FaultTable {
    let time = |time: Duration| value(TimeSpan(time));
    let mut table = FaultTable {
        at: TimeSpan(fault.at.since(Instant::ZERO)),
        kind: value(FaultKind::BusOff),
        steps: None,
        lasts: fault.lever.lasts().map(time),
        count: None,
        probability: None,
        delay: None,
        bits: None,
    };
    let kind = match fault.lever {
        Lever::Jump(steps) => {
            table.steps = Some(value(steps));
            FaultKind::Jump
        }
        Lever::CellLow(true) => FaultKind::CellLow,
        Lever::CellLow(false) => FaultKind::CellRight,
        Lever::Stuck(true) => FaultKind::Stuck,
        Lever::Stuck(false) => FaultKind::Free,
        Lever::PowerCut(_) => FaultKind::PowerCut,
        Lever::DropAnswers { probability, count, .. } => {
            table.probability = Some(value(probability));
            table.count = count.map(value);
            FaultKind::DropAnswers
        }
        Lever::LateAnswers { delay, .. } => {
            table.delay = Some(time(delay));
            FaultKind::LateAnswers
        }
        Lever::BusOff => FaultKind::BusOff,
        Lever::Ssi(None) => FaultKind::SsiRight,
        Lever::Ssi(Some(ssi::Fault::Unplugged)) => FaultKind::SsiUnplugged,
        Lever::Ssi(Some(ssi::Fault::Shorted)) => FaultKind::SsiShort,
        Lever::Ssi(Some(ssi::Fault::NoMonoflop)) => FaultKind::SsiNoMonoflop,
        Lever::Ssi(Some(ssi::Fault::WordLength(bits))) => {
            table.bits = Some(value(bits.into()));
            FaultKind::SsiWrongWord
        }
        Lever::Ssi(Some(ssi::Fault::FlippedBits(bits))) => {
            table.bits = Some(value(bits));
            FaultKind::SsiFlippedBits
        }
        Lever::BadTransceiver { probability, .. } => {
            table.probability = Some(value(probability));
            FaultKind::BadTransceiver
        }
    };
    table.kind = value(kind);
    table
}
