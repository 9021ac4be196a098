//! Steps per second over the last 100 ms.

mod common;

use codewheel_encoder::{Direction, Encoder, Geometry, Model, Settings};
use codewheel_station::{Duration, Instant};
use common::{MULTITURN, at_millis, code, encoder_with};

/// Samples a shaft at `rpm` every `step` from `from` to `to`, code 0 at time 0.
fn turn(encoder: &mut Encoder, rpm: i64, from: Instant, to: Instant, step: Duration) {
    let mut now = from;
    while now <= to {
        let raw = i128::from(rpm) * 8_192 * i128::from(now.as_nanos()) / 60_000_000_000;
        let raw = raw.rem_euclid(i128::from(Geometry::MULTITURN_29.range()));
        encoder.sample(now, code(raw as u32));
        now += step;
    }
}

fn encoder() -> Encoder {
    encoder_with(MULTITURN, Settings::default_for(MULTITURN))
}

#[test]
fn a_constant_speed_gives_its_steps_per_second_both_ways_and_at_any_sampling() {
    for (micros, rpm) in
        [100, 1_000, 3_000, 14_999, 15_000, 15_001, 40_000, 99_000, 250_000, 1_000_000]
            .into_iter()
            .flat_map(|micros| [-6_000, -60, -1, 1, 60, 6_000].map(|rpm| (micros, rpm)))
    {
        for direction in [Direction::Cw, Direction::Ccw] {
            let settings = Settings::default_for(MULTITURN).with_direction(direction);
            let mut encoder = encoder_with(MULTITURN, settings);
            let step = Duration::from_micros(micros);
            let end = Instant::ZERO + step.times(2_000_000 / micros);
            turn(&mut encoder, rpm, Instant::ZERO, end, step);
            let expected = rpm * 8_192 / 60 * if direction == Direction::Cw { 1 } else { -1 };
            let velocity = encoder.velocity(end);
            // A step of the disc is ten steps per second; interpolation may add another.
            assert!(
                (velocity - expected).abs() <= 30,
                "{velocity}, not {expected}, sampled every {micros} µs"
            );
        }
    }
}

#[test]
fn samples_in_close_pairs_reach_back_over_the_whole_window() {
    let mut encoder = encoder();
    for pair in 0..50 {
        for milli in [16 * pair, 16 * pair + 1] {
            encoder.sample(at_millis(milli), code(82 * milli as u32));
        }
    }
    let velocity = encoder.velocity(at_millis(16 * 49 + 1));
    assert!((velocity - 82_000).abs() <= 30, "{velocity}");
}

#[test]
fn sixty_turns_a_minute_are_eight_thousand_one_hundred_and_ninety_steps() {
    let mut encoder = encoder();
    turn(&mut encoder, 60, at_millis(0), at_millis(500), Duration::from_millis(1));
    let velocity = encoder.velocity(at_millis(500));
    assert!(velocity == 8_190 || velocity == 8_200, "{velocity}, not 819.2 steps in 100 ms");
}

#[test]
fn a_shaft_no_longer_sampled_comes_to_rest_within_100_ms() {
    let mut encoder = encoder();
    turn(&mut encoder, 600, at_millis(0), at_millis(500), Duration::from_millis(1));
    let half = encoder.velocity(at_millis(550));
    assert!((40_900..=41_000).contains(&half), "{half}");
    assert_eq!(encoder.velocity(at_millis(600)), 0);
    assert_eq!(encoder.velocity(at_millis(60_000)), 0);
}

#[test]
fn a_pause_without_samples_is_not_smeared_into_the_next_movement() {
    let mut encoder = encoder();
    turn(&mut encoder, 6_000, at_millis(0), at_millis(14), Duration::from_millis(1));
    let rested = encoder.code();
    for milli in 10_000..10_100 {
        encoder.sample(at_millis(milli), code(rested));
        assert_eq!(encoder.velocity(at_millis(milli)), 0, "at {milli} ms");
    }
    encoder.sample(at_millis(20_000), code(rested + 9_900));
    let even = encoder.velocity(at_millis(20_000));
    assert!((990..=1_010).contains(&even), "{even}, not an even way over the 9.9 s unseen");
}

#[test]
fn close_samples_make_no_velocity_out_of_one_step() {
    let mut encoder = encoder();
    encoder.sample(Instant::from_nanos(1_000), code(0));
    encoder.sample(Instant::from_nanos(1_001), code(1));
    assert_eq!(encoder.velocity(Instant::from_nanos(1_001)), 10);
}

#[test]
fn a_change_of_settings_starts_the_velocity_anew() {
    let mut encoder = encoder();
    turn(&mut encoder, 600, at_millis(0), at_millis(500), Duration::from_millis(1));
    encoder.set_steps_per_turn(100).unwrap();
    assert_eq!(encoder.velocity(at_millis(500)), 0);
    turn(&mut encoder, 600, at_millis(501), at_millis(700), Duration::from_millis(1));
    assert!((990..=1_010).contains(&encoder.velocity(at_millis(700))));
    encoder.load(encoder.default_block()).unwrap();
    assert_eq!(encoder.velocity(at_millis(700)), 0);
}

#[test]
fn a_preset_is_no_movement() {
    let mut encoder = encoder();
    turn(&mut encoder, 60, at_millis(0), at_millis(500), Duration::from_millis(1));
    let before = encoder.velocity(at_millis(500));
    encoder.set_preset(123_456).unwrap();
    assert_eq!(encoder.velocity(at_millis(500)), before);
}

/// There k₀ moves with the preset, and the unwrapped position with it.
#[test]
fn a_preset_on_a_singleturn_disc_with_an_uneven_range_is_no_movement_either() {
    let model = Model { geometry: Geometry::SINGLETURN_13, ..MULTITURN };
    let settings =
        Settings { steps_per_turn: 100, total_resolution: 30, ..Settings::default_for(model) };
    let mut encoder = encoder_with(model, settings);
    turn(&mut encoder, 600, at_millis(0), at_millis(500), Duration::from_millis(1));
    encoder.set_preset(7).unwrap();
    assert_eq!(encoder.velocity(at_millis(500)), 0);
    turn(&mut encoder, 600, at_millis(501), at_millis(700), Duration::from_millis(1));
    assert!((990..=1_010).contains(&encoder.velocity(at_millis(700))));
}

#[test]
fn the_range_ends_without_a_trace_in_the_velocity() {
    let settings = Settings { total_resolution: 1_000, ..Settings::default_for(MULTITURN) };
    let mut encoder = encoder_with(MULTITURN, settings);
    turn(&mut encoder, -600, at_millis(0), at_millis(500), Duration::from_millis(1));
    assert!((-81_940..=-81_900).contains(&encoder.velocity(at_millis(500))));
}
