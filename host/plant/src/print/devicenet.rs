//! A DeviceNet in tables.

use codewheel_device::Switches;
use codewheel_devicenet::scanner::Trigger;
use codewheel_station::Duration;
use codewheel_station::can::BitRate;

use super::{Printed, probability, value};
use crate::file::{
    BusKind, BusTable, Connection, MasterKind, MasterTable, SlaveTable, SwitchTable, SwitchesValue,
};
use crate::{BusPlan, DeviceNet, DevicePlan, Exchange, MasterPlan, SlavePlan, TimeSpan};

impl Printed for DeviceNet {
    const KIND: BusKind = BusKind::DeviceNet;

    fn bus(bus: &BusPlan<Self>, table: &mut BusTable) {
        table.loss = probability(bus, bus.faults.loss);
        table.corruption = probability(bus, bus.faults.corruption);
    }

    fn switches(
        device: &DevicePlan<Self>,
        bus: &BusPlan<Self>,
    ) -> (Option<u8>, Option<SwitchesValue>) {
        switches(device.switches, bus.bit_rate)
    }

    fn auto_baud(_: &DevicePlan<Self>) -> Option<bool> {
        None
    }

    fn master_table(master: &MasterPlan, bus: &BusPlan<Self>) -> MasterTable {
        MasterTable {
            name: Some(master.name.clone()),
            kind: Some(value(MasterKind::Scanner)),
            bus: Some(value(bus.name.clone())),
            address: value(master.mac.value().into()),
            interval: Some(value(TimeSpan(master.interval))),
            interscan_delay: Some(value(TimeSpan(master.interscan_delay))),
            slot_bits: None,
            min_station_delay: None,
            watchdog: None,
            highest_station_address: None,
            gap_wait_rotations: None,
            retries: None,
            token_rotation_bits: None,
            termination: Some(master.termination),
            duplicate: master.duplicate.then(|| value(true)),
            slave: Some(master.slaves.iter().map(slave_table).collect()),
        }
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
        connection: Some(value(connection)),
        expected_packet_rate: Some(millis(slave.expected_packet_rate)),
        acknowledged,
        production_inhibit,
        assembly: slave.assembly.map(value),
        vendor: slave.identity.map(|(vendor, _)| value(vendor)),
        product_code: slave.identity.map(|(_, code)| value(code)),
        class: None,
        configuration: None,
        direction: None,
        scaling: None,
        steps_per_turn: None,
        total_resolution: None,
        groups: None,
        preset: Vec::new(),
    }
}
