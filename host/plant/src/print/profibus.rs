//! A PROFIBUS in tables.

use codewheel_device::profibus::Switches;
use codewheel_encoder::Direction;
use codewheel_station::{Duration, Instant};

use super::{Printed, probability, value};
use crate::file::{
    BusKind, BusTable, ConfigurationName, DirectionName, MasterKind, MasterTable, PresetTable,
    SlaveTable, SwitchTable, SwitchesValue,
};
use crate::{BusPlan, DevicePlan, DpMasterPlan, DpSlavePlan, PresetPlan, Profibus, TimeSpan};

impl Printed for Profibus {
    const KIND: BusKind = BusKind::Profibus;

    fn bus(bus: &BusPlan<Self>, table: &mut BusTable) {
        table.cable_m = bus.cable.metres.map(value);
        table.loss = probability(bus, bus.faults.loss);
        table.corruption = probability(bus, bus.faults.corruption);
        table.broken = probability(bus, bus.faults.broken);
        table.flipped = probability(bus, bus.faults.flipped);
        table.pause = probability(bus, bus.faults.pause);
    }

    fn switches(
        device: &DevicePlan<Self>,
        _: &BusPlan<Self>,
    ) -> (Option<u8>, Option<SwitchesValue>) {
        let Switches { rotary_1, rotary_2, termination } = device.switches;
        let address = device.switches.address();
        if (Switches { termination, ..Switches::set_to(address) }) == device.switches {
            return (Some(address), None);
        }
        let table = SwitchTable { rotary: [rotary_1, rotary_2], dip: None };
        (None, Some(SwitchesValue::Each(table)))
    }

    fn auto_baud(device: &DevicePlan<Self>) -> Option<bool> {
        Some(device.options.auto_baud)
    }

    fn master_table(master: &DpMasterPlan, bus: &BusPlan<Self>) -> MasterTable {
        let settings = &master.settings;
        MasterTable {
            name: Some(master.name.clone()),
            kind: Some(value(MasterKind::DpMaster)),
            bus: Some(value(bus.name.clone())),
            address: value(settings.address.into()),
            interval: None,
            interscan_delay: None,
            slot_bits: Some(value(settings.slot())),
            min_station_delay: Some(value(settings.min_station_delay)),
            watchdog: Some(value(TimeSpan(settings.watchdog.unwrap_or(Duration::ZERO)))),
            highest_station_address: Some(value(settings.highest_station_address)),
            gap_wait_rotations: Some(value(settings.gap_wait_rotations)),
            retries: Some(value(settings.retries)),
            token_rotation_bits: settings.token_rotation_bits.map(value),
            termination: Some(master.termination),
            duplicate: master.duplicate.then(|| value(true)),
            slave: Some(master.slaves.iter().map(slave_table).collect()),
        }
    }
}

fn slave_table(slave: &DpSlavePlan) -> SlaveTable {
    let groups = (1..=8_u8).filter(|group| slave.groups >> (group - 1) & 1 == 1);
    SlaveTable {
        address: value(slave.address.into()),
        connection: None,
        expected_packet_rate: None,
        acknowledged: None,
        production_inhibit: None,
        assembly: None,
        vendor: None,
        product_code: None,
        class: Some(value(if slave.class_2 { 2 } else { 1 })),
        configuration: Some(value(match slave.configuration.identifier {
            0xD0 => ConfigurationName::D0,
            0xD1 => ConfigurationName::D1,
            0xF0 => ConfigurationName::F0,
            _ => ConfigurationName::F1,
        })),
        direction: Some(value(match slave.direction {
            Direction::Cw => DirectionName::Cw,
            Direction::Ccw => DirectionName::Ccw,
        })),
        scaling: Some(value(slave.scaling)),
        steps_per_turn: slave.scaling.then(|| value(slave.steps_per_turn)),
        total_resolution: slave.scaling.then(|| value(slave.total_resolution)),
        groups: Some(value(groups.collect())),
        preset: slave.presets.iter().map(preset_table).collect(),
    }
}

fn preset_table(preset: &PresetPlan) -> PresetTable {
    PresetTable { at: value(TimeSpan(preset.at.since(Instant::ZERO))), value: value(preset.value) }
}
