//! From the raw code to the position, precomputed so that a poll costs a multiplication, a shift
//! and one 32-bit remainder.
//!
//! With k the crossings since the settings changed:
//! CW `u = ⌊r·n/S⌋ + k·n·M`, CCW `u = −⌈r·n/S⌉ − k·n·M`, position `= (u + offset) mod T`.
//! Everything but r changes only with a crossing, a preset or the settings, and is folded into two
//! numbers then. The directions round opposite ways so that turning back retraces every edge.

use core::num::NonZeroU32;

use crate::{Direction, Model, Settings};

/// The transform of one [`Settings`], for the turns the shaft is in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transform {
    /// k·n·M with the sign of the direction: the unwrapped position of code 0.
    origin: i64,
    /// n.
    steps_per_turn: u32,
    /// n·M, at most 2²⁹.
    range: u32,
    /// T, at most 2²⁹.
    total: NonZeroU32,
    /// The position of code 0, mod T. CCW: plus n·M or more, so that subtracting the scaled code
    /// stays above zero. Below 2³⁰.
    base: u32,
    /// What makes the shift round: 0 down, S−1 up.
    rounding: u32,
    /// log₂ S.
    shift: u8,
    direction: Direction,
}

impl Transform {
    /// The transform of `settings`, which have been checked against `model`.
    pub(crate) fn new(model: Model, settings: &Settings, crossings: i64, offset: i32) -> Self {
        let singleturn_resolution = model.geometry.singleturn_resolution();
        let steps_per_turn = settings.steps_in_force(model);
        let mut transform = Self {
            origin: 0,
            steps_per_turn,
            range: steps_per_turn.wrapping_mul(model.geometry.revolutions()),
            total: NonZeroU32::new(settings.total_in_force(model)).unwrap_or(NonZeroU32::MIN),
            base: 0,
            rounding: match settings.direction {
                Direction::Cw => 0,
                Direction::Ccw => singleturn_resolution - 1,
            },
            shift: singleturn_resolution.trailing_zeros() as u8,
            direction: settings.direction,
        };
        transform.rebase(crossings, offset);
        transform
    }

    /// Takes in `crossings` (k−k₀) and `offset`. Call it whenever one of them changes.
    pub(crate) fn rebase(&mut self, crossings: i64, offset: i32) {
        let range = i64::from(self.range);
        // A record may hold any k; arithmetic that wraps is wrong there, but never fails.
        let turned = crossings.wrapping_mul(range);
        let (origin, lift) = match self.direction {
            Direction::Cw => (turned, 0),
            Direction::Ccw => (turned.wrapping_neg(), range),
        };
        self.origin = origin;
        let start = origin.wrapping_add(i64::from(offset)).wrapping_sub(lift);
        self.base = (self.modulo_total(start) + lift) as u32;
    }

    /// The unwrapped position u of `code`, without the offset.
    pub(crate) fn unwrapped(&self, code: u32) -> i64 {
        let scaled = i64::from(self.scaled(code));
        match self.direction {
            Direction::Cw => self.origin.wrapping_add(scaled),
            Direction::Ccw => self.origin.wrapping_sub(scaled),
        }
    }

    /// The position of `code`, 0 … T−1.
    pub(crate) fn position(&self, code: u32) -> u32 {
        let scaled = self.scaled(code);
        let sum = match self.direction {
            Direction::Cw => self.base.wrapping_add(scaled),
            Direction::Ccw => self.base.wrapping_sub(scaled),
        };
        sum % self.total
    }

    /// `unwrapped mod T`, 0 … T−1.
    pub(crate) fn modulo_total(&self, unwrapped: i64) -> i64 {
        unwrapped.rem_euclid(i64::from(self.total.get()))
    }

    /// ⌊r·n/S⌋ or ⌈r·n/S⌉, 0 … n·M.
    fn scaled(&self, code: u32) -> u32 {
        let product = u64::from(code) * u64::from(self.steps_per_turn) + u64::from(self.rounding);
        (product >> self.shift) as u32
    }
}
