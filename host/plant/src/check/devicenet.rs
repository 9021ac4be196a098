//! What the keys of a DeviceNet mean.

use codewheel_device::Switches;
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::Trigger;
use codewheel_link::Medium;
use codewheel_sim::can::Faults;
use codewheel_station::Duration;
use codewheel_station::can::BitRate;
use toml::Spanned;

use super::{Given, Source, Written, is_true, span};
use crate::file::{
    BusTable, Connection, DeviceTable, MasterKind, MasterTable, SlaveTable, SwitchTable,
    SwitchesValue,
};
use crate::plant::default_name;
use crate::{BusPlan, Complaint, DeviceNet, Exchange, MasterPlan, SlavePlan, TimeSpan};

impl Written for DeviceNet {
    const MEDIUM: Medium = Medium::Can;
    const MASTER: MasterKind = MasterKind::Scanner;
    const RATES: &'static str = "`125k`, `250k`, `500k`";
    const DEFAULT_RATE: BitRate = BitRate::Kbit125;

    fn rate(text: &str) -> Option<BitRate> {
        BitRate::ALL.into_iter().find(|rate| rate.to_string() == text)
    }

    fn line(
        source: &Source<'_>,
        table: &BusTable,
        bus: &mut BusPlan<Self>,
    ) -> Result<(), Complaint> {
        let of_profibus = [
            ("cable_m", span(&table.cable_m)),
            ("broken", span(&table.broken)),
            ("flipped", span(&table.flipped)),
            ("pause", span(&table.pause)),
        ];
        source.refuse(of_profibus, "it is for a PROFIBUS")?;
        bus.faults = Faults {
            loss: source.probability(table.loss.as_ref())?.unwrap_or(0.0),
            corruption: source.probability(table.corruption.as_ref())?.unwrap_or(0.0),
        };
        Ok(())
    }

    fn switches(
        source: &Source<'_>,
        table: &DeviceTable,
        bus: &BusPlan<Self>,
    ) -> Result<Switches, Complaint> {
        let switches = source.devicenet_switches(table, bus.bit_rate)?;
        Ok(Switches { termination: table.termination, ..switches })
    }

    fn options(
        source: &Source<'_>,
        table: &DeviceTable,
        _: &BusPlan<Self>,
    ) -> Result<(), Complaint> {
        source.refuse([("auto_baud", span(&table.auto_baud))], "it is for a PROFIBUS")
    }

    fn master_plan(
        source: &Source<'_>,
        table: &MasterTable,
        bus: &BusPlan<Self>,
    ) -> Result<MasterPlan, Complaint> {
        source.refuse(of_dp_master(table), "it is for a DP master")?;
        let mac = source.mac(&table.address, "")?;
        let mut slaves: Vec<SlavePlan> = Vec::new();
        match &table.slave {
            Some(tables) => {
                for table in tables {
                    let slave = source.devicenet_slave(table)?;
                    let taken = slaves.iter().any(|other| other.mac == slave.mac);
                    source.new_slave(&table.address, taken, slave.mac == mac)?;
                    slaves.push(slave);
                }
            }
            None => {
                for mac in bus.devices.iter().filter_map(|device| device.switches.mac()) {
                    if !slaves.iter().any(|slave| slave.mac == mac) {
                        slaves.push(SlavePlan::poll(mac));
                    }
                }
                slaves.retain(|slave| slave.mac != mac);
            }
        }
        let name = table.name.clone();
        let time = |value: &Option<Spanned<TimeSpan>>, default| {
            value.as_ref().map_or(default, |time| time.get_ref().0)
        };
        Ok(MasterPlan {
            name: name.unwrap_or_else(|| default_name("scanner", mac.value())),
            mac,
            interval: time(&table.interval, Duration::from_millis(10)),
            interscan_delay: time(&table.interscan_delay, Duration::ZERO),
            termination: table.termination.unwrap_or(true),
            duplicate: is_true(&table.duplicate),
            slaves,
        })
    }
}

/// The keys that only a DP master has.
fn of_dp_master(table: &MasterTable) -> [Given; 7] {
    [
        ("slot_bits", span(&table.slot_bits)),
        ("min_station_delay", span(&table.min_station_delay)),
        ("watchdog", span(&table.watchdog)),
        ("highest_station_address", span(&table.highest_station_address)),
        ("gap_wait_rotations", span(&table.gap_wait_rotations)),
        ("retries", span(&table.retries)),
        ("token_rotation_bits", span(&table.token_rotation_bits)),
    ]
}

/// The keys that only a slave of a DP master has.
fn of_profibus(table: &SlaveTable) -> [Given; 8] {
    [
        ("class", span(&table.class)),
        ("configuration", span(&table.configuration)),
        ("direction", span(&table.direction)),
        ("scaling", span(&table.scaling)),
        ("steps_per_turn", span(&table.steps_per_turn)),
        ("total_resolution", span(&table.total_resolution)),
        ("groups", span(&table.groups)),
        ("preset", table.preset.first().map(|preset| preset.at.span())),
    ]
}

fn connection(table: &SlaveTable) -> Connection {
    table.connection.as_ref().map_or_else(Connection::default, |connection| *connection.get_ref())
}

impl Source<'_> {
    fn mac(&self, address: &Spanned<i64>, hint: &str) -> Result<MacId, Complaint> {
        u8::try_from(*address.get_ref()).ok().and_then(MacId::new).ok_or_else(|| {
            let message = format!("{} is no address: DeviceNet has 0–63{hint}", address.get_ref());
            self.complaint(address.span(), message)
        })
    }

    fn devicenet_switches(
        &self,
        table: &DeviceTable,
        rate: BitRate,
    ) -> Result<Switches, Complaint> {
        let value = match (&table.address, &table.switches) {
            (Some(address), None) => {
                let hint = ", and switches = 99 is how to simulate wrong switches";
                let mac = self.mac(address, hint)?;
                return Ok(Switches::set_to(mac.value(), rate));
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
        let SwitchTable { rotary: [rotary_1, rotary_2], dip } = match *value.get_ref() {
            SwitchesValue::Number(number) => return Ok(Switches::set_to(number, rate)),
            SwitchesValue::Each(table) => table,
        };
        if rotary_1 > 9 || rotary_2 > 9 {
            let message = "a rotary switch stands at 0 to 9".to_owned();
            return Err(self.complaint(value.span(), message));
        }
        let mut switches = Switches::set_to(rotary_1 * 10 + rotary_2, rate);
        if let Some([_, dip_2, dip_3]) = dip {
            (switches.dip_2, switches.dip_3) = (dip_2, dip_3);
        }
        if switches.bit_rate() != rate {
            let message = format!(
                "the DIP switches say {}, and the bus runs at {rate}: one wire carries one rate",
                switches.bit_rate()
            );
            return Err(self.complaint(value.span(), message));
        }
        Ok(switches)
    }

    /// A timer of a connection: two octets of milliseconds.
    fn rate(&self, value: &Spanned<TimeSpan>, name: &str) -> Result<u16, Complaint> {
        let time = value.get_ref().0;
        let millis = u16::try_from(time.as_millis()).ok();
        millis.filter(|_| time == Duration::from_millis(time.as_millis())).ok_or_else(|| {
            let given = value.get_ref();
            let message =
                format!("{given} is no {name}: it is 0 to 65535ms, in whole milliseconds");
            self.complaint(value.span(), message)
        })
    }

    fn exchange(&self, table: &SlaveTable, rate: u16) -> Result<Exchange, Complaint> {
        let trigger = match connection(table) {
            Connection::ChangeOfState => Trigger::ChangeOfState,
            Connection::Cyclic => Trigger::Cyclic,
            Connection::Poll | Connection::Explicit => {
                let spans = [
                    table.acknowledged.as_ref().map(Spanned::span),
                    table.production_inhibit.as_ref().map(Spanned::span),
                ];
                if let Some(span) = spans.into_iter().flatten().next() {
                    let message = "only a change-of-state or cyclic connection has this";
                    return Err(self.complaint(span, message.into()));
                }
                return Ok(match connection(table) {
                    Connection::Explicit => Exchange::Explicit,
                    _ => Exchange::Poll,
                });
            }
        };
        let production_inhibit = match &table.production_inhibit {
            None => 0,
            Some(inhibit) => {
                let millis = self.rate(inhibit, "production inhibit time")?;
                if rate != 0 && millis > rate {
                    let message = format!("it is longer than the expected packet rate, {rate}ms");
                    return Err(self.complaint(inhibit.span(), message));
                }
                millis
            }
        };
        let acknowledged = table.acknowledged.as_ref().is_none_or(|value| *value.get_ref());
        Ok(Exchange::Change { trigger, acknowledged, production_inhibit })
    }

    fn devicenet_slave(&self, table: &SlaveTable) -> Result<SlavePlan, Complaint> {
        self.refuse(of_profibus(table), "it is for slaves of a DP master")?;
        let mut slave = SlavePlan::poll(self.mac(&table.address, "")?);
        if connection(table) == Connection::ChangeOfState {
            slave.expected_packet_rate = 1_000;
        }
        if let Some(rate) = &table.expected_packet_rate {
            slave.expected_packet_rate = self.rate(rate, "expected packet rate")?;
            if connection(table) == Connection::Cyclic && slave.expected_packet_rate == 0 {
                let message = "a cyclic slave needs an expected packet rate of at least 1ms";
                return Err(self.complaint(rate.span(), message.into()));
            }
        }
        slave.exchange = self.exchange(table, slave.expected_packet_rate)?;
        slave.assembly = table.assembly.as_ref().map(|assembly| *assembly.get_ref());
        slave.identity = match (&table.vendor, &table.product_code) {
            (None, None) => None,
            (Some(vendor), Some(code)) => Some((*vendor.get_ref(), *code.get_ref())),
            (Some(one), None) | (None, Some(one)) => {
                let message = "vendor and product_code are given together or not at all";
                return Err(self.complaint(one.span(), message.into()));
            }
        };
        Ok(slave)
    }
}
