//! What a product can tell apart: steps in a turn, and turns.

/// The geometry of a code disc and the turn counter behind it.
///
/// Only the geometries of the manuals can be built. They keep two promises the arithmetic lives
/// on: both numbers are powers of two, and their product fits 29 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Geometry {
    singleturn_resolution: u32,
    revolutions: u32,
}

impl Geometry {
    /// 13 bit singleturn: 8192 steps in one turn (both manuals, §4).
    pub const SINGLETURN_13: Self = Self { singleturn_resolution: 8_192, revolutions: 1 };

    /// 18 bit singleturn: 262 144 steps in one turn (PROFIBUS manual §4; HEAG 162 SP 18 only).
    pub const SINGLETURN_18: Self = Self { singleturn_resolution: 262_144, revolutions: 1 };

    /// 29 bit multiturn: 8192 steps in each of 65 536 turns (both manuals, §4).
    pub const MULTITURN_29: Self = Self { singleturn_resolution: 8_192, revolutions: 65_536 };

    /// 25 bit multiturn: 8192 steps in each of 4096 turns.
    ///
    /// Decision: what a HEAG 162 SP 29 measures with while its SSI word has 25 bits, so that
    /// crossings, jumps and the limit of the total resolution fit the encoder at the line.
    pub const MULTITURN_25: Self = Self { singleturn_resolution: 8_192, revolutions: 4_096 };

    /// S, the steps of the code disc in one turn (DeviceNet manual §8, attr 81).
    #[must_use]
    pub const fn singleturn_resolution(self) -> u32 {
        self.singleturn_resolution
    }

    /// M, the turns the device can tell apart, 1 on a singleturn disc (DeviceNet manual §8,
    /// attr 82).
    #[must_use]
    pub const fn revolutions(self) -> u32 {
        self.revolutions
    }

    /// N = S·M, the number of raw codes, at most 2²⁹.
    #[must_use]
    pub const fn range(self) -> u32 {
        self.singleturn_resolution * self.revolutions
    }

    /// Whether the device counts turns.
    #[must_use]
    pub const fn is_multiturn(self) -> bool {
        self.revolutions > 1
    }
}

/// What the encoder must know of the product it plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Model {
    /// What the product can tell apart.
    pub geometry: Geometry,
    /// Whether a lithium cell feeds the turn counter, so that its voltage can be too low. Only
    /// AMG 81 multiturn has one (PROFIBUS manual §7.2, octets 20 to 23; DeviceNet by analogy).
    pub lithium_cell: bool,
    /// Whether the total resolution always equals the steps per turn: DeviceNet singleturn
    /// products (DeviceNet manual §4, footnote).
    pub total_follows_steps: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_geometry_keeps_the_promises_the_arithmetic_lives_on() {
        for (geometry, bits) in [
            (Geometry::SINGLETURN_13, 13),
            (Geometry::SINGLETURN_18, 18),
            (Geometry::MULTITURN_29, 29),
            (Geometry::MULTITURN_25, 25),
        ] {
            assert!(geometry.singleturn_resolution().is_power_of_two());
            assert!(geometry.revolutions().is_power_of_two());
            assert_eq!(geometry.range(), 1 << bits);
            assert_eq!(geometry.is_multiturn(), bits > 18);
        }
    }
}
