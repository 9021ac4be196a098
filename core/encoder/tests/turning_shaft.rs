//! The shaft turns, the position follows: step by step, round the disc, over the raw zero.

mod common;

use codewheel_encoder::{Direction, Encoder};
use common::{Oracle, at_millis, code, code_of, encoder_with, model_and_settings};
use proptest::prelude::*;

/// By how much the position grew, the shorter way round.
fn grown(encoder: &Encoder, before: u32) -> i64 {
    let total = i64::from(encoder.settings().total_in_force(encoder.model()));
    let forward = (i64::from(encoder.position()) - i64::from(before)).rem_euclid(total);
    if forward * 2 > total { forward - total } else { forward }
}

proptest! {
    #![proptest_config(common::cases(3_000))]

    #[test]
    fn one_raw_step_moves_the_position_by_none_or_one_also_over_the_raw_zero(
        ((model, settings), start) in model_and_settings()
            .prop_flat_map(|(model, settings)| (Just((model, settings)), code_of(model))),
        clockwise in any::<bool>(),
    ) {
        let range = model.geometry.range();
        let total = settings.total_in_force(model);
        for start in [start, if clockwise { range - 2 } else { 1 }] {
            let mut encoder = encoder_with(model, settings);
            encoder.sample(at_millis(0), code(start));
            let mut raw = start;
            for step in 1..=4 {
                raw = if clockwise { raw + 1 } else { raw + range - 1 } % range;
                let (before, unwrapped) = (encoder.position(), encoder.unwrapped());
                encoder.sample(at_millis(step), code(raw));
                let grows = clockwise == (settings.direction == Direction::Cw);
                let moved = encoder.unwrapped() - unwrapped;
                let allowed = if grows { 0..=1 } else { -1..=0 };
                prop_assert!(allowed.contains(&moved), "{} steps", moved);
                if total > 2 {
                    prop_assert_eq!(grown(&encoder, before), moved);
                }
                prop_assert!(encoder.position() < total);
            }
        }
    }

    #[test]
    fn the_whole_range_round_moves_the_position_by_exactly_n_times_m(
        ((model, settings), start) in model_and_settings()
            .prop_flat_map(|(model, settings)| (Just((model, settings)), code_of(model))),
        rounds in 1..4i128,
        clockwise in any::<bool>(),
    ) {
        let mut encoder = encoder_with(model, settings);
        encoder.sample(at_millis(0), code(start));
        let (position, unwrapped) = (encoder.position(), encoder.unwrapped());
        let range = i128::from(model.geometry.range());
        let whole = i64::from(settings.steps_in_force(model))
            * i64::from(model.geometry.revolutions());
        let way = if clockwise { 1 } else { -1 };
        for third in 1..=3 * rounds {
            let raw = (i128::from(start) + way * third * range / 3).rem_euclid(range);
            encoder.sample(at_millis(10 * third as u64), code(raw as u32));
        }
        let grows = clockwise == (settings.direction == Direction::Cw);
        let whole = whole * rounds as i64 * if grows { 1 } else { -1 };
        prop_assert_eq!(encoder.unwrapped() - unwrapped, whole);
        let total = i64::from(settings.total_in_force(model));
        prop_assert_eq!(
            i64::from(encoder.position()),
            (i64::from(position) + whole).rem_euclid(total)
        );
    }

    #[test]
    fn samples_up_to_half_the_range_apart_agree_with_the_true_angle(
        ((model, settings), start, parts) in model_and_settings().prop_flat_map(|(model, settings)| {
            let half = i128::from(model.geometry.range() / 2);
            let moves = prop_oneof![3 => -half + 1..half, 2 => -20_000..20_000i128, 1 => -1..=1i128];
            let moves = moves.prop_map(move |way| way.clamp(1 - half, half - 1));
            (Just((model, settings)), code_of(model), prop::collection::vec(moves, 1..60))
        }),
    ) {
        let mut encoder = encoder_with(model, settings);
        let mut oracle = Oracle::new(model, settings, i128::from(start));
        encoder.sample(at_millis(0), code(start));
        for (step, way) in (1..).zip(parts) {
            oracle.angle += way;
            encoder.sample(at_millis(10 * step), code(oracle.code()));
            prop_assert_eq!(i128::from(encoder.unwrapped()), oracle.unwrapped());
            prop_assert_eq!(encoder.position(), oracle.position());
            prop_assert!(!encoder.alarm());
        }
    }
}
