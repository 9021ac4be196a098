//! `codewheel` alone: the demo plant, shown in a live table or in lines.

use std::io::{IsTerminal, Write};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use codewheel_devicenet::scanner::SlaveState;
use codewheel_plant::{EncoderSnapshot, Running, SegmentSnapshot, VirtualDeviceNet, demo};
use comfy_table::{Table, presets};
use crossterm::{cursor, queue, terminal};

use crate::arguments::Chatter;
use crate::failure::Failure;
use crate::signals::stop_flag;

/// How often the table is drawn anew.
const TABLE_PERIOD: Duration = Duration::from_millis(200);
/// How often there is a line for each encoder.
const LINE_PERIOD: Duration = Duration::from_secs(1);

pub(crate) fn run(chatter: Chatter) -> Result<(), Failure> {
    let stop = stop_flag(|| {})?;
    let on_terminal = std::io::stdout().is_terminal();
    let segment = VirtualDeviceNet::power_up(demo()).map_err(Failure::Plant)?;
    let running = segment.start(if on_terminal { TABLE_PERIOD } else { LINE_PERIOD });
    if chatter > Chatter::Quiet {
        eprintln!(
            "codewheel: a virtual DeviceNet at 500k with three encoders and a scanner; Ctrl-C ends \
             it, `codewheel --help` shows what else there is"
        );
    }
    let shown = show(&running, on_terminal, &|| stop.load(Ordering::Relaxed));
    match shown {
        // Who reads us has gone: `codewheel | head` is a clean end too.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

fn show(running: &Running, on_terminal: bool, stop: &dyn Fn() -> bool) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    let began = Instant::now();
    let mut drawn = 0;
    while !stop() {
        let Some(snapshot) = running.snapshot(Duration::from_millis(100)) else { continue };
        if on_terminal {
            if drawn > 0 {
                queue!(out, cursor::MoveToPreviousLine(drawn))?;
            }
            let text = table(&snapshot, began.elapsed());
            for line in text.lines() {
                queue!(out, terminal::Clear(terminal::ClearType::CurrentLine))?;
                writeln!(out, "{line}")?;
            }
            drawn = u16::try_from(text.lines().count()).unwrap_or(u16::MAX);
        } else {
            for encoder in &snapshot.encoders {
                writeln!(out, "{}", line(encoder, &snapshot))?;
            }
        }
        out.flush()?;
    }
    Ok(())
}

const fn connection(state: SlaveState) -> &'static str {
    match state {
        SlaveState::Absent => "absent",
        SlaveState::Configuring => "configuring",
        SlaveState::Running => "polled",
        SlaveState::Refused(_) => "refused",
    }
}

/// Turns a minute, from steps a second.
fn rpm(encoder: &EncoderSnapshot) -> f64 {
    let steps = f64::from(encoder.device.in_force.settings.steps_per_turn);
    encoder.device.velocity as f64 * 60.0 / steps
}

fn table(snapshot: &SegmentSnapshot, running_for: Duration) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_FULL_CONDENSED);
    table.set_header([
        "ADDRESS",
        "PRODUCT",
        "POSITION",
        "TURNS",
        "SPEED",
        "LED",
        "CONNECTION",
        "POLLS/S",
        "CYCLE",
    ]);
    for encoder in &snapshot.encoders {
        let device = &encoder.device;
        table.add_row([
            encoder.mac.to_string(),
            device.product.title.to_owned(),
            format!("{:>9}", device.position),
            format!("{:>5}", device.turns()),
            format!("{:>8} steps/s {:>7.1} rpm", device.velocity, rpm(encoder)),
            format!("{:<14}", device.lamp),
            format!("{:<11}", connection(encoder.state)),
            format!("{:>5.0}", encoder.polls_per_second),
            cycle(snapshot),
        ]);
    }
    format!(
        "{table}\n{} · {} · bus load {:>4.1} % · {:>5.0} s",
        snapshot.name,
        snapshot.bit_rate,
        snapshot.bus_load * 100.0,
        running_for.as_secs_f64()
    )
}

fn cycle(snapshot: &SegmentSnapshot) -> String {
    format!("{:.3} ms", snapshot.cycle.last.as_nanos() as f64 / 1e6)
}

fn line(encoder: &EncoderSnapshot, snapshot: &SegmentSnapshot) -> String {
    let device = &encoder.device;
    format!(
        "{} address {} {} position {} turns {} speed {} steps/s led {} connection {} polls/s {:.0} \
         cycle {}",
        snapshot.at,
        encoder.mac,
        device.product.model,
        device.position,
        device.turns(),
        device.velocity,
        device.lamp.to_string().replace(' ', "-"),
        connection(encoder.state),
        encoder.polls_per_second,
        cycle(snapshot),
    )
}
