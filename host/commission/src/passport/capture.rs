//! The passports of encoders that nobody can ask any more: from the recorded start-up of their bus.

mod devicenet;
mod profibus;

use std::collections::BTreeMap;
use std::io::BufRead;

use codewheel_capture::{Decoder, Medium, ReadError, Reader, Said, Timestamp};
use codewheel_device::product::Bus;
use jiff::Timestamp as Moment;

use self::devicenet::DeviceNetTraces;
use self::profibus::ProfibusTraces;
use super::{Nameplate, Passport, Position, Project, Setting, Source, whole_seconds};
use crate::{Kind, Reading, Trouble};

/// Makes a passport of each encoder that a capture shows, in the order of its buses and addresses.
///
/// It knows what was said: settings that were written or read, identities that were asked for, positions
/// that were sent. A setting that was written and then overthrown by another one, by Restore or Reset,
/// is not known. What the capture did not show is named in [`Passport::absent`]. The moment of a passport
/// is that of the last word of its encoder.
///
/// `complain` hears of places in the file that cannot be read; it goes on behind them where it can.
///
/// # Errors
/// [`Kind::Usage`] where no encoder is in the capture.
pub fn from_capture<R: BufRead>(
    reader: &mut Reader<R>,
    program: &str,
    complain: &mut dyn FnMut(&ReadError),
) -> Result<Vec<Passport>, Trouble> {
    let mut decoder = Decoder::default();
    let mut buses: BTreeMap<u16, Traces> = BTreeMap::new();
    let mut records = 0_u64;
    loop {
        match reader.read() {
            Ok(None) => break,
            Err(error) => complain(&error),
            Ok(Some((bus, record))) => {
                records += 1;
                let traces = buses.entry(record.bus).or_insert_with(|| Traces::of(bus.medium));
                traces.set_bit_rate(bus.bits_per_second);
                let at = record.at;
                decoder.hear(bus, &record, &mut |said| traces.take_in(at, said));
            }
        }
    }
    let passports: Vec<Passport> =
        buses.values().flat_map(|traces| traces.passports(program)).collect();
    if passports.is_empty() {
        return Err(Trouble::new(
            Kind::Usage,
            "make a passport of the capture",
            format!("none of its {records} frames and telegrams shows an encoder"),
            "record the start-up of the bus: its master sends the settings then",
        ));
    }
    Ok(passports)
}

/// What was said on one bus.
enum Traces {
    DeviceNet(Box<DeviceNetTraces>),
    Profibus(Box<ProfibusTraces>),
}

impl Traces {
    fn of(medium: Medium) -> Self {
        match medium {
            Medium::DeviceNet => Self::DeviceNet(Box::default()),
            Medium::Profibus => Self::Profibus(Box::default()),
        }
    }

    fn set_bit_rate(&mut self, bits_per_second: Option<u32>) {
        match self {
            Self::DeviceNet(traces) => traces.bit_rate = bits_per_second,
            Self::Profibus(traces) => traces.bit_rate = bits_per_second,
        }
    }

    fn take_in(&mut self, at: Timestamp, said: Said<'_>) {
        match (self, said) {
            (Self::DeviceNet(traces), Said::DeviceNet(said)) => traces.take_in(at, &said),
            (Self::Profibus(traces), Said::Profibus(said)) => traces.take_in(at, &said),
            _ => {}
        }
    }

    fn passports(&self, program: &str) -> Vec<Passport> {
        match self {
            Self::DeviceNet(traces) => traces.passports(program),
            Self::Profibus(traces) => traces.passports(program),
        }
    }
}

/// The last positions of an encoder, to see whether it stood.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// The newest one.
    last: Option<u32>,
    /// Since when all were within a step of the first of them.
    since: Option<(Timestamp, u32)>,
    at: Timestamp,
}

/// So long it must have stood to count as at rest.
const REST: u64 = 250_000_000;

impl Seen {
    fn add(&mut self, at: Timestamp, position: u32) {
        match self.since {
            Some((_, first)) if first.abs_diff(position) <= 1 => {}
            _ => self.since = Some((at, position)),
        }
        self.last = Some(position);
        self.at = at;
    }

    /// Whether it stood at the end; `None` where it was not seen for long enough.
    fn at_rest(&self, begun: Option<Timestamp>) -> Option<bool> {
        let (since, _) = self.since?;
        if self.at.since(since).as_nanos() >= REST {
            return Some(true);
        }
        // It has moved within that time, or was not seen for so long.
        begun.filter(|begun| *begun < since).map(|_| false)
    }
}

/// A passport without anything that must be learned.
fn blank(bus: Bus, address: u8, bit_rate: Option<u32>, last: Timestamp, program: &str) -> Passport {
    let nanos = i128::from(last.as_nanos());
    Passport {
        taken: whole_seconds(Moment::from_nanosecond(nanos).unwrap_or(Moment::UNIX_EPOCH)),
        program: program.to_owned(),
        source: Source::Capture,
        absent: Vec::new(),
        bus,
        address,
        bit_rate,
        nameplate: Nameplate::default(),
        settings: Vec::new(),
        position: Position::default(),
        project: Project::default(),
    }
}

fn number(name: &str, number: i64, note: String) -> Setting {
    Setting { name: name.to_owned(), reading: Reading::Number(number), note }
}

/// The names of those that are missing.
fn absent<'a>(of: impl IntoIterator<Item = (&'a str, bool)>) -> Vec<String> {
    of.into_iter().filter(|(_, is_known)| !is_known).map(|(name, _)| name.to_owned()).collect()
}
