//! One settings block: what "in force" and "saved" each hold.

use crate::{Model, Refusal, Settings};

/// One settings block. A device has two: the one *in force*, and the *saved* one that power-up and
/// Restore bring back (DeviceNet manual §8, general services).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Block {
    /// Direction, resolution, range and scaling.
    pub settings: Settings,
    /// The preset last written, 0 … T−1; 0 after a real change of the settings (DeviceNet manual
    /// §8, attr 10).
    pub preset: u32,
    /// What the preset function adds to the scaled position, −(T−1) … T−1 steps (DeviceNet manual
    /// §8, attr 91; PROFIBUS manual §7.2, octets 32 to 35).
    pub offset: i32,
    /// k₀: how often the raw code had passed its zero when the settings last really changed.
    ///
    /// 64 bits, because 32 would wrap after 124 days on a singleturn disc at 12 000 rpm, and the
    /// position would jump where T does not divide n·M.
    pub crossings_at_change: i64,
    /// The COS delta, 1 … T steps (DeviceNet manual §8, attr 11).
    pub cos_delta: u32,
}

impl Block {
    /// The block of a new device: default settings, preset 0, offset 0, COS delta 1 (decision: the
    /// manual names no default for the COS delta).
    #[must_use]
    pub const fn default_for(model: Model) -> Self {
        Self {
            settings: Settings::default_for(model),
            preset: 0,
            offset: 0,
            crossings_at_change: 0,
            cos_delta: 1,
        }
    }

    /// Whether the product can measure with this block.
    ///
    /// # Errors
    /// What [`Settings::check`] refuses; then [`Refusal::Preset`], [`Refusal::Offset`] and
    /// [`Refusal::CosDelta`] by the range in force.
    pub const fn check(&self, model: Model) -> Result<(), Refusal> {
        if let Err(refusal) = self.settings.check(model) {
            return Err(refusal);
        }
        let total = self.settings.total_in_force(model);
        let max = total - 1;
        if self.preset > max {
            return Err(Refusal::Preset { max });
        }
        if self.offset.unsigned_abs() > max {
            return Err(Refusal::Offset { max });
        }
        if self.cos_delta < 1 || self.cos_delta > total {
            return Err(Refusal::CosDelta { max: total });
        }
        Ok(())
    }

    /// Whether a [`Reference`] must be kept for this block, so that the position survives a
    /// power-off: turns are counted and T does not divide n·M.
    ///
    /// Ask it of the *saved* block, the one the next power-up brings back.
    #[must_use]
    pub const fn needs_reference(&self, model: Model) -> bool {
        model.geometry.is_multiturn() && !self.settings.total_divides_range(model)
    }
}

/// Where the shaft stood when it was last noted for the next power-up.
///
/// Decision: the manuals only warn that "parameterizing will have to be done anew" once the zero
/// point has been passed without power. A reference no more than a quarter of the range away lets
/// the encoder tell such a passage from up to another quarter of the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Reference {
    /// k: how often the raw code had passed its own zero, clockwise positive.
    pub crossings: i64,
    /// r: the raw code, 0 … N−1.
    pub code: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    const MULTITURN: Model =
        Model { geometry: Geometry::MULTITURN_29, lithium_cell: false, total_follows_steps: false };

    #[test]
    fn a_reference_is_needed_only_where_the_turns_are_counted_and_do_not_come_out_even() {
        let mut block = Block::default_for(MULTITURN);
        assert!(!block.needs_reference(MULTITURN));
        block.settings.steps_per_turn = 3_600;
        block.settings.total_resolution = 3_600 * 256;
        assert!(!block.needs_reference(MULTITURN), "256 turns are a power of two");
        block.settings.total_resolution = 3_600 * 100;
        assert!(block.needs_reference(MULTITURN));
        block.settings.scaling = false;
        assert!(!block.needs_reference(MULTITURN));
        let singleturn = Model { geometry: Geometry::SINGLETURN_13, ..MULTITURN };
        block.settings =
            Settings { steps_per_turn: 10, total_resolution: 7, scaling: true, ..block.settings };
        assert!(!block.needs_reference(singleturn));
    }

    #[test]
    fn a_block_is_judged_by_the_range_in_force() {
        let good = Block {
            settings: Settings { total_resolution: 1_000, ..Settings::default_for(MULTITURN) },
            preset: 999,
            offset: -999,
            cos_delta: 1_000,
            ..Block::default_for(MULTITURN)
        };
        assert_eq!(good.check(MULTITURN), Ok(()));
        let refused = |block: Block| block.check(MULTITURN).unwrap_err();
        assert_eq!(refused(Block { preset: 1_000, ..good }), Refusal::Preset { max: 999 });
        assert_eq!(refused(Block { offset: 1_000, ..good }), Refusal::Offset { max: 999 });
        assert_eq!(refused(Block { offset: i32::MIN, ..good }), Refusal::Offset { max: 999 });
        assert_eq!(refused(Block { cos_delta: 0, ..good }), Refusal::CosDelta { max: 1_000 });
        assert_eq!(refused(Block { cos_delta: 1_001, ..good }), Refusal::CosDelta { max: 1_000 });
    }
}
