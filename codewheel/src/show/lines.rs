//! One line for each device and second.

use std::io::{self, Write};

use codewheel_plant::{BusSnapshot, DeviceSnapshot, SlaveSnapshot};

use super::{Show, cycle_ms, fresh, strangers, word};

pub(super) struct Lines {
    names_buses: bool,
}

impl Lines {
    /// Several buses are named in each line.
    pub(super) const fn new(buses: usize) -> Self {
        Self { names_buses: buses > 1 }
    }
}

impl Show for Lines {
    fn draw(&mut self, newest: &[Option<BusSnapshot>], places: &[usize]) -> io::Result<()> {
        let mut out = io::stdout().lock();
        for bus in fresh(newest, places) {
            let name = if self.names_buses { format!("bus {} ", bus.name) } else { "".into() };
            for device in &bus.devices {
                writeln!(out, "{} {name}{}", bus.at, line(device))?;
            }
            for (address, slave) in strangers(bus) {
                writeln!(out, "{} {name}{}", bus.at, stranger(*address, slave))?;
            }
        }
        out.flush()
    }
}

fn line(device: &DeviceSnapshot) -> String {
    let mut line = format!("address {} {}", device.address, device.product.model);
    match &device.device {
        Some(device) => line.push_str(&format!(
            " position {} turns {} speed {} steps/s",
            device.position,
            device.turns(),
            device.velocity
        )),
        None => line.push_str(" no power"),
    }
    let lamp = device.state.lamp.text.replace(' ', "-");
    line.push_str(&format!(" led {lamp} connection {}", device.state.connection));
    if let Some(master) = &device.master {
        line.push_str(&seen(master));
    }
    line
}

/// A slave that is no device of this plant.
fn stranger(address: u8, slave: &SlaveSnapshot) -> String {
    let position = slave.position.map_or(String::new(), |position| format!(" position {position}"));
    format!("address {address}{position} connection {}{}", word(slave.state), seen(slave))
}

fn seen(slave: &SlaveSnapshot) -> String {
    format!(" polls/s {:.0} cycle {:.3} ms", slave.answers_per_second, cycle_ms(slave))
}
