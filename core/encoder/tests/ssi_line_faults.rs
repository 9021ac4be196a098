//! What an encoder makes of an SSI line that fails, and of one that is read in a cycle.

mod common;

use codewheel_encoder::ssi::{LineFault, Word};
use codewheel_encoder::{
    ALARM_TIME, Direction, Encoder, Model, Reading, Refusal, Sample, Settings,
};
use codewheel_station::{Duration, Instant};
use common::{MULTITURN, WORD_OF_25_BITS, at_millis, code, encoder_with};

const CYCLE: Duration = Duration::from_millis(1);

fn failed(fault: LineFault) -> Sample {
    // The code of a failed reading means nothing, whatever it is.
    Sample { code: 0x0AAA, reading: Reading::Failed(fault), ..Sample::default() }
}

fn repeated(code: u32) -> Sample {
    Sample { code, reading: Reading::Repeated, ..Sample::default() }
}

fn encoder() -> Encoder {
    encoder_with(MULTITURN, Settings::default_for(MULTITURN))
}

#[test]
fn a_line_fault_holds_the_last_good_position_and_says_which_fault_it_is() {
    for fault in [
        LineFault::StuckHigh,
        LineFault::StuckLow,
        LineFault::NoLowAfterWord,
        LineFault::Mismatch,
        LineFault::NoTransfer,
    ] {
        let mut encoder = encoder();
        encoder.sample(at_millis(1), code(123_456));
        encoder.sample(at_millis(2), failed(fault));
        assert_eq!(encoder.position(), 123_456);
        assert_eq!(encoder.code(), 123_456);
        assert_eq!(encoder.line_fault(), Some(fault));
        assert!(encoder.alarm());
    }
}

/// PROFIBUS manual §7.1: reset after 2.5 s, and extended by a further event.
#[test]
fn each_failed_reading_renews_the_alarm_which_ends_two_and_a_half_seconds_after_the_last() {
    let mut encoder = encoder();
    let mut now = at_millis(10);
    encoder.sample(now, code(7));
    for _ in 0..6_000 {
        now += CYCLE;
        encoder.sample(now, failed(LineFault::StuckHigh));
        assert!(encoder.alarm());
        assert_eq!(encoder.deadline(), Some(now + ALARM_TIME));
    }
    let last = now;
    encoder.sample(last + CYCLE, code(7));
    assert_eq!(encoder.line_fault(), None, "the fault is over with the first good reading");
    encoder.advance(last + ALARM_TIME - Duration::from_nanos(1));
    assert!(encoder.alarm());
    encoder.advance(last + ALARM_TIME);
    assert!(!encoder.alarm());
}

#[test]
fn without_a_good_reading_there_is_an_alarm_and_no_position() {
    let mut encoder = encoder();
    encoder.sample(at_millis(1), failed(LineFault::StuckHigh));
    assert!(encoder.alarm());
    assert!(!encoder.has_sample());
    assert_eq!(encoder.set_preset(0), Err(Refusal::NoSample));
    assert_eq!(encoder.reference(), None);
    encoder.sample(at_millis(1), repeated(0));
    assert!(!encoder.has_sample(), "what repeats a failed reading is no reading");

    encoder.sample(at_millis(2), code(1 << 28));
    assert!(encoder.has_sample());
    assert_eq!(encoder.position(), 1 << 28);
    assert_eq!(encoder.deadline(), Some(at_millis(1) + ALARM_TIME), "the first code is no jump");
}

#[test]
fn the_code_after_a_short_fault_is_judged_by_the_time_since_the_last_good_one() {
    // 12 000 rpm · 8192 steps · 2 ms / 60 s = 3276.8 steps.
    for (moved, jumped) in [(3_276, false), (3_277, true)] {
        let mut encoder = encoder();
        encoder.sample(at_millis(1), code(0));
        encoder.sample(at_millis(2), failed(LineFault::NoLowAfterWord));
        encoder.sample(at_millis(3), code(moved));
        let event = if jumped { at_millis(3) } else { at_millis(2) };
        assert_eq!(encoder.deadline(), Some(event + ALARM_TIME));
        assert_eq!(encoder.position(), moved);
    }
}

#[test]
fn a_code_jump_alarms_and_the_new_value_is_taken() {
    let mut encoder = encoder();
    encoder.sample(at_millis(1), code(0));
    encoder.sample(at_millis(2), code(5_000));
    assert!(encoder.alarm());
    assert_eq!(encoder.position(), 5_000);
    assert_eq!(encoder.line_fault(), None, "the line itself is sound");
}

/// A poll between two readings must not make the next one seem to have moved in no time.
#[test]
fn a_fast_shaft_read_in_a_cycle_raises_no_alarm_however_often_it_is_asked_for() {
    let mut encoder = encoder();
    for cycle in 1..1_000 {
        let steps = 1_600 * cycle as u32;
        encoder.sample(at_millis(cycle), code(steps));
        for micro in [0, 1, 500, 999] {
            encoder.sample(at_millis(cycle) + Duration::from_micros(micro), repeated(steps));
            assert!(!encoder.alarm(), "cycle {cycle}, {micro} µs");
            assert_eq!(encoder.position(), steps);
        }
    }
    encoder.sample(at_millis(1_000), code(1_600 * 999 + 1_639));
    assert!(encoder.alarm(), "a jump is one all the same");
}

#[test]
fn a_repeated_reading_lets_an_alarm_end_like_the_deadline_would() {
    let mut encoder = encoder();
    encoder.sample(at_millis(1), failed(LineFault::StuckLow));
    encoder.sample(at_millis(1) + ALARM_TIME, repeated(0));
    assert!(!encoder.alarm());
    assert_eq!(encoder.line_fault(), Some(LineFault::StuckLow), "nothing was read since");
}

/// The positions of a line whose values grow by 100 a cycle, over the zero of the code.
fn positions(model: Model, direction: Direction) -> Vec<u32> {
    let settings = Settings { direction, ..Settings::default_for(model) };
    let mut encoder = encoder_with(model, settings);
    let range = model.geometry.range();
    let values = (0..20).map(|cycle| (range - 1_000 + 100 * cycle) % range);
    let read = values.zip(0..).map(|(value, milli)| {
        encoder.sample(Instant::ZERO + Duration::from_millis(milli), code(value));
        assert!(!encoder.alarm());
        encoder.position()
    });
    read.collect()
}

/// PROFIBUS manual §4, "Sense of rotation", HEAG.
#[test]
fn growing_values_give_growing_positions_with_cw_and_falling_ones_with_ccw() {
    for word in [Word::Bits13, Word::Bits18, Word::Bits25, Word::Bits29] {
        let model = Model { geometry: word.geometry(), ..WORD_OF_25_BITS };
        let range = model.geometry.range();
        let steps = |positions: Vec<u32>| -> Vec<u32> {
            positions.windows(2).map(|pair| (pair[1] + range - pair[0]) % range).collect()
        };
        assert_eq!(steps(positions(model, Direction::Cw)), [100; 19], "{word:?}");
        assert_eq!(steps(positions(model, Direction::Ccw)), [range - 100; 19], "{word:?}");
    }
}

#[test]
fn a_word_of_25_bits_limits_the_total_and_counts_its_own_zero() {
    let mut encoder = encoder_with(WORD_OF_25_BITS, Settings::default_for(WORD_OF_25_BITS));
    assert_eq!(encoder.settings().total_resolution, 8_192 * 4_096);
    assert_eq!(
        encoder.set_total_resolution(8_192 * 4_096 + 1),
        Err(Refusal::TotalResolution { max: 8_192 * 4_096 })
    );
    // 4096 turns are no multiple of 3000 turns: the crossing must be counted.
    encoder.set_total_resolution(8_192 * 3_000).unwrap();
    encoder.sample(at_millis(1), code((1 << 25) - 1));
    let before = encoder.position();
    encoder.sample(at_millis(2), code(0));
    assert_eq!(encoder.position(), before + 1);
    assert!(!encoder.alarm());
}
