//! Why a write is refused.

use core::fmt;

/// Why a write is refused. A refused write has changed nothing.
///
/// Each variant carries what is allowed, so that every bus and every screen can say it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// The steps per turn are not 1 … `max` = S (DeviceNet manual §8, attr 7).
    StepsPerTurn {
        /// The singleturn resolution of the product.
        max: u32,
    },
    /// The total resolution is not 1 … `max` = n·M (DeviceNet manual §8, attr 8). Decision: beyond
    /// n·M the position would not be absolute after a power-off.
    TotalResolution {
        /// Steps per turn times the turns the product can tell apart.
        max: u32,
    },
    /// This product has no total resolution of its own: it is always the steps per turn
    /// (DeviceNet manual §4, footnote).
    TotalFollowsSteps {
        /// The steps per turn, the only total allowed.
        steps_per_turn: u32,
    },
    /// The preset is not 0 … `max` = T−1 (DeviceNet manual §8, attr 10; PROFIBUS manual §7.4).
    Preset {
        /// The total resolution less one.
        max: u32,
    },
    /// The offset of a block is not −`max` … `max` with `max` = T−1, so no preset made it.
    Offset {
        /// The total resolution less one.
        max: u32,
    },
    /// The COS delta is not 1 … `max` = T (DeviceNet manual §8, attr 11).
    CosDelta {
        /// The total resolution.
        max: u32,
    },
    /// The shaft has not been sampled since power-up, so there is no position to preset.
    NoSample,
}

impl fmt::Display for Refusal {
    /// What is allowed, as a sentence without a full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StepsPerTurn { max } => write!(f, "the steps per turn are 1 to {max}"),
            Self::TotalResolution { max } => write!(
                f,
                "the total resolution is 1 to {max}; with these steps per turn lower the total \
                 as well: at most n × M = {max}"
            ),
            Self::TotalFollowsSteps { steps_per_turn } => write!(
                f,
                "the total resolution of a singleturn encoder is its steps per turn, here \
                 {steps_per_turn}; write the steps per turn and the total follows"
            ),
            Self::Preset { max } => write!(f, "the preset is 0 to {max}"),
            Self::Offset { max } => write!(f, "the offset is -{max} to {max}"),
            Self::CosDelta { max } => write!(f, "the COS delta is 1 to {max}"),
            Self::NoSample => {
                f.write_str("the shaft has not been sampled yet; there is no position to preset")
            }
        }
    }
}

impl core::error::Error for Refusal {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn a_refusal_says_what_is_allowed() {
        let too_big = Refusal::TotalResolution { max: 235_929_600 }.to_string();
        assert!(too_big.contains("lower the total as well: at most n × M = 235929600"));
        assert_eq!(Refusal::Preset { max: 921_599 }.to_string(), "the preset is 0 to 921599");
        assert_eq!(Refusal::CosDelta { max: 8_192 }.to_string(), "the COS delta is 1 to 8192");
    }
}
