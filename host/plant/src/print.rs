//! From a plant to the text of a plant file, every default filled in.

use codewheel_device::Switches;
use codewheel_devicenet::scanner::Trigger;
use codewheel_station::can::BitRate;
use codewheel_station::{Duration, Instant};
use toml::Spanned;

use crate::fault::{Fault, Lever};
use crate::file::{
    BusKind, BusTable, Connection, DeviceTable, FaultKind, FaultTable, MasterKind, MasterTable,
    PlantFile, SlaveTable, SwitchTable, SwitchesValue,
};
use crate::{BusPlan, DevicePlan, Exchange, MasterPlan, Plant, SlavePlan, TimeSpan};

/// The text of a plant file.
pub(crate) fn print(plant: &Plant) -> String {
    let mut file = PlantFile::default();
    for bus in &plant.buses {
        file.bus.push(bus_table(bus));
        file.device.extend(bus.devices.iter().map(|device| device_table(device, bus)));
        file.master.extend(bus.masters.iter().map(|master| master_table(master, bus)));
    }
    // Nothing in a plant file is a thing TOML cannot write.
    toml::to_string_pretty(&file).unwrap_or_default()
}

/// A value that stands nowhere in a text.
fn value<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

fn bus_table(bus: &BusPlan) -> BusTable {
    let is_virtual = matches!(bus.uri, codewheel_link::BusUri::Virtual(_));
    BusTable {
        name: value(bus.name.clone()),
        kind: BusKind::DeviceNet,
        uri: Some(value(bus.uri.to_string())),
        baud: bus.bit_rate.into(),
        loss: is_virtual.then(|| value(bus.faults.loss)),
        corruption: is_virtual.then(|| value(bus.faults.corruption)),
        seed: Some(value(bus.seed)),
    }
}

fn device_table(device: &DevicePlan, bus: &BusPlan) -> DeviceTable {
    let (address, switches) = switches(device.switches, bus.bit_rate);
    DeviceTable {
        name: Some(device.name.clone()),
        bus: Some(value(bus.name.clone())),
        model: value(device.product.model.to_owned()),
        address: address.map(|address| value(address.into())),
        switches: switches.map(value),
        termination: device.switches.termination,
        shaft: Some(value(device.shaft_text.clone())),
        memory: device.memory.clone().map(value),
        serial: device.serial,
        duplicate: device.duplicate.then(|| value(true)),
        fault: device.faults.iter().map(fault_table).collect(),
    }
}

/// The address where it says everything, else the switches.
fn switches(switches: Switches, rate: BitRate) -> (Option<u8>, Option<SwitchesValue>) {
    let termination = switches.termination;
    if (Switches { termination, ..Switches::set_to(switches.address(), rate) }) == switches {
        return match switches.mac() {
            Some(mac) => (Some(mac.value()), None),
            None => (None, Some(SwitchesValue::Number(switches.address()))),
        };
    }
    let Switches { rotary_1, rotary_2, dip_2, dip_3, .. } = switches;
    let table = SwitchTable { rotary: [rotary_1, rotary_2], dip: Some([false, dip_2, dip_3]) };
    (None, Some(SwitchesValue::Each(table)))
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
        Lever::BadTransceiver { probability, .. } => {
            table.probability = Some(value(probability));
            FaultKind::BadTransceiver
        }
    };
    table.kind = value(kind);
    table
}

fn master_table(master: &MasterPlan, bus: &BusPlan) -> MasterTable {
    MasterTable {
        name: Some(master.name.clone()),
        kind: MasterKind::Scanner,
        bus: Some(value(bus.name.clone())),
        address: value(master.mac.value().into()),
        interval: Some(TimeSpan(master.interval)),
        interscan_delay: Some(TimeSpan(master.interscan_delay)),
        termination: Some(master.termination),
        duplicate: master.duplicate.then(|| value(true)),
        slave: Some(master.slaves.iter().map(slave_table).collect()),
    }
}

fn slave_table(slave: &SlavePlan) -> SlaveTable {
    let millis = |millis: u16| value(TimeSpan(Duration::from_millis(u64::from(millis))));
    let (connection, acknowledged, production_inhibit) = match slave.exchange {
        Exchange::Poll => (Connection::Poll, None, None),
        Exchange::Explicit => (Connection::Explicit, None, None),
        Exchange::Change { trigger, acknowledged, production_inhibit } => {
            let connection = match trigger {
                Trigger::ChangeOfState => Connection::ChangeOfState,
                Trigger::Cyclic => Connection::Cyclic,
            };
            (connection, Some(value(acknowledged)), Some(millis(production_inhibit)))
        }
    };
    SlaveTable {
        address: value(slave.mac.value().into()),
        connection,
        expected_packet_rate: Some(millis(slave.expected_packet_rate)),
        acknowledged,
        production_inhibit,
        assembly: slave.assembly,
        vendor: slave.identity.map(|(vendor, _)| value(vendor)),
        product_code: slave.identity.map(|(_, code)| value(code)),
    }
}
