//! What a DeviceNet encoder keeps: the saved block, the settings of the connections.
//!
//! Automatic writes carry the *saved* block, never an unsaved setting. A Save is answered when its
//! own record has been written, after 5 s at the latest.

use codewheel_devicenet::{NetworkSettings, ProducedPath};
use codewheel_encoder::{Block, Encoder, Kept};
use codewheel_station::{Deadline, Duration, Instant};

use crate::keeping::{MemoryState, Upkeep};

/// How long a Save waits for the memory.
pub(super) const KEEP_TIME: Duration = Duration::from_secs(5);

/// New saved settings on their way into memory.
#[derive(Clone, Copy, Debug)]
struct Save {
    /// What was in force when it was asked for.
    block: Block,
    /// Whether the network settings go back to their defaults with it.
    resets_network: bool,
    /// Whether its record has been handed out.
    is_writing: bool,
}

/// What is kept, what shall be, and what is on its way.
#[derive(Clone, Debug)]
pub(super) struct Keeping {
    pub(super) upkeep: Upkeep,
    /// The saved block, as it is in memory.
    pub(super) saved: Block,
    /// A Save whose record is not yet in memory.
    save: Option<Save>,
    /// When the Save is answered as failed; never when nobody waits.
    answer_by: Deadline,
    pub(super) consistency: u16,
    /// The network settings, as they are in memory.
    network: NetworkSettings,
    /// The network settings of the record on its way.
    written_network: NetworkSettings,
    /// The network settings, as they shall be.
    pub(super) wanted_network: NetworkSettings,
}

/// What the end of a write means for the one who waits for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// An automatic write, well or not.
    Automatic,
    /// The settings asked for are kept; whether somebody waits to hear it.
    Saved {
        /// Whether it is to be answered.
        answer: bool,
    },
    /// They are not.
    Failed {
        /// Whether it is to be answered.
        answer: bool,
    },
}

impl Keeping {
    pub(super) fn new(saved: Block, kept: Option<&Kept>, memory: MemoryState) -> Self {
        let bus = kept.map_or_else(Bus::default, |kept| Bus::read(&kept.bus));
        let memory = if bus.damaged { MemoryState::Damaged } else { memory };
        Self {
            upkeep: Upkeep::new(kept, memory),
            saved,
            save: None,
            answer_by: Deadline::NEVER,
            consistency: bus.consistency,
            network: bus.network,
            written_network: bus.network,
            wanted_network: bus.network,
        }
    }

    /// Asks for an automatic write of `network`, unless that is what is kept or on its way.
    pub(super) fn keep_network(&mut self, network: NetworkSettings) {
        self.wanted_network = network;
        let coming = if self.upkeep.is_writing() { self.written_network } else { self.network };
        if network != coming {
            self.upkeep.ask();
        }
    }

    /// Asks for new saved settings, and for an answer; `false` while the record of an earlier Save
    /// is on its way.
    pub(super) fn save(&mut self, now: Instant, block: Block, resets_network: bool) -> bool {
        if self.writes_save() {
            return false;
        }
        self.save = Some(Save { block, resets_network, is_writing: false });
        self.answer_by = Deadline::at(now + KEEP_TIME);
        true
    }

    /// Whether a Save has not come to its end.
    pub(super) const fn is_saving(&self) -> bool {
        self.save.is_some()
    }

    /// Whether the record of a Save is on its way into memory.
    fn writes_save(&self) -> bool {
        self.save.is_some_and(|save| save.is_writing)
    }

    /// Whether a record can be handed out at `now`.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        self.upkeep.is_due(now, self.save.is_some())
    }

    /// Whether nothing is to be written, but for an automatic write that has failed.
    pub(super) fn is_idle(&self) -> bool {
        self.save.is_none() && self.upkeep.is_idle()
    }

    /// The record to write next. A block that needs a crossing reference gets the one of now.
    pub(super) fn next(
        &mut self,
        now: Instant,
        fingerprint: u16,
        serial: u32,
        encoder: &Encoder,
    ) -> Option<Kept> {
        if !self.is_due(now) {
            return None;
        }
        let (saved, network) = match &mut self.save {
            Some(save) => {
                save.is_writing = true;
                let reset = save.resets_network;
                (save.block, if reset { NetworkSettings::default() } else { self.wanted_network })
            }
            None => (self.saved, self.wanted_network),
        };
        let reference = self.upkeep.begin(saved.needs_reference(encoder.model()), encoder);
        self.written_network = network;
        let bus = Bus {
            network,
            consistency: self.consistency_of(&saved),
            // Only a Save ends the mark that both records were damaged once.
            damaged: self.upkeep.memory == MemoryState::Damaged && self.save.is_none(),
        };
        let writes = self.upkeep.writes.saturating_add(1);
        Some(Kept { fingerprint, saved, reference, serial, writes, bus: bus.write() })
    }

    /// The configuration consistency value with `saved` and the network settings on their way:
    /// another one when kept settings change.
    fn consistency_of(&self, saved: &Block) -> u16 {
        let changed = *saved != self.saved || self.written_network != self.network;
        if changed { self.consistency.wrapping_add(1) } else { self.consistency }
    }

    /// The write handed out last has ended.
    pub(super) fn kept(&mut self, now: Instant, good: bool) -> Outcome {
        if !self.upkeep.end(good) {
            return Outcome::Automatic;
        }
        let save = if self.writes_save() { self.save.take() } else { None };
        if good {
            let saved = save.map_or(self.saved, |save| save.block);
            self.consistency = self.consistency_of(&saved);
            self.saved = saved;
            self.network = self.written_network;
            if self.upkeep.memory == MemoryState::Fresh || save.is_some() {
                self.upkeep.memory = MemoryState::Good;
            }
            if save.is_some_and(|save| save.resets_network) {
                self.wanted_network = self.network;
            }
        } else if save.is_none() || self.wanted_network != self.network {
            // What was to be kept at once still is.
            self.upkeep.retry(now);
        }
        if save.is_none() {
            return Outcome::Automatic;
        }
        // A Save that was answered as failed, because it took too long, is not answered again.
        let answer = !self.answer_by.is_never();
        self.answer_by = Deadline::NEVER;
        if good { Outcome::Saved { answer } } else { Outcome::Failed { answer } }
    }

    /// The power was cycled: nobody waits any more, and a Save whose record has not been fetched is
    /// gone like every other setting that was not kept.
    pub(super) fn power_cycled(&mut self) {
        self.answer_by = Deadline::NEVER;
        if !self.writes_save() {
            self.save = None;
        }
    }

    /// Whether the newest Save has waited for too long; then it is to be answered as failed, and is
    /// off where its record has not even been fetched.
    pub(super) fn overdue(&mut self, now: Instant) -> bool {
        self.upkeep.advance(now);
        let overdue = self.answer_by.take_due(now);
        if overdue && !self.writes_save() {
            self.save = None;
        }
        overdue
    }

    pub(super) fn deadline(&self) -> Deadline {
        self.answer_by.min(self.upkeep.deadline())
    }
}

/// The octets of the record that belong to the bus.
///
/// | octet | content |
/// |---|---|
/// | 0 | version, 1 |
/// | 1 | bit 0 bus-off interrupt, bit 1 both records were damaged and nothing has been saved since |
/// | 2 … 3 | configuration consistency value |
/// | 4 … 5 | poll connection: assembly, whether its path names the attribute |
/// | 6 … 7 | change of state connection: the same |
/// | 8 | heartbeat interval in seconds |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Bus {
    network: NetworkSettings,
    consistency: u16,
    damaged: bool,
}

const BUS_VERSION: u8 = 1;
const BUS_OFF_INTERRUPT: u8 = 1 << 0;
const DAMAGED: u8 = 1 << 1;

impl Bus {
    fn write(self) -> [u8; 24] {
        let Self { network, consistency, damaged } = self;
        let NetworkSettings { bus_off_interrupt, heartbeat_interval, poll_path, change_path } =
            network;
        let interrupt = if bus_off_interrupt { BUS_OFF_INTERRUPT } else { 0 };
        let [low, high] = consistency.to_le_bytes();
        let content = [
            BUS_VERSION,
            interrupt | if damaged { DAMAGED } else { 0 },
            low,
            high,
            poll_path.assembly,
            u8::from(poll_path.names_attribute),
            change_path.assembly,
            u8::from(change_path.names_attribute),
            heartbeat_interval,
        ];
        let mut octets = [0; 24];
        for (to, from) in octets.iter_mut().zip(content) {
            *to = from;
        }
        octets
    }

    fn read(octets: &[u8; 24]) -> Self {
        let [version, flags, low, high, poll, poll_long, change, change_long, heartbeat, ..] =
            *octets;
        if version != BUS_VERSION {
            return Self::default();
        }
        let path = |assembly, long| ProducedPath { assembly, names_attribute: long != 0 };
        Self {
            network: NetworkSettings {
                bus_off_interrupt: flags & BUS_OFF_INTERRUPT != 0,
                heartbeat_interval: heartbeat,
                poll_path: path(poll, poll_long),
                change_path: path(change, change_long),
            },
            consistency: u16::from_le_bytes([low, high]),
            damaged: flags & DAMAGED != 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_octets_of_the_bus_read_back_as_written() {
        let network = NetworkSettings {
            bus_off_interrupt: true,
            heartbeat_interval: 200,
            poll_path: ProducedPath { assembly: 2, names_attribute: true },
            change_path: ProducedPath { assembly: 1, names_attribute: true },
        };
        for damaged in [false, true] {
            let bus = Bus { network, consistency: 0xBEEF, damaged };
            assert_eq!(Bus::read(&bus.write()), bus);
        }
        assert_eq!(Bus::read(&[0; 24]), Bus::default());
    }
}
