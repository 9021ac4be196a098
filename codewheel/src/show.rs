//! A running plant on stdout: a live table, lines, or JSON objects.

mod json;
mod lines;
mod table;

use std::io::{self, IsTerminal};
use std::time::Duration;

use codewheel_devicenet::connection::State;
use codewheel_devicenet::scanner::SlaveState;
use codewheel_plant::{BusSnapshot, DeviceSnapshot};

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
    if let Some(master) = &device.master {
        return match master.state {
            SlaveState::Absent => "absent",
            SlaveState::Configuring => "configuring",
            SlaveState::Running => match device.device.as_ref().map(established) {
                Some(kind) => kind,
                None => "running",
            },
            SlaveState::Refused(_) => "refused",
        };
    }
    let Some(device) = &device.device else { return "absent" };
    match (device.poll.or(device.change_of_state), device.explicit) {
        (Some(State::Established), _) => established(device),
        (Some(State::TimedOut), _) => "timed-out",
        (Some(_), _) => "configuring",
        (None, Some(_)) => "explicit",
        (None, None) => "none",
    }
}

/// Which I/O connection a device exchanges data on.
const fn established(device: &codewheel_device::Snapshot) -> &'static str {
    match (device.poll, device.change_of_state) {
        (Some(State::Established), Some(State::Established)) => "polled+cos",
        (Some(State::Established), _) => "polled",
        (_, Some(State::Established)) => "cos",
        _ => "explicit",
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

/// The last poll cycle of the master, in milliseconds.
fn cycle_ms(device: &DeviceSnapshot) -> Option<f64> {
    let master = device.master.as_ref()?;
    Some(master.cycle.last.as_nanos() as f64 / 1e6)
}
