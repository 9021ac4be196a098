//! A running plant on stdout: a live table, lines, or JSON objects.

mod json;
mod lines;
mod table;

use std::io::{self, IsTerminal};
use std::time::Duration;

use codewheel_device::{DeviceNetState, Network, ProfibusState};
use codewheel_devicenet::connection::State;
use codewheel_plant::{BusSnapshot, DeviceSnapshot, SlaveSnapshot, SlaveState};
use codewheel_profibus as profibus;

/// One way to show a plant.
pub(crate) trait Show {
    /// How often it wants snapshots.
    fn period(&self) -> Duration {
        Duration::from_secs(1)
    }

    /// Shows the newest snapshot of each bus, of which those at `fresh` are new.
    fn draw(&mut self, newest: &[Option<BusSnapshot>], fresh: &[usize]) -> io::Result<()>;

    /// Makes room for messages on stderr.
    fn make_room(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// JSON where it was asked for, a table on a terminal, lines elsewhere.
pub(crate) fn choose(json: bool, buses: usize) -> Box<dyn Show> {
    if json {
        Box::new(json::Json)
    } else if io::stdout().is_terminal() {
        Box::new(table::LiveTable::new(buses))
    } else {
        Box::new(lines::Lines::new(buses))
    }
}

/// The fresh ones among the newest snapshots.
fn fresh<'a>(
    newest: &'a [Option<BusSnapshot>],
    fresh: &'a [usize],
) -> impl Iterator<Item = &'a BusSnapshot> {
    fresh.iter().filter_map(|place| newest.get(*place)?.as_ref())
}

/// Where a device stands with its master, or, where nobody here masters it, what it says itself.
fn connection(device: &DeviceSnapshot) -> &'static str {
    let network = device.device.as_ref().map(|device| &device.network);
    if let Some(master) = &device.master {
        return match (master.state, network) {
            (SlaveState::Absent, _) => word(SlaveState::Absent),
            (_, Some(Network::Profibus(state))) => standing(state),
            (SlaveState::Running, Some(Network::DeviceNet(state))) => established(state),
            (state, _) => word(state),
        };
    }
    match network {
        None => "absent",
        Some(Network::Profibus(state)) => standing(state),
        Some(Network::DeviceNet(state)) => {
            match (state.poll.or(state.change_of_state), state.explicit) {
                (Some(State::Established), _) => established(state),
                (Some(State::TimedOut), _) => "timed-out",
                (Some(_), _) => "configuring",
                (None, Some(_)) => "explicit",
                (None, None) => "none",
            }
        }
    }
}

/// The slaves that a master of this bus serves and that are none of its devices, by address.
fn strangers(bus: &BusSnapshot) -> impl Iterator<Item = &(u8, SlaveSnapshot)> {
    let slaves = bus.masters.iter().flat_map(|master| &master.slaves);
    slaves.filter(|(address, _)| bus.devices.iter().all(|device| device.address != *address))
}

/// Where a slave stands of which only its master can tell.
const fn word(state: SlaveState) -> &'static str {
    match state {
        SlaveState::Absent => "absent",
        SlaveState::Configuring => "configuring",
        SlaveState::Running => "running",
        SlaveState::Refused => "refused",
    }
}

/// Which I/O connection a server exchanges data on.
const fn established(state: &DeviceNetState) -> &'static str {
    match (state.poll, state.change_of_state) {
        (Some(State::Established), Some(State::Established)) => "polled+cos",
        (Some(State::Established), _) => "polled",
        (_, Some(State::Established)) => "cos",
        _ => "explicit",
    }
}

/// Where a slave stands on its way to data exchange, with the names of the standard.
const fn standing(state: &ProfibusState) -> &'static str {
    match state.state {
        _ if state.baud_rate.is_none() => "baud-search",
        profibus::State::WaitPrm if state.faults.parameters || state.faults.not_supported => {
            "prm-fault"
        }
        profibus::State::WaitPrm if state.faults.configuration => "cfg-fault",
        profibus::State::WaitPrm => "wait-prm",
        profibus::State::WaitCfg => "wait-cfg",
        profibus::State::DataExchange => "data-exch",
    }
}

/// What the lamp says; dark without power.
fn lamp(device: &DeviceSnapshot) -> String {
    device.device.as_ref().map_or_else(|| "off".to_owned(), |device| device.lamp.to_string())
}

/// Turns a minute, from steps a second.
fn rpm(device: &codewheel_device::Snapshot) -> f64 {
    let steps = f64::from(device.in_force.settings.steps_per_turn);
    device.velocity as f64 * 60.0 / steps
}

/// The last cycle of the master, in milliseconds.
fn cycle_ms(master: &SlaveSnapshot) -> f64 {
    master.cycle.last.as_nanos() as f64 / 1e6
}
