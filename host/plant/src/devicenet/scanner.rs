//! The scanner of a plan, and what it has to show.

use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{
    self, ChangeSettings, DeviceIdentity, PollSettings, Scanner, ScannerIdentity, SlaveSettings,
};

use super::{DeviceNet, Exchange, MasterPlan, SlavePlan};
use crate::field_bus::{Seen, Talker};
use crate::snapshot::{CycleTimes, SlaveState};

/// The scanner of `plan`, at `place` among the masters of its bus.
pub(super) fn scanner(plan: &MasterPlan, place: usize) -> Scanner {
    // No vendor has the code FFFF.
    let identity = ScannerIdentity { vendor: 0xFFFF, serial: place as u32 + 1 };
    let mut scanner = Scanner::new(plan.mac, identity, plan.interval);
    scanner.set_interscan_delay(plan.interscan_delay);
    for slave in &plan.slaves {
        // A plan has no address twice, so there are never too many.
        let _ = scanner.add(slave_settings(slave));
    }
    scanner
}

fn slave_settings(slave: &SlavePlan) -> SlaveSettings {
    let SlavePlan { mac, exchange, expected_packet_rate, assembly, identity } = *slave;
    let identity = identity.map(|(vendor, product_code)| DeviceIdentity { vendor, product_code });
    let mut settings = SlaveSettings { identity, ..SlaveSettings::explicit(mac) };
    match exchange {
        Exchange::Poll => settings.poll = Some(PollSettings { expected_packet_rate, assembly }),
        Exchange::Change { trigger, acknowledged, production_inhibit } => {
            settings.change = Some(ChangeSettings {
                trigger,
                acknowledged,
                expected_packet_rate,
                production_inhibit,
                assembly,
            });
        }
        Exchange::Explicit => {}
    }
    settings
}

impl Talker<DeviceNet> for Scanner {
    fn slave(&self, address: u8) -> Option<Seen> {
        let slave = Self::slave(self, MacId::new(address)?)?;
        Some(Seen {
            state: match slave.state {
                scanner::SlaveState::Absent => SlaveState::Absent,
                scanner::SlaveState::Configuring => SlaveState::Configuring,
                scanner::SlaveState::Running => SlaveState::Running,
                scanner::SlaveState::Refused(_) => SlaveState::Refused,
            },
            position: slave.latest().and_then(|(_, input)| position(input)),
            answers: slave.responses + slave.changes,
            diagnosis: None,
        })
    }

    fn is_on_line(&self) -> bool {
        Self::is_on_line(self)
    }

    fn cycle_times(&self) -> CycleTimes {
        let scanner::CycleTimes { count, last, longest } = Self::cycle_times(self);
        CycleTimes { count, last, longest }
    }
}

/// The position in a poll response.
fn position(input: &[u8]) -> Option<u32> {
    input.first_chunk().map(|octets| u32::from_le_bytes(*octets))
}
