//! Controllers that leave the bus and come back (ISO 11898-1, 12.1.4.4).

use codewheel_station::Instant;
use codewheel_station::can::Input;

use super::{Node, Phase, Wire};
use crate::can::Event;
use crate::can::errors::TransmitErrors;
use crate::schedule::NEVER;

/// How often a controller has to see eleven recessive bits before it takes part again.
const SEQUENCES: u64 = 128;
/// Eleven recessive bits.
const SEQUENCE_BITS: u64 = 11;

/// A station whose controller has left the bus.
pub(super) struct Off {
    pub(super) slot: usize,
    /// How many sequences of eleven recessive bits are still missing.
    missing: u64,
    /// Since when the idle wire is being counted; means nothing while it is not idle.
    idle_since: u64,
}

impl<N: Node> Wire<N> {
    pub(super) fn is_off(&self, slot: usize) -> bool {
        self.off.iter().any(|off| off.slot == slot)
    }

    /// The controller in `slot` leaves the bus now.
    pub(super) fn leave(&mut self, slot: usize, observer: &mut impl FnMut(&Event)) {
        if self.is_off(slot) {
            return;
        }
        let Some(node) = self.slots[slot].node.as_mut() else { return };
        node.mailbox = None;
        self.waiting.retain(|waiting| waiting.slot != slot);
        self.taking_part -= 1;
        self.off.push(Off { slot, missing: SEQUENCES, idle_since: self.now });
        self.counted.bus_offs += 1;
        observer(&Event::BusOff { at: Instant::from_nanos(self.now), station: self.id(slot) });
        self.handle(slot, Input::BusOff);
    }

    /// When the next controller comes back, if the wire stays idle.
    pub(super) fn next_recovery(&self) -> u64 {
        if !matches!(self.phase, Phase::Idle) {
            return NEVER;
        }
        let sequence = SEQUENCE_BITS * self.bit_nanos;
        let back = |off: &Off| off.idle_since.saturating_add(off.missing * sequence);
        self.off.iter().map(back).min().unwrap_or(NEVER)
    }

    /// Lets those take part again that have waited long enough.
    pub(super) fn recover(&mut self, observer: &mut impl FnMut(&Event)) {
        while self.next_recovery() <= self.now {
            let sequence = SEQUENCE_BITS * self.bit_nanos;
            let is_back = |off: &Off| off.idle_since + off.missing * sequence <= self.now;
            let Some(place) = self.off.iter().position(is_back) else { return };
            let slot = self.off.remove(place).slot;
            self.taking_part += 1;
            if let Some(node) = self.slots[slot].node.as_mut() {
                node.errors = TransmitErrors::default();
            }
            let (at, station) = (Instant::from_nanos(self.now), self.id(slot));
            observer(&Event::Recovered { at, station });
            self.handle(slot, Input::Recovered);
        }
    }

    /// The wire has become idle. What went before ended in eleven recessive bits, delimiter, end of
    /// frame and intermission together.
    pub(super) fn begin_idle(&mut self) {
        for off in &mut self.off {
            off.missing = off.missing.saturating_sub(1);
            off.idle_since = self.now;
        }
    }

    /// A frame begins on the idle wire.
    pub(super) fn end_idle(&mut self) {
        let sequence = SEQUENCE_BITS * self.bit_nanos;
        for off in &mut self.off {
            let seen = (self.now - off.idle_since) / sequence;
            off.missing = off.missing.saturating_sub(seen);
        }
    }
}
