//! What the keys of a PROFIBUS mean.

use std::ops::Range;

use codewheel_commission::profibus::{MasterSettings, SettingsError, patient_slot};
use codewheel_device::profibus::{Switches, configuration};
use codewheel_encoder::{Direction, Geometry};
use codewheel_link::{BusUri, Medium};
use codewheel_sim::rs485::{Faults, longest_cable};
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant};
use toml::Spanned;

use super::{Given, Source, Written, is_true, span};
use crate::file::{
    BusTable, ConfigurationName, DeviceTable, DirectionName, MasterKind, MasterTable, PresetTable,
    SlaveTable, SwitchTable, SwitchesValue,
};
use crate::plant::default_name;
use crate::{
    BusPlan, Cable, Complaint, DeviceOptions, DpMasterPlan, DpSlavePlan, PresetPlan, Profibus,
};

/// A rate as people write it: `19.2k`, `1.5M`, or in bits per second, `19200`.
#[must_use]
pub(crate) fn baud_rate(text: &str) -> Option<BaudRate> {
    let bits = text.parse().ok();
    BaudRate::ALL.into_iter().find(|rate| {
        rate.to_string().eq_ignore_ascii_case(text) || Some(rate.bits_per_second()) == bits
    })
}

impl Written for Profibus {
    const MEDIUM: Medium = Medium::Rs485;
    const MASTER: MasterKind = MasterKind::DpMaster;
    const RATES: &'static str = "`9.6k`, `19.2k`, `45.45k`, `93.75k`, `187.5k`, `500k`, `1.5M`, \
                                 `3M`, `6M`, `12M`";
    const DEFAULT_RATE: BaudRate = BaudRate::Mbit1_5;

    fn rate(text: &str) -> Option<BaudRate> {
        baud_rate(text)
    }

    fn line(
        source: &Source<'_>,
        table: &BusTable,
        bus: &mut BusPlan<Self>,
    ) -> Result<(), Complaint> {
        bus.faults = Faults {
            loss: source.probability(table.loss.as_ref())?.unwrap_or(0.0),
            corruption: source.probability(table.corruption.as_ref())?.unwrap_or(0.0),
            broken: source.probability(table.broken.as_ref())?.unwrap_or(0.0),
            flipped: source.probability(table.flipped.as_ref())?.unwrap_or(0.0),
            pause: source.probability(table.pause.as_ref())?.unwrap_or(0.0),
        };
        let longest = longest_cable(bus.bit_rate);
        if let Some(metres) = table.cable_m.as_ref().filter(|metres| *metres.get_ref() > longest) {
            let given = *metres.get_ref();
            let slower = BaudRate::ALL.into_iter().rev().find(|rate| longest_cable(*rate) >= given);
            let instead = match slower {
                Some(rate) => format!("shorten it, or take {rate}"),
                None => "shorten it, or put a repeater in".to_owned(),
            };
            let message = format!(
                "a cable of {given} m is too long: at {} it is at most {longest} m; {instead}",
                bus.bit_rate
            );
            return Err(source.complaint(metres.span(), message));
        }
        bus.cable = Cable { metres: table.cable_m.as_ref().map(|metres| *metres.get_ref()) };
        Ok(())
    }

    fn switches(
        source: &Source<'_>,
        table: &DeviceTable,
        _: &BusPlan<Self>,
    ) -> Result<Switches, Complaint> {
        let switches = source.profibus_switches(table)?;
        Ok(Switches { termination: table.termination, ..switches })
    }

    fn options(
        source: &Source<'_>,
        table: &DeviceTable,
        bus: &BusPlan<Self>,
    ) -> Result<DeviceOptions, Complaint> {
        let Some(given) = &table.auto_baud else {
            return Ok(DeviceOptions { auto_baud: bus.is_virtual() });
        };
        let auto_baud = *given.get_ref();
        if auto_baud && !matches!(bus.uri, BusUri::Virtual(_) | BusUri::Rs485Device(_)) {
            let message = "there is no rate to search for: octets have none over TCP and on a pty";
            return Err(source.complaint(given.span(), message.into()));
        }
        Ok(DeviceOptions { auto_baud })
    }

    fn master_plan(
        source: &Source<'_>,
        table: &MasterTable,
        bus: &BusPlan<Self>,
    ) -> Result<DpMasterPlan, Complaint> {
        let of_scanner = [
            ("interval", span(&table.interval)),
            ("interscan_delay", span(&table.interscan_delay)),
        ];
        source.refuse(of_scanner, "it is for a scanner; a DP master asks as fast as it can")?;
        let settings = source.master_settings(table, bus)?;
        let own = settings.address;
        let mut slaves: Vec<DpSlavePlan> = Vec::new();
        match &table.slave {
            Some(tables) => {
                for table in tables {
                    let slave = source.profibus_slave(table, bus)?;
                    let taken = slaves.iter().any(|other| other.address == slave.address);
                    source.new_slave(&table.address, taken, slave.address == own)?;
                    slaves.push(slave);
                }
            }
            None => {
                for device in &bus.devices {
                    let address = device.switches.address();
                    if address != own && !slaves.iter().any(|slave| slave.address == address) {
                        slaves.push(DpSlavePlan::new(address, geometry_at(bus, address)));
                    }
                }
            }
        }
        let name = table.name.clone();
        Ok(DpMasterPlan {
            name: name.unwrap_or_else(|| default_name("dp-master", own)),
            settings,
            termination: table.termination.unwrap_or(true),
            duplicate: is_true(&table.duplicate),
            slaves,
        })
    }
}

/// What the device at `address` measures with; that of a multiturn encoder where it is none of
/// this plant.
fn geometry_at(bus: &BusPlan<Profibus>, address: u8) -> Geometry {
    let device = bus.devices.iter().find(|device| device.switches.address() == address);
    device.map_or(Geometry::MULTITURN_29, |device| {
        device.sensor.geometry().unwrap_or(device.product.encoder.geometry)
    })
}

/// The keys that only a slave of a scanner has.
fn of_devicenet(table: &SlaveTable) -> [Given; 7] {
    [
        ("connection", span(&table.connection)),
        ("expected_packet_rate", span(&table.expected_packet_rate)),
        ("acknowledged", span(&table.acknowledged)),
        ("production_inhibit", span(&table.production_inhibit)),
        ("assembly", span(&table.assembly)),
        ("vendor", span(&table.vendor)),
        ("product_code", span(&table.product_code)),
    ]
}

fn number<T: Copy>(value: &Option<Spanned<T>>, default: T) -> T {
    value.as_ref().map_or(default, |value| *value.get_ref())
}

impl Source<'_> {
    fn profibus_switches(&self, table: &DeviceTable) -> Result<Switches, Complaint> {
        let value = match (&table.address, &table.switches) {
            (Some(address), None) => {
                let number = u8::try_from(*address.get_ref()).ok().filter(|number| *number <= 99);
                return number.map(Switches::set_to).ok_or_else(|| {
                    let message = format!(
                        "{} is no address: the switches of a PROFIBUS encoder have 0–99",
                        address.get_ref()
                    );
                    self.complaint(address.span(), message)
                });
            }
            (None, Some(value)) => value,
            (None, None) => {
                let message = "missing key `address` (or `switches`)".to_owned();
                return Err(self.complaint(table.model.span(), message));
            }
            (Some(_), Some(switches)) => {
                let message = "address says where the switches stand already: give one of the two";
                return Err(self.complaint(switches.span(), message.into()));
            }
        };
        match *value.get_ref() {
            SwitchesValue::Number(number) => Ok(Switches::set_to(number)),
            SwitchesValue::Each(SwitchTable { dip: Some(_), .. }) => {
                let message = "a PROFIBUS cover has no DIP switches but that of the termination: \
                               write termination = true";
                Err(self.complaint(value.span(), message.into()))
            }
            SwitchesValue::Each(SwitchTable { rotary: [rotary_1, rotary_2], dip: None }) => {
                if rotary_1 > 9 || rotary_2 > 9 {
                    let message = "a rotary switch stands at 0 to 9".to_owned();
                    return Err(self.complaint(value.span(), message));
                }
                Ok(Switches { rotary_1, rotary_2, termination: false })
            }
        }
    }

    fn station_address(&self, address: &Spanned<i64>) -> Result<u8, Complaint> {
        u8::try_from(*address.get_ref()).ok().filter(|address| *address <= 125).ok_or_else(|| {
            let message = format!("{} is no address: a PROFIBUS has 0–125", address.get_ref());
            self.complaint(address.span(), message)
        })
    }

    fn master_settings(
        &self,
        table: &MasterTable,
        bus: &BusPlan<Profibus>,
    ) -> Result<MasterSettings, Complaint> {
        let address = self.station_address(&table.address)?;
        let default = MasterSettings::new(address, bus.bit_rate);
        let slot = if bus.is_virtual() { default.slot() } else { patient_slot(bus.bit_rate) };
        // A cycle through all slaves must fit into it.
        let slow = bus.bit_rate < BaudRate::Kbit187_5;
        let watchdog = Duration::from_millis(if slow { 5_000 } else { 200 });
        let watchdog = table.watchdog.as_ref().map_or(watchdog, |time| time.get_ref().0);
        let settings = MasterSettings {
            slot_bits: Some(number(&table.slot_bits, slot)),
            min_station_delay: number(&table.min_station_delay, default.min_station_delay),
            watchdog: (watchdog != Duration::ZERO).then_some(watchdog),
            highest_station_address: number(
                &table.highest_station_address,
                default.highest_station_address,
            ),
            gap_wait_rotations: number(&table.gap_wait_rotations, default.gap_wait_rotations),
            retries: number(&table.retries, default.retries),
            token_rotation_bits: table.token_rotation_bits.as_ref().map(|bits| *bits.get_ref()),
            ..default
        };
        settings.check().map_err(|error| {
            let at = match error {
                SettingsError::SlotTime { .. } => span(&table.slot_bits),
                SettingsError::StationDelay(_) => span(&table.min_station_delay),
                SettingsError::HighestStationAddress { .. } => span(&table.highest_station_address),
                SettingsError::GapWait(_) => span(&table.gap_wait_rotations),
                SettingsError::Retries(_) => span(&table.retries),
                SettingsError::Watchdog(_) => span(&table.watchdog),
                SettingsError::TokenRotation(_) => span(&table.token_rotation_bits),
                _ => None,
            };
            self.complaint(at.unwrap_or_else(|| table.address.span()), error.to_string())
        })?;
        Ok(settings)
    }

    fn profibus_slave(
        &self,
        table: &SlaveTable,
        bus: &BusPlan<Profibus>,
    ) -> Result<DpSlavePlan, Complaint> {
        self.refuse(of_devicenet(table), "it is for slaves of a scanner")?;
        let address = self.station_address(&table.address)?;
        let default = DpSlavePlan::new(address, geometry_at(bus, address));
        let class_2 = match table.class.as_ref() {
            None => true,
            Some(class) if *class.get_ref() == 2 => true,
            Some(class) if *class.get_ref() == 1 => false,
            Some(class) => {
                let message = format!("{} is no device class: it is 1 or 2", class.get_ref());
                return Err(self.complaint(class.span(), message));
            }
        };
        let turns = default.total_resolution / default.steps_per_turn.max(1);
        let steps_per_turn = number(&table.steps_per_turn, default.steps_per_turn);
        let mut slave = DpSlavePlan {
            class_2,
            configuration: table
                .configuration
                .as_ref()
                .and_then(configuration)
                .unwrap_or(default.configuration),
            direction: match table.direction.as_ref().map(Spanned::get_ref) {
                Some(DirectionName::Ccw) => Direction::Ccw,
                Some(DirectionName::Cw) | None => Direction::Cw,
            },
            scaling: number(&table.scaling, class_2),
            steps_per_turn,
            total_resolution: number(&table.total_resolution, steps_per_turn.saturating_mul(turns)),
            groups: table.groups.as_ref().map_or(Ok(0), |groups| self.groups(groups))?,
            ..default
        };
        self.scaling_fits(table, &slave)?;
        for preset in &table.preset {
            let last = slave.presets.last().copied();
            slave.presets.push(self.preset(preset, &slave, last)?);
        }
        Ok(slave)
    }

    /// Class 1 has no scaling, and without scaling nobody looks at the numbers.
    fn scaling_fits(&self, table: &SlaveTable, slave: &DpSlavePlan) -> Result<(), Complaint> {
        if let Some(scaling) = table.scaling.as_ref().filter(|_| slave.scaling && !slave.class_2) {
            let message = "class 1 has no scaling: write class = 2, or leave it out".to_owned();
            return Err(self.complaint(scaling.span(), message));
        }
        if slave.scaling {
            return Ok(());
        }
        let numbers = [
            ("steps_per_turn", span(&table.steps_per_turn)),
            ("total_resolution", span(&table.total_resolution)),
        ];
        self.refuse(numbers, "without scaling the slave does not look at it")
    }

    fn groups(&self, groups: &Spanned<Vec<u8>>) -> Result<u8, Complaint> {
        groups.get_ref().iter().try_fold(0, |all, group| match group {
            1..=8 => Ok(all | 1 << (group - 1)),
            _ => Err(self.complaint(groups.span(), format!("{group} is no group: it is 1 to 8"))),
        })
    }

    fn preset(
        &self,
        table: &PresetTable,
        slave: &DpSlavePlan,
        last: Option<PresetPlan>,
    ) -> Result<PresetPlan, Complaint> {
        let complaint = |at: Range<usize>, message: String| Err(self.complaint(at, message));
        let configuration = slave.configuration.identifier;
        if slave.configuration.outputs == 0 {
            let message =
                format!("configuration {configuration:02X} carries no preset: F1 and F0 do");
            return complaint(table.at.span(), message);
        }
        // The top bit is the clock.
        let carried = u32::from(slave.configuration.outputs) * 8 - 1;
        if !slave.class_2 {
            let message = "class 1 has no preset: write class = 2".to_owned();
            return complaint(table.at.span(), message);
        }
        let value = *table.value.get_ref();
        if value >> carried != 0 {
            let message = format!(
                "{value} does not fit: with {configuration:02X} a preset has {carried} bits"
            );
            return complaint(table.value.span(), message);
        }
        let at = Instant::ZERO + table.at.get_ref().0;
        if last.is_some_and(|last| last.at > at) {
            let message = "presets stand in the order of their time".to_owned();
            return complaint(table.at.span(), message);
        }
        Ok(PresetPlan { at, value })
    }
}

fn configuration(name: &Spanned<ConfigurationName>) -> Option<&'static configuration::Row> {
    configuration::Row::find(match name.get_ref() {
        ConfigurationName::F1 => 0xF1,
        ConfigurationName::D1 => 0xD1,
        ConfigurationName::F0 => 0xF0,
        ConfigurationName::D0 => 0xD0,
    })
}
