//! What a PROFIBUS encoder keeps: one offset with the settings it was made under, and the turns that
//! settings without an offset count from.
//!
//! Everything else comes from the master with each start.

use codewheel_encoder::{Block, Direction, Encoder, Kept, Model, Reference, Refusal, Settings};
use codewheel_station::{Deadline, Instant};

use super::parameters::Parameters;
use crate::keeping::{MemoryState, Upkeep};

/// Where the range of settings begins whose number of turns is not 2ⁿ.
///
/// Decision: without it the position under such settings would be another one after each power-off,
/// as long as there was no preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Turns {
    settings: Settings,
    /// k₀.
    crossings_at_change: i64,
}

/// What a record holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Content {
    /// The settings the preset was made under, with its offset; the defaults before there was one.
    preset: Block,
    /// The settings put in force last of those that need turns and have no preset.
    turns: Option<Turns>,
}

impl Content {
    fn needs_reference(&self, model: Model) -> bool {
        self.turns.is_some() || self.preset.needs_reference(model)
    }
}

/// What is kept, what shall be, and what is on its way.
#[derive(Clone, Debug)]
pub(super) struct Keeping {
    pub(super) upkeep: Upkeep,
    /// As it is in memory.
    kept: Content,
    /// As the record on its way has it.
    written: Content,
    /// As it shall be.
    wanted: Content,
    /// There was a preset since the last record: it ends the mark that both were damaged once.
    has_preset: bool,
    /// There is one in the record on its way.
    writes_preset: bool,
}

impl Keeping {
    /// What the record holds, for an encoder of `model`; the defaults without one.
    ///
    /// # Errors
    /// The model cannot measure with what the record holds.
    pub(super) fn new(
        model: Model,
        kept: Option<&Kept>,
        memory: MemoryState,
    ) -> Result<Self, Refusal> {
        let defaults = Block::default_for(model);
        let bus = kept.map_or(Bus::default(), |kept| Bus::read(&kept.bus));
        let content =
            Content { preset: kept.map_or(defaults, |kept| kept.saved), turns: bus.turns };
        content.preset.check(model)?;
        if let Some(turns) = content.turns {
            turns.settings.check(model)?;
        }
        let memory = if bus.damaged { MemoryState::Damaged } else { memory };
        Ok(Self::holding(content, Upkeep::new(kept, memory)))
    }

    /// Nothing is kept that `model` could measure with.
    pub(super) fn empty(model: Model, memory: MemoryState) -> Self {
        let content = Content { preset: Block::default_for(model), turns: None };
        Self::holding(content, Upkeep::new(None, memory))
    }

    const fn holding(content: Content, upkeep: Upkeep) -> Self {
        Self {
            upkeep,
            kept: content,
            written: content,
            wanted: content,
            has_preset: false,
            writes_preset: false,
        }
    }

    /// The offset in memory, with the settings it was made under.
    pub(super) const fn saved(&self) -> Block {
        self.kept.preset
    }

    /// The offset that is kept, or will be, with the settings it was made under.
    pub(super) const fn preset(&self) -> Block {
        self.wanted.preset
    }

    /// What belongs to `parameters`: their offset, or where their turns begin; `None` where nothing
    /// is known of them.
    pub(super) fn block_for(&self, parameters: &Parameters) -> Option<Block> {
        let Parameters { class_2, settings } = *parameters;
        let Content { preset, turns } = self.wanted;
        if class_2 && preset.settings == settings {
            return Some(preset);
        }
        let turns = turns.filter(|turns| turns.settings == settings)?;
        Some(Block {
            settings,
            preset: 0,
            offset: 0,
            crossings_at_change: turns.crossings_at_change,
            cos_delta: 1,
        })
    }

    /// Keeps where the turns of `block` begin, where that matters and is not known yet.
    pub(super) fn keep_turns(&mut self, model: Model, block: &Block) {
        let Block { settings, crossings_at_change, .. } = *block;
        let is_known = self.block_for(&Parameters { class_2: true, settings }).is_some();
        if block.needs_reference(model) && !is_known {
            self.wanted.turns = Some(Turns { settings, crossings_at_change });
            self.ask();
        }
    }

    /// Keeps the offset of `block`: there was a preset.
    ///
    /// Decision: a preset that finds its offset in memory is not written, so that one repeated in
    /// every cycle wears nothing out.
    pub(super) fn keep_preset(&mut self, block: &Block) {
        if self.written.preset != *block {
            self.upkeep.hurry();
        }
        self.wanted.preset = *block;
        self.has_preset = true;
        self.ask();
    }

    fn ask(&mut self) {
        let coming = if self.upkeep.is_writing() { &self.written } else { &self.kept };
        let repairs = self.has_preset && self.upkeep.memory == MemoryState::Damaged;
        if self.wanted != *coming || repairs {
            self.upkeep.ask();
        }
    }

    /// Whether a record can be handed out at `now`.
    pub(super) fn is_due(&self, now: Instant) -> bool {
        self.upkeep.is_due(now, false)
    }

    /// The record to write next.
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
        self.written = self.wanted;
        self.writes_preset = core::mem::replace(&mut self.has_preset, false);
        let Content { preset, turns } = self.written;
        let needed = self.written.needs_reference(encoder.model());
        let reference = self.upkeep.begin(needed, encoder);
        let damaged = self.upkeep.memory == MemoryState::Damaged && !self.writes_preset;
        let writes = self.upkeep.writes.saturating_add(1);
        let bus = Bus { turns, damaged }.write();
        Some(Kept { fingerprint, saved: preset, reference, serial, writes, bus })
    }

    /// The write handed out last has ended.
    pub(super) fn kept(&mut self, now: Instant, good: bool) {
        if !self.upkeep.end(good) {
            return;
        }
        let preset = core::mem::replace(&mut self.writes_preset, false);
        if good {
            self.kept = self.written;
            if self.upkeep.memory == MemoryState::Fresh || preset {
                self.upkeep.memory = MemoryState::Good;
            }
        } else {
            self.has_preset |= preset;
            self.upkeep.retry(now);
        }
    }

    /// The power was cycled: what is in memory, or on its way there, is all that is left.
    pub(super) fn power_cycled(&mut self) -> (Block, Option<Reference>) {
        self.wanted = if self.upkeep.is_writing() { self.written } else { self.kept };
        self.has_preset = false;
        self.upkeep.forget();
        (self.wanted.preset, self.upkeep.coming_reference())
    }

    #[inline]
    pub(super) fn deadline(&self) -> Deadline {
        self.upkeep.deadline()
    }
}

/// The octets of the record that belong to the bus.
///
/// | octet | content |
/// |---|---|
/// | 0 | version, 1 |
/// | 1 | bit 0 both records were damaged and no preset has been kept since, bit 1 turns follow, bit 2 their direction is CCW |
/// | 2 … 5 | n of the turns, low octet first |
/// | 6 … 9 | T of the turns |
/// | 10 … 17 | k₀ of the turns, signed |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Bus {
    turns: Option<Turns>,
    damaged: bool,
}

const BUS_VERSION: u8 = 1;
const DAMAGED: u8 = 1 << 0;
const TURNS: u8 = 1 << 1;
const CCW: u8 = 1 << 2;

impl Bus {
    fn write(self) -> [u8; 24] {
        let mut octets = [0; 24];
        let [version, flags, rest @ ..] = &mut octets;
        *version = BUS_VERSION;
        *flags = if self.damaged { DAMAGED } else { 0 };
        if let Some(Turns { settings, crossings_at_change }) = self.turns {
            *flags |= TURNS | if settings.direction == Direction::Ccw { CCW } else { 0 };
            let steps = settings.steps_per_turn.to_le_bytes();
            let total = settings.total_resolution.to_le_bytes();
            let content = steps.into_iter().chain(total).chain(crossings_at_change.to_le_bytes());
            for (to, from) in rest.iter_mut().zip(content) {
                *to = from;
            }
        }
        octets
    }

    fn read(octets: &[u8; 24]) -> Self {
        let [version, flags, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, ..] = *octets;
        if version != BUS_VERSION {
            return Self::default();
        }
        let direction = if flags & CCW == 0 { Direction::Cw } else { Direction::Ccw };
        let turns = Turns {
            settings: Settings {
                direction,
                steps_per_turn: u32::from_le_bytes([a, b, c, d]),
                total_resolution: u32::from_le_bytes([e, f, g, h]),
                scaling: true,
            },
            crossings_at_change: i64::from_le_bytes([i, j, k, l, m, n, o, p]),
        };
        Self { turns: (flags & TURNS != 0).then_some(turns), damaged: flags & DAMAGED != 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_octets_of_the_bus_read_back_as_written() {
        for direction in [Direction::Cw, Direction::Ccw] {
            let settings = Settings {
                direction,
                steps_per_turn: 0x0001_0203,
                total_resolution: 0x1A2B_3C4D,
                scaling: true,
            };
            let turns = Turns { settings, crossings_at_change: -0x0102_0304_0506_0708 };
            for (turns, damaged) in [(Some(turns), false), (Some(turns), true), (None, true)] {
                let bus = Bus { turns, damaged };
                assert_eq!(Bus::read(&bus.write()), bus);
            }
        }
        assert_eq!(Bus::read(&[0; 24]), Bus::default());
    }
}
