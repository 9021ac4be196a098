//! A table that is drawn anew in its place.

use std::io::{self, Write};
use std::time::Duration;

use codewheel_plant::{BusSnapshot, DeviceSnapshot, SlaveSnapshot};
use comfy_table::{Table, presets};
use crossterm::{cursor, execute, queue, terminal};

use super::{Show, cycle_ms, rpm, strangers, word};

/// How often the table is drawn anew.
const PERIOD: Duration = Duration::from_millis(200);

/// The table of all buses. While it lives the cursor is hidden and long lines are cut; dropping it
/// gives the terminal back as it was.
pub(super) struct LiveTable {
    names_buses: bool,
    /// Lines that stand on the screen.
    drawn: u16,
}

impl LiveTable {
    /// Several buses are named in each row.
    pub(super) fn new(buses: usize) -> Self {
        // Where the terminal does not take it, the first drawing will say so.
        let _ = execute!(io::stdout(), cursor::Hide, terminal::DisableLineWrap);
        Self { names_buses: buses > 1, drawn: 0 }
    }
}

impl Drop for LiveTable {
    fn drop(&mut self) {
        let _ = execute!(io::stdout(), terminal::EnableLineWrap, cursor::Show);
    }
}

impl Show for LiveTable {
    fn period(&self) -> Duration {
        PERIOD
    }

    fn draw(&mut self, newest: &[Option<BusSnapshot>], _: &[usize]) -> io::Result<()> {
        let mut out = io::stdout().lock();
        let text = text(newest, self.names_buses);
        // What does not fit cannot be reached by the cursor again. Some terminals say they have no
        // rows at all and mean that they do not know.
        let room = match terminal::size() {
            Ok((_, rows @ 2..)) => rows - 1,
            _ => u16::MAX,
        };
        let lines: Vec<&str> = text.lines().take(usize::from(room)).collect();
        if self.drawn > 0 {
            queue!(out, cursor::MoveToPreviousLine(self.drawn))?;
        }
        for line in &lines {
            queue!(out, terminal::Clear(terminal::ClearType::CurrentLine))?;
            writeln!(out, "{line}")?;
        }
        queue!(out, terminal::Clear(terminal::ClearType::FromCursorDown))?;
        self.drawn = lines.len() as u16;
        out.flush()
    }

    fn make_room(&mut self) -> io::Result<()> {
        if self.drawn == 0 {
            return Ok(());
        }
        let up = cursor::MoveToPreviousLine(std::mem::take(&mut self.drawn));
        execute!(io::stdout(), up, terminal::Clear(terminal::ClearType::FromCursorDown))
    }
}

const HEADER: [&str; 9] =
    ["ADDRESS", "PRODUCT", "POSITION", "TURNS", "SPEED", "LED", "CONNECTION", "POLLS/S", "CYCLE"];

fn text(newest: &[Option<BusSnapshot>], names_buses: bool) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    let bus_header = names_buses.then_some("BUS");
    table.set_header(bus_header.into_iter().chain(HEADER));
    let mut feet = String::new();
    for bus in newest.iter().flatten() {
        for device in &bus.devices {
            let name = names_buses.then(|| bus.name.clone());
            table.add_row(name.into_iter().chain(cells(device)));
        }
        for (address, slave) in strangers(bus) {
            let name = names_buses.then(|| bus.name.clone());
            table.add_row(name.into_iter().chain(stranger(*address, slave)));
        }
        let load =
            bus.load.map_or(String::new(), |load| format!(" · bus load {:>4.1} %", load * 100.0));
        let at = bus.at.as_nanos() as f64 / 1e9;
        feet.push_str(&format!("\n{} · {}{load} · {at:>5.0} s", bus.name, bus.bit_rate));
        if names_buses {
            feet.push_str(&format!(" · {}", bus.uri));
        }
    }
    format!("{table}{feet}")
}

fn cells(device: &DeviceSnapshot) -> [String; 9] {
    let unknown = || "–".to_owned();
    let of_device = |show: fn(&codewheel_device::Snapshot) -> String| {
        device.device.as_ref().map_or_else(unknown, show)
    };
    [
        device.address.to_string(),
        device.product.title.to_owned(),
        of_device(|device| format!("{:>9}", device.position)),
        of_device(|device| format!("{:>5}", device.turns())),
        of_device(|device| format!("{:>8} steps/s {:>7.1} rpm", device.velocity, rpm(device))),
        format!("{:<14}", device.state.lamp.text),
        format!("{:<11}", device.state.connection),
        device
            .master
            .as_ref()
            .map_or_else(unknown, |master| format!("{:>5.0}", master.answers_per_second)),
        device.master.as_ref().map_or_else(unknown, |slave| format!("{:.3} ms", cycle_ms(slave))),
    ]
}

/// A slave that is no device of this plant.
fn stranger(address: u8, slave: &SlaveSnapshot) -> [String; 9] {
    let unknown = || "–".to_owned();
    [
        address.to_string(),
        unknown(),
        slave.position.map_or_else(unknown, |position| format!("{position:>9}")),
        unknown(),
        unknown(),
        unknown(),
        format!("{:<11}", word(slave.state)),
        format!("{:>5.0}", slave.answers_per_second),
        format!("{:.3} ms", cycle_ms(slave)),
    ]
}
