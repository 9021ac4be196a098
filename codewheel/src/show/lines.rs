//! One line for each device and second.

use std::io::{self, Write};

use codewheel_plant::{BusSnapshot, DeviceSnapshot};

use super::{Show, connection, cycle_ms, fresh, lamp};

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
            for device in &bus.devices {
                let name = if self.names_buses { format!("bus {} ", bus.name) } else { "".into() };
                writeln!(out, "{} {name}{}", bus.at, line(device))?;
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
    let lamp = lamp(device).replace(' ', "-");
    line.push_str(&format!(" led {lamp} connection {}", connection(device)));
    if let (Some(master), Some(cycle)) = (&device.master, cycle_ms(device)) {
        line.push_str(&format!(" polls/s {:.0} cycle {cycle:.3} ms", master.answers_per_second));
    }
    line
}
