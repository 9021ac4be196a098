//! Writes: what takes effect, what a real change clears, what a refusal leaves alone.

mod common;

use codewheel_encoder::{Block, Direction, Encoder, Refusal, Settings};
use common::{
    MULTITURN, at_millis, cases, code, code_of, encoder_with, model_and_settings, products,
};
use proptest::prelude::*;

/// A write of any object, legal or not.
#[derive(Clone, Copy, Debug)]
enum Write {
    Direction(Direction),
    StepsPerTurn(u32),
    TotalResolution(u32),
    Preset(u32),
    CosDelta(i32),
    Apply(Settings),
    Load(Block),
}

impl Write {
    fn to(self, encoder: &mut Encoder) -> Result<bool, Refusal> {
        match self {
            Self::Direction(direction) => encoder.set_direction(direction),
            Self::StepsPerTurn(steps) => encoder.set_steps_per_turn(steps),
            Self::TotalResolution(total) => encoder.set_total_resolution(total),
            Self::Preset(preset) => encoder.set_preset(preset).map(|()| true),
            Self::CosDelta(delta) => encoder.set_cos_delta(delta),
            Self::Apply(settings) => encoder.apply(settings),
            Self::Load(block) => encoder.load(block).map(|()| true),
        }
    }
}

fn any_number() -> impl Strategy<Value = u32> {
    prop_oneof![0..10u32, 0..10_000u32, 0..0x2000_0010u32, any::<u32>()]
}

fn any_direction() -> impl Strategy<Value = Direction> {
    prop_oneof![Just(Direction::Cw), Just(Direction::Ccw)]
}

fn any_settings() -> impl Strategy<Value = Settings> {
    (any_direction(), any_number(), any_number(), any::<bool>()).prop_map(
        |(direction, steps_per_turn, total_resolution, scaling)| Settings {
            direction,
            steps_per_turn,
            total_resolution,
            scaling,
        },
    )
}

fn any_write() -> impl Strategy<Value = Write> {
    prop_oneof![
        any_direction().prop_map(Write::Direction),
        any_number().prop_map(Write::StepsPerTurn),
        any_number().prop_map(Write::TotalResolution),
        any_number().prop_map(Write::Preset),
        any::<i32>().prop_map(Write::CosDelta),
        any_number().prop_map(|delta| Write::CosDelta(delta as i32)),
        any_settings().prop_map(Write::Apply),
        (any_settings(), any_number(), any::<i32>(), any::<i64>(), any_number()).prop_map(
            |(settings, preset, offset, crossings_at_change, cos_delta)| Write::Load(Block {
                settings,
                preset,
                offset,
                crossings_at_change,
                cos_delta,
            })
        ),
    ]
}

proptest! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn whatever_is_written_a_refusal_changes_nothing_and_the_rest_leaves_a_legal_block(
        ((model, settings), start, writes) in model_and_settings().prop_flat_map(|both| {
            (Just(both), code_of(both.0), prop::collection::vec(any_write(), 1..40))
        }),
    ) {
        let mut encoder = encoder_with(model, settings);
        encoder.sample(at_millis(0), code(start));
        for write in writes {
            let before = (encoder.block(), encoder.position(), encoder.unwrapped());
            match write.to(&mut encoder) {
                Err(_) | Ok(false) => {
                    let after = (encoder.block(), encoder.position(), encoder.unwrapped());
                    prop_assert_eq!(after, before, "{:?}", write);
                }
                Ok(true) => prop_assert_eq!(encoder.block().check(model), Ok(()), "{:?}", write),
            }
            prop_assert!(encoder.position() < encoder.settings().total_in_force(model));
        }
    }

    #[test]
    fn a_preset_is_exact_and_reads_back_as_written(
        ((model, settings), start, others, preset) in model_and_settings().prop_flat_map(|both| {
            let total = both.1.total_in_force(both.0);
            let preset = prop_oneof![Just(0), Just(total - 1), 0..total];
            (Just(both), code_of(both.0), prop::collection::vec(code_of(both.0), 0..9), preset)
        }),
    ) {
        let mut encoder = encoder_with(model, settings);
        encoder.sample(at_millis(0), code(start));
        for (step, other) in (1..).zip(others) {
            encoder.sample(at_millis(10 * step), code(other));
        }
        prop_assert_eq!(encoder.set_preset(preset), Ok(()));
        prop_assert_eq!(encoder.position(), preset);
        prop_assert_eq!(encoder.preset(), preset);
        prop_assert!(encoder.offset().unsigned_abs() < settings.total_in_force(model));
        let total = i64::from(settings.total_in_force(model));
        let scaled = encoder.unwrapped().rem_euclid(total);
        prop_assert_eq!(i64::from(encoder.offset()), i64::from(preset) - scaled);
        prop_assert_eq!(
            encoder.set_preset(settings.total_in_force(model)),
            Err(Refusal::Preset { max: settings.total_in_force(model) - 1 })
        );
        prop_assert_eq!(encoder.position(), preset);
    }

    #[test]
    fn a_real_change_clears_offset_and_preset_and_starts_in_the_present_range(
        ((model, old), (_, new), start) in model_and_settings().prop_flat_map(|both| {
            let again = common::settings_of(both.0).prop_map(move |settings| (both.0, settings));
            (Just(both), again, code_of(both.0))
        }),
    ) {
        let mut encoder = encoder_with(model, old);
        encoder.sample(at_millis(0), code(start));
        encoder.set_preset(old.total_in_force(model) - 1).unwrap();
        encoder.set_cos_delta(old.total_in_force(model) as i32).unwrap();
        let before = encoder.block();
        let changed = encoder.apply(new);
        prop_assert_eq!(changed, Ok(new != old));
        if new == old {
            prop_assert_eq!(encoder.block(), before);
        } else {
            prop_assert_eq!((encoder.offset(), encoder.preset()), (0, 0));
            let total = new.total_in_force(model);
            prop_assert_eq!(encoder.cos_delta(), before.cos_delta.min(total));
            let range = i64::from(new.steps_in_force(model))
                * i64::from(model.geometry.revolutions());
            let unwrapped = encoder.unwrapped();
            let allowed = match new.direction {
                Direction::Cw => 0..=range - 1,
                Direction::Ccw => -range..=0,
            };
            prop_assert!(allowed.contains(&unwrapped), "{}", unwrapped);
        }
    }
}

#[test]
fn every_real_change_clears_the_offset_also_one_of_direction() {
    type Change = fn(&mut Encoder) -> Result<bool, Refusal>;
    let changes: [Change; 4] = [
        |encoder| encoder.set_direction(Direction::Ccw),
        |encoder| encoder.set_steps_per_turn(3_600),
        |encoder| encoder.set_total_resolution(1_000_000),
        |encoder| encoder.apply(Settings { scaling: false, ..encoder.settings() }),
    ];
    for change in changes {
        let mut encoder = encoder_with(MULTITURN, Settings::default_for(MULTITURN));
        encoder.sample(at_millis(0), code(77));
        encoder.set_preset(5_000).unwrap();
        assert_eq!(encoder.offset(), 5_000 - 77);
        assert_eq!(change(&mut encoder), Ok(true));
        assert_eq!((encoder.offset(), encoder.preset()), (0, 0));
    }
}

#[test]
fn writing_what_is_in_force_keeps_the_offset() {
    let mut encoder = encoder_with(MULTITURN, Settings::default_for(MULTITURN));
    encoder.sample(at_millis(0), code(77));
    encoder.set_preset(5_000).unwrap();
    assert_eq!(encoder.set_direction(Direction::Cw), Ok(false));
    assert_eq!(encoder.set_steps_per_turn(8_192), Ok(false));
    assert_eq!(encoder.set_total_resolution(0x2000_0000), Ok(false));
    assert_eq!(encoder.position(), 5_000);
}

#[test]
fn the_cos_delta_is_one_to_the_range_and_a_smaller_range_pulls_it_down() {
    let mut encoder = encoder_with(MULTITURN, Settings::default_for(MULTITURN));
    let refused = Err(Refusal::CosDelta { max: 0x2000_0000 });
    assert_eq!(encoder.set_cos_delta(0), refused);
    assert_eq!(encoder.set_cos_delta(-1), refused);
    assert_eq!(encoder.set_cos_delta(0x2000_0001), refused);
    assert_eq!(encoder.set_cos_delta(1), Ok(false));
    assert_eq!(encoder.set_cos_delta(0x2000_0000), Ok(true));
    encoder.set_total_resolution(1_000).unwrap();
    assert_eq!(encoder.cos_delta(), 1_000);
    encoder.set_total_resolution(2_000).unwrap();
    assert_eq!(encoder.cos_delta(), 1_000, "a larger range does not raise it again");
}

#[test]
fn a_preset_on_a_moving_shaft_is_accepted() {
    let mut encoder = encoder_with(MULTITURN, Settings::default_for(MULTITURN));
    for milli in 0..50 {
        encoder.sample(at_millis(milli), code(100 * milli as u32));
    }
    assert_eq!(encoder.set_preset(42), Ok(()));
    assert_eq!(encoder.position(), 42);
    encoder.sample(at_millis(50), code(5_000));
    assert_eq!(encoder.position(), 142);
}

#[test]
fn before_the_first_sample_there_is_no_position_to_preset() {
    for (name, model) in products() {
        let mut encoder = encoder_with(model, Settings::default_for(model));
        assert_eq!(encoder.set_preset(0), Err(Refusal::NoSample), "{name}");
        assert_eq!(encoder.block(), Block::default_for(model), "{name}");
    }
}

/// Reset gives offset 0, Restore the saved offset; neither executes a preset.
#[test]
fn restore_brings_the_saved_offset_back_and_executes_no_preset() {
    let uneven =
        Settings { steps_per_turn: 100, total_resolution: 999, ..Settings::default_for(MULTITURN) };
    let mut encoder = encoder_with(MULTITURN, uneven);
    encoder.sample(at_millis(0), code(8_192 * 3));
    encoder.set_preset(500).unwrap();
    let saved = encoder.block();

    encoder.load(encoder.default_block()).unwrap();
    assert_eq!((encoder.offset(), encoder.position()), (0, 8_192 * 3));
    // Back over the raw zero, under the defaults.
    encoder.sample(at_millis(10), code(0x2000_0000 - 8_192));
    encoder.load(saved).unwrap();
    assert_eq!(encoder.preset(), 500);
    assert_eq!(encoder.position(), 100, "four turns back from where the preset was made");
}

#[test]
fn a_record_of_another_product_is_refused_at_power_up() {
    let (_, singleturn) = products().swap_remove(0);
    let foreign = Block::default_for(MULTITURN);
    let refusal = Encoder::power_up(singleturn, foreign, None).map(|_| ()).unwrap_err();
    assert_eq!(refusal, Refusal::TotalFollowsSteps { steps_per_turn: 8_192 });
}
