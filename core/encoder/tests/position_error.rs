//! The alarm: a code that moved further than the shaft can turn, and the 2.5 s after it.

mod common;

use codewheel_encoder::{ALARM_TIME, Encoder, Geometry, Model, Settings};
use codewheel_station::{Duration, Instant};
use common::{MULTITURN, code, encoder_with};

const START: Instant = Instant::from_nanos(1_000_000_000);

/// Whether two samples so far apart, in time and in raw steps, are a position error.
fn alarm_after(encoder: &mut Encoder, elapsed: Duration, raw: u32) -> bool {
    let later = encoder.deadline().map_or(START, |until| until);
    encoder.advance(later);
    let later = later + Duration::from_secs(1);
    encoder.sample(later, code(0));
    encoder.sample(later + elapsed, code(raw));
    encoder.alarm()
}

fn encoder() -> Encoder {
    encoder_with(MULTITURN, Settings::default_for(MULTITURN))
}

#[test]
fn the_limit_is_twelve_thousand_turns_a_minute_and_strictly_more_is_an_error() {
    // 12 000 rpm · 8192 steps · 1 ms / 60 s = 1638.4 steps.
    let milli = Duration::from_millis(1);
    let range = Geometry::MULTITURN_29.range();
    let mut encoder = encoder();
    assert!(!alarm_after(&mut encoder, milli, 1_638));
    assert!(alarm_after(&mut encoder, milli, 1_639));
    assert!(!alarm_after(&mut encoder, milli, range - 1_638), "the shorter way round");
    assert!(alarm_after(&mut encoder, milli, range - 1_639));
    assert!(alarm_after(&mut encoder, milli, range / 2));
}

#[test]
fn the_limit_follows_the_steps_of_the_disc() {
    let model = Model { geometry: Geometry::SINGLETURN_18, ..MULTITURN };
    let mut encoder = encoder_with(model, Settings::default_for(model));
    // 12 000 rpm · 262 144 steps · 1 ms / 60 s = 52 428.8 steps.
    assert!(!alarm_after(&mut encoder, Duration::from_millis(1), 52_428));
    assert!(alarm_after(&mut encoder, Duration::from_millis(1), 52_429));
}

#[test]
fn eight_steps_are_allowed_however_close_two_samples_are() {
    let mut encoder = encoder();
    assert!(!alarm_after(&mut encoder, Duration::ZERO, 8));
    assert!(alarm_after(&mut encoder, Duration::ZERO, 9));
    assert!(!alarm_after(&mut encoder, Duration::from_micros(5), 8));
    assert!(alarm_after(&mut encoder, Duration::from_micros(5), 9), "8.192 steps");
    encoder.set_speed_limit(0);
    assert!(!alarm_after(&mut encoder, Duration::from_millis(1), 8));
    assert!(alarm_after(&mut encoder, Duration::from_millis(1), 9));
}

#[test]
fn the_speed_limit_can_be_set() {
    let mut encoder = encoder();
    encoder.set_speed_limit(6_000);
    assert!(!alarm_after(&mut encoder, Duration::from_millis(1), 819));
    assert!(alarm_after(&mut encoder, Duration::from_millis(1), 820));
    // 7500 rpm · 8192 steps · 1 ms / 60 s = 1024 steps, without a rest.
    encoder.set_speed_limit(7_500);
    assert!(!alarm_after(&mut encoder, Duration::from_millis(1), 1_024));
    assert!(alarm_after(&mut encoder, Duration::from_millis(1), 1_025));
    encoder.set_speed_limit(u32::MAX);
    assert!(!alarm_after(&mut encoder, Duration::from_millis(1), 1 << 28));
}

#[test]
fn samples_two_and_a_half_milliseconds_apart_are_not_judged() {
    let mut encoder = encoder();
    assert!(!alarm_after(&mut encoder, Duration::from_micros(2_500), 1 << 28));
    assert!(alarm_after(&mut encoder, Duration::from_nanos(2_499_999), 4_096));
}

#[test]
fn the_position_follows_the_newest_sample_also_through_an_error() {
    let mut encoder = encoder();
    assert!(alarm_after(&mut encoder, Duration::from_millis(1), 100_000));
    assert_eq!(encoder.position(), 100_000);
}

/// DeviceNet manual §8, "Alarm signals": reset automatically after 2.5 seconds.
#[test]
fn an_alarm_ends_by_itself_two_and_a_half_seconds_after_its_last_event() {
    let mut encoder = encoder();
    let step = Duration::from_millis(1);
    encoder.sample(START, code(0));
    encoder.sample(START + step, code(5_000));
    let end = START + step + Duration::from_millis(2_500);
    assert_eq!(encoder.deadline(), Some(end));
    encoder.advance(end - Duration::from_nanos(1));
    assert!(encoder.alarm());

    let again = START + Duration::from_secs(2);
    encoder.sample(again, code(5_000));
    encoder.sample(again + step, code(0));
    let end = again + step + ALARM_TIME;
    assert_eq!(encoder.deadline(), Some(end), "every event starts the time anew");
    encoder.advance(end - Duration::from_nanos(1));
    assert!(encoder.alarm());
    encoder.advance(end);
    assert!(!encoder.alarm());
    assert_eq!(encoder.deadline(), None);
}

#[test]
fn a_sample_after_the_end_clears_the_alarm_like_the_deadline_would() {
    let mut encoder = encoder();
    encoder.sample(START, code(0));
    encoder.sample(START, code(5_000));
    assert!(encoder.alarm());
    encoder.sample(START + ALARM_TIME, code(5_000));
    assert!(!encoder.alarm());
}

#[test]
fn the_first_sample_is_never_an_error() {
    let mut encoder = encoder();
    encoder.sample(Instant::ZERO, code(1 << 28));
    assert!(!encoder.alarm());
}

#[test]
fn a_shaft_just_below_the_limit_raises_no_alarm_over_the_raw_zero() {
    let mut encoder = encoder();
    let range = u64::from(Geometry::MULTITURN_29.range());
    for micro in (0..200_000).step_by(250) {
        let raw = (range - 50_000 + 11_900 * 8_192 * micro / 60_000_000) % range;
        encoder.sample(START + Duration::from_micros(micro), code(raw as u32));
        assert!(!encoder.alarm(), "at {micro} µs");
    }
}

#[test]
fn a_change_of_settings_neither_raises_nor_ends_an_alarm() {
    let mut encoder = encoder();
    encoder.sample(START, code(0));
    encoder.set_steps_per_turn(3_600).unwrap();
    encoder.sample(START + Duration::from_micros(100), code(1));
    assert!(!encoder.alarm());
    encoder.sample(START + Duration::from_micros(200), code(9_000));
    encoder.set_total_resolution(777).unwrap();
    assert!(encoder.alarm());
}
