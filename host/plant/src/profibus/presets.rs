//! The presets that a DP master gives, through outputs with the clock bit (PROFIBUS manual §7.4).

use std::collections::VecDeque;

use codewheel_commission::profibus::{Master, SlaveState};
use codewheel_station::Instant;

use super::PresetPlan;

/// Data exchanges in which outputs are surely seen once: the first of them may have been under way
/// already.
const SEEN: u64 = 2;

/// The presets of one slave.
#[derive(Debug)]
pub(super) struct Presetting {
    pub(super) address: u8,
    /// The octets of its outputs.
    outputs: u8,
    waiting: VecDeque<Waiting>,
    clock: ClockBit,
}

/// A preset that has not been given, or whose fate is unknown.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    at: Instant,
    value: u32,
    /// Whose it is, where somebody has asked for it.
    id: Option<u64>,
}

/// Where the top bit of the outputs stands, and since which answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ClockBit {
    /// The slave exchanges no data, or did not a moment ago.
    Unknown,
    Low {
        since: u64,
    },
    High {
        since: u64,
    },
}

impl Presetting {
    /// The presets of a plan for the slave at `address`, which has so many octets of outputs.
    pub(super) fn new(address: u8, outputs: u8, presets: &[PresetPlan]) -> Self {
        let waiting =
            |preset: &PresetPlan| Waiting { at: preset.at, value: preset.value, id: None };
        Self {
            address,
            outputs,
            waiting: presets.iter().map(waiting).collect(),
            clock: ClockBit::Unknown,
        }
    }

    /// Adds a preset that is due now.
    pub(super) fn ask(&mut self, now: Instant, value: u32, id: u64) {
        // The one that is being given stays at the head.
        let first = usize::from(matches!(self.clock, ClockBit::High { .. }));
        let due = self.waiting.iter().take_while(|preset| preset.at <= now).count();
        let place = due.max(first).min(self.waiting.len());
        self.waiting.insert(place, Waiting { at: now, value, id: Some(id) });
    }

    /// Whether the preset with this number has not been given.
    pub(super) fn waits(&self, id: u64) -> bool {
        self.waiting.iter().any(|preset| preset.id == Some(id))
    }

    /// Gives the preset with this number no more, unless it is being given.
    pub(super) fn forget(&mut self, id: u64) {
        let mut head = matches!(self.clock, ClockBit::High { .. });
        self.waiting.retain(|preset| std::mem::take(&mut head) || preset.id != Some(id));
    }

    pub(super) fn is_done(&self) -> bool {
        self.waiting.is_empty() && matches!(self.clock, ClockBit::Low { .. })
    }

    /// Moves the clock bit on.
    pub(super) fn tend(&mut self, now: Instant, master: &mut Master) {
        let Some(slave) = master.slave(self.address) else { return };
        let answers = slave.answers;
        if slave.state != SlaveState::DataExchange {
            if self.clock != ClockBit::Unknown {
                // A preset whose fate is unknown stands at the head still, and is given again.
                self.clock = ClockBit::Unknown;
                self.put(master, 0, false);
            }
            return;
        }
        match self.clock {
            // The slave must see the bit low first (decision: it counts as high at the entry).
            ClockBit::Unknown => self.clock = ClockBit::Low { since: answers },
            ClockBit::Low { since } if answers >= since + SEEN => {
                if let Some(preset) = self.waiting.front().filter(|preset| preset.at <= now) {
                    let value = preset.value;
                    self.put(master, value, true);
                    self.clock = ClockBit::High { since: answers };
                }
            }
            ClockBit::High { since } if answers >= since + SEEN => {
                let value = self.waiting.pop_front().map_or(0, |preset| preset.value);
                self.put(master, value, false);
                self.clock = ClockBit::Low { since: answers };
            }
            ClockBit::Low { .. } | ClockBit::High { .. } => {}
        }
    }

    /// Gives the slave a preset, its top bit set or not.
    fn put(&self, master: &mut Master, value: u32, clock: bool) {
        let wide = value | u32::from(clock) << 31;
        let narrow = value as u16 | u16::from(clock) << 15;
        // Presets are given only to configurations that carry them.
        let _ = match self.outputs {
            4 => master.set_outputs(self.address, &wide.to_be_bytes()),
            2 => master.set_outputs(self.address, &narrow.to_be_bytes()),
            _ => Ok(()),
        };
    }
}
