//! The exhaustive run: every code of the largest disc under the settings that matter.

mod common;

use codewheel_encoder::{Direction, Settings};
use common::{MULTITURN, Oracle, at_millis, code, encoder_with};

/// Every 1021st code (a prime, so that all remainders of every power of two occur), and all 2²⁹
/// with
/// `CODEWHEEL_EXHAUSTIVE=1 cargo test --release -p codewheel-encoder exhaustive`.
#[test]
fn exhaustive_every_code_of_29_bits_agrees_with_the_true_angle() {
    let stride = if std::env::var_os("CODEWHEEL_EXHAUSTIVE").is_some_and(|value| value == "1") {
        1
    } else {
        1_021
    };
    let defaults = Settings::default_for(MULTITURN);
    let manual = Settings { steps_per_turn: 3_600, total_resolution: 921_600, ..defaults };
    let uneven = Settings { total_resolution: 3_600 * 1_000 - 7, ..manual };
    for settings in [
        defaults,
        manual,
        uneven,
        defaults.with_direction(Direction::Ccw),
        uneven.with_direction(Direction::Ccw),
    ] {
        let mut encoder = encoder_with(MULTITURN, settings);
        let mut oracle = Oracle::new(MULTITURN, settings, 0);
        let mut last = None;
        // Once round, and over the raw zero into the next round.
        for angle in (0..(1_i128 << 29) + 3 * stride).step_by(stride as usize) {
            oracle.angle = angle;
            encoder.sample(at_millis(0), code(oracle.code()));
            let position = encoder.position();
            assert_eq!(position, oracle.position(), "{settings:?} at {angle}");
            let unwrapped = encoder.unwrapped();
            if stride == 1 {
                let moved = last.map_or(0, |last: i64| (unwrapped - last).abs());
                assert!(moved <= 1, "{settings:?} jumped at {angle}");
            }
            last = Some(unwrapped);
        }
    }
}
