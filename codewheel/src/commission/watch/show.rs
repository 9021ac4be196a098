//! A motion on stdout: drawn in its place, as lines, as comma-separated values, as JSON.

use std::io::{self, IsTerminal, Write};

use crossterm::{cursor, execute, queue, terminal};

use super::motion::{Motion, Readout};
use crate::arguments::commission::WatchArguments;

/// One way to show a motion.
pub(super) trait Show {
    /// How often it is shown where nobody says otherwise, in times a second.
    fn rate(&self) -> f64;

    fn show(&mut self, readout: &Readout, motion: &Motion) -> io::Result<()>;
}

/// What was asked for; else the picture on a terminal, lines elsewhere. `who` is whom it is about.
pub(super) fn choose(arguments: &WatchArguments, who: String) -> Box<dyn Show> {
    if arguments.format.json {
        Box::new(Json)
    } else if arguments.csv {
        Box::new(Csv { has_heading: false })
    } else if io::stdout().is_terminal() {
        Box::new(Picture::new(who))
    } else {
        Box::new(Lines)
    }
}

struct Json;

impl Show for Json {
    fn rate(&self) -> f64 {
        10.0
    }

    fn show(&mut self, readout: &Readout, _: &Motion) -> io::Result<()> {
        let mut out = io::stdout().lock();
        writeln!(out, "{}", serde_json::to_string(readout)?)?;
        out.flush()
    }
}

struct Csv {
    has_heading: bool,
}

impl Show for Csv {
    fn rate(&self) -> f64 {
        10.0
    }

    fn show(&mut self, readout: &Readout, _: &Motion) -> io::Result<()> {
        let mut out = io::stdout().lock();
        // The keys of the JSON, so that there is one list of them.
        let serde_json::Value::Object(object) = serde_json::to_value(readout)? else {
            return Ok(());
        };
        if !self.has_heading {
            let keys: Vec<&str> = COLUMNS.to_vec();
            writeln!(out, "{}", keys.join(","))?;
            self.has_heading = true;
        }
        let cells = COLUMNS.iter().map(|column| match object.get(*column) {
            None | Some(serde_json::Value::Null) => String::new(),
            Some(value) => value.to_string(),
        });
        writeln!(out, "{}", cells.collect::<Vec<_>>().join(","))?;
        out.flush()
    }
}

/// The columns of the comma-separated values: the keys of the JSON.
const COLUMNS: [&str; 11] = [
    "at",
    "position",
    "turn",
    "degrees",
    "steps_per_second",
    "rpm",
    "alarm",
    "warning",
    "cycle_ms",
    "cycle_min_ms",
    "cycle_max_ms",
];

struct Lines;

impl Show for Lines {
    fn rate(&self) -> f64 {
        1.0
    }

    fn show(&mut self, readout: &Readout, _: &Motion) -> io::Result<()> {
        let mut out = io::stdout().lock();
        writeln!(
            out,
            "{:8.3} s  position {}{}  {}  {}  cycle {}",
            readout.at,
            readout.position,
            angle(readout),
            speed(readout),
            flags(readout),
            cycle(readout)
        )?;
        out.flush()
    }
}

/// Some lines that are drawn anew in their place. While it lives the cursor is hidden and long lines
/// are cut; dropping it gives the terminal back as it was.
struct Picture {
    who: String,
    /// Lines that stand on the screen.
    drawn: u16,
}

impl Picture {
    fn new(who: String) -> Self {
        // Where the terminal does not take it, the first drawing will say so.
        let _ = execute!(io::stdout(), cursor::Hide, terminal::DisableLineWrap);
        Self { who, drawn: 0 }
    }
}

impl Drop for Picture {
    fn drop(&mut self) {
        let _ = execute!(io::stdout(), terminal::EnableLineWrap, cursor::Show);
    }
}

impl Show for Picture {
    fn rate(&self) -> f64 {
        10.0
    }

    fn show(&mut self, readout: &Readout, motion: &Motion) -> io::Result<()> {
        let mut out = io::stdout().lock();
        if self.drawn > 0 {
            queue!(out, cursor::MoveToPreviousLine(self.drawn))?;
        }
        let lines = [
            self.who.clone(),
            format!("position  {:>10}{}", readout.position, angle(readout)),
            format!("speed     {}", speed(readout)),
            format!("          {}", sparkline(motion.minute())),
            format!("flags     {}", flags(readout)),
            format!("cycle     {}", cycle(readout)),
        ];
        for line in &lines {
            queue!(out, terminal::Clear(terminal::ClearType::CurrentLine))?;
            writeln!(out, "{line}")?;
        }
        self.drawn = lines.len() as u16;
        out.flush()
    }
}

fn angle(readout: &Readout) -> String {
    match (readout.turn, readout.degrees) {
        (Some(turn), Some(degrees)) => format!("  turn {turn} and {degrees:.2}°"),
        _ => String::new(),
    }
}

fn speed(readout: &Readout) -> String {
    let steps = readout.steps_per_second.map(|speed| format!("{speed:.0} steps/s"));
    let turns = readout.rpm.map(|rpm| format!("{rpm:.1} rpm"));
    let known: Vec<_> = steps.into_iter().chain(turns).collect();
    if known.is_empty() { "speed not known yet".to_owned() } else { known.join(", ") }
}

fn flags(readout: &Readout) -> String {
    let flag = |name: &str, state| match state {
        None => format!("{name} not told"),
        Some(false) => format!("no {name}"),
        Some(true) => name.to_uppercase(),
    };
    format!("{}, {}", flag("alarm", readout.alarm), flag("warning", readout.warning))
}

fn cycle(readout: &Readout) -> String {
    match (readout.cycle_ms, readout.cycle_min_ms, readout.cycle_max_ms) {
        (Some(last), Some(least), Some(most)) => {
            format!("{last:.2} ms ({least:.2} … {most:.2} ms)")
        }
        _ => "not known yet".to_owned(),
    }
}

/// Speeds as blocks, the slowest as low as the lowest; standing is in it, so that a small speed is
/// small.
fn sparkline(speeds: impl Iterator<Item = f64> + Clone) -> String {
    const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let least = speeds.clone().fold(0.0, f64::min);
    let most = speeds.clone().fold(0.0, f64::max);
    let block = |speed: f64| {
        let height = if most > least { (speed - least) / (most - least) } else { 0.0 };
        BLOCKS.get((height * 7.0).round() as usize).copied().unwrap_or('█')
    };
    speeds.map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_are_the_keys_of_the_json() {
        let sample = codewheel_commission::Sample {
            at: codewheel_station::Instant::ZERO,
            position: 1,
            alarm: None,
            warning: None,
            cycle: None,
        };
        let readout = Motion::new(Default::default()).take(sample);
        let text = serde_json::to_string(&readout).expect("JSON");
        let places: Vec<_> =
            COLUMNS.iter().map(|key| text.find(&format!("\"{key}\":")).expect(key)).collect();
        assert!(places.is_sorted(), "{text}");
        assert_eq!(text.matches("\":").count(), COLUMNS.len());
    }

    #[test]
    fn a_sparkline_shows_both_directions_and_a_shaft_that_stands() {
        assert_eq!(sparkline([0.0, 0.0].into_iter()), "▁▁");
        assert_eq!(sparkline([0.0, 50.0, 100.0].into_iter()), "▁▅█");
        assert_eq!(sparkline([-100.0, 0.0, 100.0].into_iter()), "▁▅█");
        assert_eq!(sparkline(std::iter::empty()), "");
    }
}
