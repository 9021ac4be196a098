//! Non-volatile memory as an effect: the device offers a record and is told when it is kept.
//!
//! Automatic writes carry the *saved* block, never an unsaved setting. A Save is answered when its
//! own record has been written, after 5 s at the latest.

use codewheel_devicenet::{NetworkSettings, ProducedPath};
use codewheel_encoder::{Block, Encoder, Kept, Reference};
use codewheel_station::{Deadline, Duration, Instant};

/// How long a Save waits for the memory.
pub(crate) const KEEP_TIME: Duration = Duration::from_secs(5);

/// What the memory said at power-up, and since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryState {
    /// Nothing was ever kept.
    Fresh,
    /// A record is kept.
    Good,
    /// Both records were damaged at power-up, and nothing has been saved since.
    Damaged,
}

/// A record on its way into memory.
#[derive(Clone, Copy, Debug)]
struct Writing {
    saved: Block,
    network: NetworkSettings,
    reference: Option<Reference>,
    consistency: u16,
    /// Whether it carries a Save rather than an automatic write.
    is_save: bool,
}

/// Which settings a Save that has not been handed out yet is to write.
///
/// Until a Save is answered no request changes the settings, so what is in force when its record is
/// handed out is what was in force when it was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    /// No Save: the saved settings stay.
    Nothing,
    /// Save: the settings in force become the saved ones.
    InForce,
    /// Reset of the Identity object, type 1: the defaults become the saved ones.
    Defaults,
}

/// What is kept, what shall be, and what is on its way.
#[derive(Clone, Debug)]
pub(crate) struct Keeping {
    /// The saved block, as it is in memory.
    pub(crate) saved: Block,
    /// The crossing reference, as it is in memory.
    pub(crate) reference: Option<Reference>,
    pub(crate) network: NetworkSettings,
    pub(crate) memory: MemoryState,
    pub(crate) writes: u32,
    pub(crate) consistency: u16,
    /// The network settings as they shall be kept.
    wanted_network: NetworkSettings,
    wanted: Wanted,
    due: bool,
    writing: Option<Writing>,
    /// When an unanswered Save is given up.
    answer_by: Deadline,
}

/// What the end of a write means for the one who waits for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Nobody waits.
    Nobody,
    Saved,
    Failed,
}

impl Keeping {
    pub(crate) fn new(saved: Block, kept: Option<&Kept>, memory: MemoryState) -> Self {
        let (network, consistency) =
            kept.map_or((NetworkSettings::default(), 0), |kept| read_bus(&kept.bus));
        Self {
            saved,
            reference: kept.and_then(|kept| kept.reference),
            network,
            memory,
            writes: kept.map_or(0, |kept| kept.writes),
            consistency,
            wanted_network: network,
            wanted: Wanted::Nothing,
            due: false,
            writing: None,
            answer_by: Deadline::NEVER,
        }
    }

    /// Asks for an automatic write with what the memory holds now and a new crossing reference.
    pub(crate) const fn refresh(&mut self) {
        self.due = true;
    }

    /// Asks for an automatic write of `network`.
    pub(crate) const fn keep_network(&mut self, network: NetworkSettings) {
        self.wanted_network = network;
        self.due = true;
    }

    /// Asks for new saved settings, and for an answer.
    pub(crate) fn save(&mut self, now: Instant, wanted: Wanted) {
        self.wanted = wanted;
        self.due = true;
        self.answer_by = Deadline::at(now + KEEP_TIME);
    }

    /// Whether a record is on its way into memory.
    pub(crate) const fn is_writing(&self) -> bool {
        self.writing.is_some()
    }

    /// Whether a record waits to be handed out.
    pub(crate) const fn is_due(&self) -> bool {
        self.due && self.writing.is_none()
    }

    /// The record to write next. A block that needs a crossing reference gets the one of now.
    pub(crate) fn next(
        &mut self,
        fingerprint: u16,
        serial: u32,
        encoder: &Encoder,
    ) -> Option<Kept> {
        if !self.is_due() {
            return None;
        }
        self.due = false;
        let is_save = self.wanted != Wanted::Nothing;
        let saved = match core::mem::replace(&mut self.wanted, Wanted::Nothing) {
            Wanted::Nothing => self.saved,
            Wanted::InForce => encoder.block(),
            Wanted::Defaults => encoder.default_block(),
        };
        let network = self.wanted_network;
        let changed = saved != self.saved || network != self.network;
        let consistency = if changed { self.consistency.wrapping_add(1) } else { self.consistency };
        self.writes = self.writes.saturating_add(1);
        let needed = saved.needs_reference(encoder.model());
        let reference = if needed { encoder.reference() } else { None };
        self.writing = Some(Writing { saved, network, reference, consistency, is_save });
        let bus = write_bus(network, consistency);
        Some(Kept { fingerprint, saved, reference, serial, writes: self.writes, bus })
    }

    /// The write handed out last has ended.
    pub(crate) fn kept(&mut self, good: bool) -> Answer {
        let Some(writing) = self.writing.take() else { return Answer::Nobody };
        if good {
            self.saved = writing.saved;
            self.network = writing.network;
            self.reference = writing.reference;
            self.consistency = writing.consistency;
            if self.memory == MemoryState::Fresh || writing.is_save {
                self.memory = MemoryState::Good;
            }
        }
        if !writing.is_save || self.answer_by == Deadline::NEVER {
            return Answer::Nobody;
        }
        self.answer_by = Deadline::NEVER;
        if good { Answer::Saved } else { Answer::Failed }
    }

    /// Whether a Save has waited for too long; then it is to be answered as failed, and is off
    /// where its record has not even been fetched.
    pub(crate) fn overdue(&mut self, now: Instant) -> bool {
        let overdue = self.answer_by.take_due(now);
        if overdue {
            self.wanted = Wanted::Nothing;
        }
        overdue
    }

    pub(crate) const fn deadline(&self) -> Deadline {
        self.answer_by
    }
}

/// The layout of the record's octets that belong to the bus: its version, then what
/// [`NetworkSettings`] has and the configuration consistency value.
const BUS_VERSION: u8 = 1;

fn write_bus(network: NetworkSettings, consistency: u16) -> [u8; 24] {
    let mut octets = [0; 24];
    let [low, high] = consistency.to_le_bytes();
    let path = network.poll_path;
    let content = [
        BUS_VERSION,
        u8::from(network.bus_off_interrupt),
        low,
        high,
        path.assembly,
        u8::from(path.names_attribute),
    ];
    for (to, from) in octets.iter_mut().zip(content) {
        *to = from;
    }
    octets
}

fn read_bus(octets: &[u8; 24]) -> (NetworkSettings, u16) {
    let [version, bus_off_interrupt, low, high, assembly, names_attribute, ..] = *octets;
    if version != BUS_VERSION {
        return (NetworkSettings::default(), 0);
    }
    let poll_path = ProducedPath { assembly, names_attribute: names_attribute != 0 };
    let network = NetworkSettings { bus_off_interrupt: bus_off_interrupt != 0, poll_path };
    (network, u16::from_le_bytes([low, high]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_octets_of_the_bus_read_back_as_written() {
        let poll_path = ProducedPath { assembly: 2, names_attribute: true };
        let network = NetworkSettings { bus_off_interrupt: true, poll_path };
        assert_eq!(read_bus(&write_bus(network, 0xBEEF)), (network, 0xBEEF));
        assert_eq!(read_bus(&[0; 24]), (NetworkSettings::default(), 0));
    }
}
