//! A running plant on stdout: a live table, lines, or JSON objects.

mod json;
mod lines;
mod table;

use std::io::{self, IsTerminal};
use std::time::Duration;

use codewheel_plant::{BusSnapshot, SlaveSnapshot, SlaveState};

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

/// Turns a minute, from steps a second.
fn rpm(device: &codewheel_device::Snapshot) -> f64 {
    let steps = f64::from(device.in_force.settings.steps_per_turn);
    device.velocity as f64 * 60.0 / steps
}

/// The last cycle of the master, in milliseconds.
fn cycle_ms(master: &SlaveSnapshot) -> f64 {
    master.cycle.last.as_nanos() as f64 / 1e6
}
