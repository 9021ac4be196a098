//! What a running plant tells people.

use std::fmt;
use std::path::PathBuf;

use codewheel_device::Event;
use codewheel_link::Notice;
use codewheel_station::Instant;

/// Something that happened in a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// When, from the start of the plant.
    pub at: Instant,
    /// What.
    pub what: What,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// The device tells it.
    Device(Event),
    /// The device tells it again and again; only now and then it is reported.
    Repeated {
        /// What it tells.
        event: Event,
        /// How often, since it was reported last.
        count: u64,
    },
    /// A fault begins.
    FaultBegins(String),
    /// A fault that lasted is over.
    FaultEnds(String),
    /// A damaged memory file was set aside under this name.
    SetAside(PathBuf),
    /// The memory did not take a record.
    NotKept(String),
    /// A master tells it.
    Master {
        /// What messages call it.
        name: String,
        /// What it tells.
        text: String,
        /// Whether a person should look at it.
        trouble: bool,
    },
    /// The port tells it.
    Port(Notice),
    /// The bus is wired wrongly.
    Wiring(String),
    /// Somebody has done it to the device.
    Hand(String),
    /// So many reports were lost because nobody fetched them.
    Lost(u64),
}

impl What {
    /// Whether something went wrong that a person should look at.
    #[must_use]
    pub const fn is_trouble(&self) -> bool {
        match self {
            Self::Device(event) | Self::Repeated { event, .. } => event.is_trouble(),
            Self::Master { trouble, .. } => *trouble,
            Self::Port(notice) => notice.is_trouble(),
            Self::Hand(_) => false,
            _ => true,
        }
    }

    /// Whether something of the person who runs the plant may be lost, which is said to the quiet
    /// too.
    #[must_use]
    pub const fn is_loss(&self) -> bool {
        matches!(self, Self::SetAside(_) | Self::NotKept(_))
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Device(event) => event.fmt(f),
            Self::Repeated { event, count } => write!(f, "{event} ({count} times)"),
            Self::FaultBegins(fault) => write!(f, "fault: {fault}"),
            Self::FaultEnds(fault) => write!(f, "fault over: {fault}"),
            Self::SetAside(path) => write!(
                f,
                "the memory file was damaged: it is now {}, and the encoder runs with the defaults",
                path.display()
            ),
            Self::NotKept(error) => f.write_str(error),
            Self::Master { name, text, .. } => write!(f, "{name}: {text}"),
            Self::Port(notice) => notice.fmt(f),
            Self::Wiring(text) | Self::Hand(text) => f.write_str(text),
            Self::Lost(count) => write!(f, "{count} reports were lost before they were fetched"),
        }
    }
}

/// Reports kept until they are fetched; beyond them the oldest are lost, and counted.
const REPORTS: usize = 256;

/// Reports that wait to be fetched.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    waiting: Vec<Report>,
    lost: u64,
}

impl Reports {
    pub(crate) fn push(&mut self, at: Instant, what: What) {
        if self.waiting.len() == REPORTS {
            self.waiting.remove(0);
            self.lost += 1;
        }
        self.waiting.push(Report { at, what });
    }

    pub(crate) fn take(&mut self) -> Vec<Report> {
        let mut reports = std::mem::take(&mut self.waiting);
        let lost = std::mem::take(&mut self.lost);
        if lost > 0 {
            let at = reports.first().map_or(Instant::ZERO, |report| report.at);
            reports.insert(0, Report { at, what: What::Lost(lost) });
        }
        reports
    }
}

/// Puts reports that were not fetched before newer ones.
pub(crate) fn prepend(older: Vec<Report>, newer: &mut Vec<Report>) {
    if older.is_empty() {
        return;
    }
    let mut both = Reports::default();
    for Report { at, what } in older.into_iter().chain(newer.drain(..)) {
        match what {
            What::Lost(count) => both.lost += count,
            what => both.push(at, what),
        }
    }
    *newer = both.take();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(range: std::ops::Range<u64>) -> Vec<Report> {
        range
            .map(|nanos| Report {
                at: Instant::from_nanos(nanos),
                what: What::Device(Event::Saved),
            })
            .collect()
    }

    #[test]
    fn reports_that_nobody_fetched_come_before_newer_ones_and_the_lost_are_counted() {
        let mut newer = numbered(3..5);
        prepend(numbered(0..3), &mut newer);
        assert_eq!(newer, numbered(0..5));
        let mut newer = numbered(200..300);
        prepend(numbered(0..200), &mut newer);
        assert_eq!(newer[0].what, What::Lost(44));
        let mut newest = numbered(300..400);
        prepend(newer, &mut newest);
        assert_eq!(newest[0].what, What::Lost(144));
        assert_eq!(newest[1..], numbered(144..400));
    }
}
