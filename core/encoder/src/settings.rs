//! What turns a shaft angle into a position: direction, resolution and range.

use crate::{Model, Refusal};

/// The sense of rotation that makes the position grow, seen looking at the flange (DeviceNet
/// manual §8, attr 3; PROFIBUS manual §4: of an SSI converter, growing or falling SSI values).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Clockwise, the default; 0 on both buses.
    #[default]
    Cw,
    /// Counterclockwise; 1 on both buses.
    Ccw,
}

/// The settings an offset belongs to: direction, steps per turn, total resolution, scaling.
///
/// A plain value: the writes are functions from settings to settings, and
/// [`Encoder::apply`](crate::Encoder::apply) takes the result whole or not at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Settings {
    /// The sense of rotation that makes the position grow.
    pub direction: Direction,
    /// n, the steps in one turn, 1 … S (DeviceNet manual §8, attr 7).
    pub steps_per_turn: u32,
    /// T, the steps in the measuring range, 1 … n·M (DeviceNet manual §8, attr 8).
    pub total_resolution: u32,
    /// Whether n and T are used; without scaling n = S and T = N (PROFIBUS manual §6.1, octet 9
    /// bit 3; always on with DeviceNet, attr 5).
    pub scaling: bool,
}

impl Settings {
    /// The settings of a new device: CW, n = S, T = N, scaling on (both manuals, §4).
    #[must_use]
    pub const fn default_for(model: Model) -> Self {
        let steps_per_turn = model.geometry.singleturn_resolution();
        let total_resolution =
            if model.total_follows_steps { steps_per_turn } else { model.geometry.range() };
        Self { direction: Direction::Cw, steps_per_turn, total_resolution, scaling: true }
    }

    /// The settings without scaling, with n = S and T = N also where they are read back.
    ///
    /// For a parameterization that turns scaling or class 2 off: it does not look at the
    /// resolution the master sent (PROFIBUS manual §6.1).
    #[must_use]
    pub const fn unscaled(model: Model, direction: Direction) -> Self {
        Self { direction, scaling: false, ..Self::default_for(model) }
    }

    /// Whether the product can measure with these settings.
    ///
    /// n and T are judged without scaling too: they are read back.
    ///
    /// # Errors
    /// [`Refusal::StepsPerTurn`], [`Refusal::TotalFollowsSteps`] or [`Refusal::TotalResolution`],
    /// in this order.
    pub const fn check(&self, model: Model) -> Result<(), Refusal> {
        let max = model.geometry.singleturn_resolution();
        if self.steps_per_turn < 1 || self.steps_per_turn > max {
            return Err(Refusal::StepsPerTurn { max });
        }
        if model.total_follows_steps && self.total_resolution != self.steps_per_turn {
            return Err(Refusal::TotalFollowsSteps { steps_per_turn: self.steps_per_turn });
        }
        let max = self.steps_per_turn * model.geometry.revolutions();
        if self.total_resolution < 1 || self.total_resolution > max {
            return Err(Refusal::TotalResolution { max });
        }
        Ok(())
    }

    /// The steps per turn the transform works with: n, or S without scaling.
    #[must_use]
    pub const fn steps_in_force(&self, model: Model) -> u32 {
        if self.scaling { self.steps_per_turn } else { model.geometry.singleturn_resolution() }
    }

    /// The measuring range the transform works with, in steps: T, or N without scaling. It bounds
    /// position, preset, offset and COS delta.
    #[must_use]
    pub const fn total_in_force(&self, model: Model) -> u32 {
        if self.scaling { self.total_resolution } else { model.geometry.range() }
    }

    /// Whether the measuring range fits a whole number of times into the n·M steps the device can
    /// tell apart, so that the raw code alone gives the position.
    ///
    /// Otherwise ("number of turns not 2ⁿ", DeviceNet manual §8) the position also depends on how
    /// often the raw code has passed its zero. For settings that pass [`check`](Self::check).
    #[must_use]
    pub const fn total_divides_range(&self, model: Model) -> bool {
        let range = self.steps_in_force(model) as u64 * model.geometry.revolutions() as u64;
        match range.checked_rem(self.total_in_force(model) as u64) {
            Some(rest) => rest == 0,
            None => false,
        }
    }

    /// These settings with other steps per turn (DeviceNet manual §8, "Steps per turn").
    ///
    /// The total resolution follows: on a singleturn product it becomes n; otherwise the turns as
    /// programmed, `max(1, T / n)`, stay, and T becomes n times these. Writing the value in force
    /// changes nothing, so a total that is no multiple of n survives it.
    ///
    /// # Errors
    /// [`Refusal::StepsPerTurn`] outside 1 … S.
    pub fn with_steps_per_turn(self, model: Model, steps_per_turn: u32) -> Result<Self, Refusal> {
        if steps_per_turn == self.steps_per_turn {
            return Ok(self);
        }
        let turns = if model.total_follows_steps {
            1
        } else {
            self.total_resolution.checked_div(self.steps_per_turn).unwrap_or(1).max(1)
        };
        let total_resolution = steps_per_turn.saturating_mul(turns);
        let settings = Self { steps_per_turn, total_resolution, ..self };
        settings.check(model)?;
        Ok(settings)
    }

    /// These settings with another total resolution (DeviceNet manual §8, "Total resolution in
    /// steps").
    ///
    /// # Errors
    /// [`Refusal::TotalResolution`] outside 1 … n·M; [`Refusal::TotalFollowsSteps`] for a value
    /// other than n on a product whose total follows.
    pub fn with_total_resolution(self, model: Model, total: u32) -> Result<Self, Refusal> {
        let settings = Self { total_resolution: total, ..self };
        settings.check(model)?;
        Ok(settings)
    }

    /// These settings with another direction (DeviceNet manual §8, "Sense of rotation").
    #[must_use]
    pub const fn with_direction(self, direction: Direction) -> Self {
        Self { direction, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Geometry;

    const MULTITURN: Model =
        Model { geometry: Geometry::MULTITURN_29, lithium_cell: false, total_follows_steps: false };
    const SINGLETURN: Model =
        Model { geometry: Geometry::SINGLETURN_13, lithium_cell: false, total_follows_steps: true };

    #[test]
    fn the_turns_as_programmed_survive_new_steps_per_turn() {
        let settings = Settings::default_for(MULTITURN).with_steps_per_turn(MULTITURN, 3_600);
        let settings = settings.unwrap();
        assert_eq!(settings.total_resolution, 3_600 * 65_536);
        let settings = settings.with_total_resolution(MULTITURN, 3_600 * 256 + 7).unwrap();
        let settings = settings.with_steps_per_turn(MULTITURN, 100).unwrap();
        assert_eq!(settings.total_resolution, 100 * 256);
        let settings = settings.with_total_resolution(MULTITURN, 30).unwrap();
        let settings = settings.with_steps_per_turn(MULTITURN, 50).unwrap();
        assert_eq!(settings.total_resolution, 50, "less than a turn counts as one");
    }

    #[test]
    fn writing_the_steps_per_turn_in_force_keeps_an_odd_total() {
        let odd = Settings { total_resolution: 921_601, ..Settings::default_for(MULTITURN) };
        assert_eq!(odd.with_steps_per_turn(MULTITURN, 8_192), Ok(odd));
    }

    #[test]
    fn the_total_of_a_devicenet_singleturn_is_its_steps_per_turn() {
        let settings = Settings::default_for(SINGLETURN).with_steps_per_turn(SINGLETURN, 360);
        let settings = settings.unwrap();
        assert_eq!(settings.total_resolution, 360);
        assert_eq!(settings.with_total_resolution(SINGLETURN, 360), Ok(settings));
        assert_eq!(
            settings.with_total_resolution(SINGLETURN, 359),
            Err(Refusal::TotalFollowsSteps { steps_per_turn: 360 })
        );
    }

    #[test]
    fn steps_and_total_have_their_edges_where_the_manual_puts_them() {
        let defaults = Settings::default_for(MULTITURN);
        let steps = |n| defaults.with_steps_per_turn(MULTITURN, n);
        let total = |t| defaults.with_total_resolution(MULTITURN, t);
        assert_eq!(steps(0), Err(Refusal::StepsPerTurn { max: 8_192 }));
        assert_eq!(steps(8_193), Err(Refusal::StepsPerTurn { max: 8_192 }));
        assert_eq!(steps(u32::MAX), Err(Refusal::StepsPerTurn { max: 8_192 }));
        assert!(steps(1).is_ok());
        assert_eq!(total(0), Err(Refusal::TotalResolution { max: 0x2000_0000 }));
        assert_eq!(total(0x2000_0001), Err(Refusal::TotalResolution { max: 0x2000_0000 }));
        assert!(total(1).is_ok());
    }

    #[test]
    fn without_scaling_the_disc_itself_is_in_force() {
        let settings = Settings {
            steps_per_turn: 100,
            total_resolution: 700,
            ..Settings::unscaled(MULTITURN, Direction::Ccw)
        };
        assert_eq!(settings.steps_in_force(MULTITURN), 8_192);
        assert_eq!(settings.total_in_force(MULTITURN), 0x2000_0000);
        assert!(settings.total_divides_range(MULTITURN));
        assert!(!Settings { scaling: true, ..settings }.total_divides_range(MULTITURN));
    }
}
