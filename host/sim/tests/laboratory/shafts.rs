use std::io::Write;

use codewheel_encoder::Sensor;
use codewheel_sim::shaft::Shaft;
use proptest::prelude::*;

use super::*;

const S: u32 = 8192;
const M: u32 = 65_536;

fn shaft(text: &str) -> Shaft {
    Shaft::parse(text, S, M).unwrap()
}

fn code(text: &str, at: Instant) -> u32 {
    shaft(text).code(at)
}

fn error(text: &str) -> String {
    Shaft::parse(text, S, M).unwrap_err().to_string()
}

fn seconds(seconds: u64) -> Instant {
    Instant::ZERO + Duration::from_secs(seconds)
}

#[test]
fn a_shaft_at_rest_rests_where_it_is_put() {
    assert_eq!(code("still", seconds(9)), 0);
    assert_eq!(code("still angle=4096", seconds(9)), 4096);
    assert_eq!(code("still angle=90deg", seconds(9)), 2048);
    assert_eq!(code("still angle=1.5turns", seconds(9)), 12_288);
    assert_eq!(code("still angle=-1", seconds(9)), S * M - 1);
    assert_eq!(shaft("still").changes_at(seconds(1)), None);
    assert_eq!(shaft("turn rpm=0 angle=7").changes_at(seconds(1)), None);
    assert_eq!(shaft("sine amplitude=0 period=1s").changes_at(seconds(1)), None);
}

#[test]
fn an_even_turn_is_exact_after_a_year() {
    let year = 365 * 86_400;
    // 60.5 rpm: 1.0083̅ turns a second.
    let turns = u128::from(year) * 121 / 120;
    assert_eq!(turns * 120, u128::from(year) * 121, "a whole number of turns");
    let expected = (turns % u128::from(M)) as u32 * S;
    assert_eq!(code("turn rpm=60.5", seconds(year)), expected);
    let nanosecond = Duration::from_nanos(1);
    assert_eq!(code("turn rpm=60.5", seconds(year) - nanosecond), (expected + S * M - 1) % (S * M));
    assert_eq!(shaft("turn rpm=60.5").changes_at(seconds(year)), Some(seconds(year)));
}

#[test]
fn a_turn_wraps_at_the_number_of_codes_both_ways() {
    assert_eq!(code("turn rpm=60 angle=-1", seconds(1)), S - 1);
    assert_eq!(code("turn rpm=-60", seconds(1)), S * M - S);
    assert_eq!(code("turn rpm=-0.5", seconds(60)), S * M - S / 2);
    assert_eq!(code("turn rpm=-0.5", Instant::from_nanos(1)), S * M - 1, "rounded down");
    assert_eq!(Shaft::parse("turn rpm=60", S, 1).unwrap().code(seconds(5)), 0);
}

#[test]
fn a_sine_swings_to_both_sides_of_its_start() {
    let text = "sine amplitude=90deg period=2s angle=1turn";
    assert_eq!(code(text, millis(0)), S);
    assert_eq!(code(text, millis(500)), S + 2048);
    assert_eq!(code(text, millis(1_500)), S - 2048);
    assert_eq!(code(text, seconds(2_000_000_000)), S, "no drift after 63 years");
    assert_eq!(shaft(text).changes_at(millis(3)), Some(millis(3)));
}

#[test]
fn a_profile_goes_from_point_to_point_and_rests_after_the_last() {
    let text = "profile 1s:0 2s:90deg 4s:90deg 5s:-1turn angle=8192";
    let codes = [(0, 0), (1_000, 0), (1_500, 1024), (2_000, 2048), (3_000, 2048), (9_000, -8192)];
    for (at, relative) in codes {
        assert_eq!(i64::from(code(text, millis(at))), 8192 + relative, "{at} ms");
    }
    let moves = |at| shaft(text).changes_at(millis(at));
    assert_eq!(moves(0), Some(millis(1_000)));
    assert_eq!(moves(1_000), Some(millis(1_000)));
    assert_eq!(moves(1_200), Some(millis(1_200)));
    assert_eq!(moves(2_000), Some(millis(4_000)));
    assert_eq!(moves(4_999), Some(millis(4_999)));
    assert_eq!(moves(5_000), None);
    assert_eq!(shaft("profile 3s:90deg").changes_at(millis(0)), None, "a single point is a place");
}

#[test]
fn a_repeated_profile_goes_on_from_where_the_last_round_ended() {
    let text = "profile 0s:0 100ms:90deg 1s:90deg repeat";
    assert_eq!(code(text, millis(999)), 2048);
    assert_eq!(code(text, millis(1_050)), 3072);
    assert_eq!(code(text, millis(4_500)), 5 * 2048);
    let year = 365 * 86_400;
    let expected = (year + 1) * 2048 % u64::from(S * M);
    assert_eq!(u64::from(code(text, seconds(year) + Duration::from_millis(500))), expected);
    assert_eq!(shaft(text).changes_at(millis(500)), Some(millis(1_000)));
    assert_eq!(shaft(text).changes_at(millis(1_099)), Some(millis(1_099)));
    assert_eq!(shaft(text).changes_at(millis(1_100)), Some(millis(2_000)));
}

#[test]
fn a_new_motion_goes_on_where_the_shaft_is() {
    let before = shaft("turn rpm=60");
    let now = millis(1_250);
    let after = shaft("turn rpm=-60").from_code(before.code(now)).beginning(now);
    assert_eq!(after.code(millis(0)), S + 2048, "it rests until it begins");
    assert_eq!(after.changes_at(millis(3)), Some(now));
    assert_eq!(after.code(now), S + 2048);
    assert_eq!(after.code(millis(1_500)), S);
}

#[test]
fn a_shaft_that_is_turned_goes_evenly_and_rests_so_many_steps_further() {
    let before = shaft("turn rpm=60");
    let now = millis(1_250);
    let turned = before.turned(now, -1_000, Duration::from_millis(50));
    assert_eq!(turned.code(now), S + 2048);
    assert_eq!(turned.code(millis(1_275)), S + 2048 - 500);
    assert_eq!(turned.steps_left(millis(1_275)), -500);
    assert!(turned.moves_from(millis(1_299)) && !turned.moves_from(millis(1_300)));
    assert_eq!(turned.code(seconds(99)), S + 2048 - 1_000);
    assert_eq!(turned.steps_left(seconds(99)), 0);
    assert_eq!(before.turned(now, 7, Duration::ZERO).code(now), S + 2048 + 7);
}

#[test]
fn turning_adds_up_to_the_step_whatever_fraction_of_one_it_is_broken_off_at() {
    let mut turned = shaft("turn rpm=0.001");
    let (mut now, begin) = (millis(12_345), turned.code(millis(12_345)));
    for _ in 0..1_000 {
        let steps = turned.steps_left(now) + 3;
        turned = turned.turned(now, steps, Duration::from_micros(50_000));
        now += Duration::from_micros(7_777);
    }
    assert_eq!(turned.code(seconds(60)), begin + 3_000);
}

#[test]
fn a_shaft_that_is_held_rests_and_another_motion_goes_on_from_there() {
    let turning = shaft("turn rpm=60");
    let held = turning.held(millis(1_250));
    assert_eq!((held.code(seconds(9)), held.moves_from(seconds(2))), (S + 2048, false));
    let on = shaft("turn rpm=-60 angle=7").going_on_from(&held, seconds(9));
    assert_eq!(on.code(seconds(9)), S + 2048);
    assert_eq!(on.code(seconds(9) + Duration::from_millis(250)), S);
    assert_eq!(on.steps_left(seconds(9)), 0, "it never rests");
}

fn file(text: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::Builder::new().prefix("a shaft ").tempfile().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    file
}

#[test]
fn a_file_of_seconds_and_turns_is_a_profile() {
    for header in ["", "seconds,turns\n", "\u{FEFF}\"t [s]\", \"angle\"\r\n"] {
        let file = file(&format!("{header}# a comment\n0,0\r\n1.5, \"0.25\"\n\n2,0.25\n3,-1\n"));
        let text = format!("csv {} angle=1turn", file.path().display());
        assert_eq!(code(&text, millis(750)), S + 1024);
        assert_eq!(code(&text, millis(9_000)), 0);
        assert_eq!(shaft(&text).changes_at(millis(1_500)), Some(millis(2_000)));
        assert_eq!(shaft(&text).changes_at(millis(3_000)), None);
    }
}

#[test]
fn a_bad_file_is_named_with_its_line() {
    let cases = [
        ("0,0\n1,1,1\n", "line 2 of ", "'1,1,1' is not two columns, seconds and turns"),
        ("0,0\n\n1\n", "line 3 of ", "'1' is not two columns, seconds and turns"),
        ("seconds,turns\n0,0\n1,x\n", "line 3 of ", "'x' is no angle in turns, a decimal number"),
        ("0,0\nnan,1\n", "line 2 of ", "'nan' is no time in seconds, a decimal from 0 on"),
        ("0,0\n500ms,1\n", "line 2 of ", "'500ms' is no time in seconds, a decimal from 0 on"),
        ("-1,0\n", "line 1 of ", "'-1' is no time in seconds, a decimal from 0 on"),
        ("0;0\n", "line 1 of ", "'0;0' is not two columns, seconds and turns"),
        ("0,inf\n", "line 1 of ", "'inf' is no angle in turns, a decimal number"),
        ("1,0\n1,1\n", "line 2 of ", "the time 1 does not come after the line before"),
        ("", "the shaft file ", "has no line with seconds and turns"),
        ("seconds,turns\n", "the shaft file ", "has no line with seconds and turns"),
    ];
    for (text, begins, ends) in cases {
        let file = file(text);
        let error = error(&format!("csv {}", file.path().display()));
        assert!(error.starts_with(begins) && error.ends_with(ends), "{error}");
        assert!(error.contains(&file.path().display().to_string()), "{error}");
    }
    let missing = error("csv no/such file.csv");
    assert!(missing.starts_with("cannot read the shaft file no/such file.csv: "), "{missing}");
    let mut binary = tempfile::NamedTempFile::new().unwrap();
    binary.write_all(b"0,0\n1,\xFF\n").unwrap();
    let error = error(&format!("csv {}", binary.path().display()));
    assert!(error.starts_with("line 2") && error.ends_with("it is not UTF-8 text"), "{error}");
}

#[test]
fn an_error_says_what_was_given_and_what_is_allowed() {
    let angle = "it is an angle in whole raw steps (4096), degrees (90deg) or turns (1.5turns)";
    let time = "it is a time in seconds (1.5s) or milliseconds (500ms)";
    let cases = [
        (
            "trun rpm=60",
            "shaft 'trun rpm=60' makes no sense: it is one of still, turn rpm=R, \
             sine amplitude=A period=T, profile T:A T:A …, csv FILE",
        ),
        ("turn", "shaft 'turn' lacks rpm=R"),
        ("turn 60", "'60' means nothing to shaft 'turn', which takes rpm=R angle=A"),
        (
            "turn rpm=60 speed=1",
            "'speed=1' means nothing to shaft 'turn', which takes rpm=R angle=A",
        ),
        ("turn rpm=60 rpm=1", "'rpm=' stands twice in the shaft: once is enough"),
        (
            "turn rpm=inf",
            "'inf' is no speed: it is from -1000000 to 1000000 revolutions per minute",
        ),
        (
            "turn rpm=1000000.5",
            "'1000000.5' is no speed: it is from -1000000 to 1000000 revolutions per minute",
        ),
        ("sine period=1s", "shaft 'sine' lacks amplitude=A"),
        ("sine amplitude=90deg", "shaft 'sine' lacks period=T"),
        ("sine amplitude=90deg period=0", "'0' is no period: it is a time above zero, in s or ms"),
        ("still angle=0.25", &format!("'0.25' is no angle: {angle}")),
        ("sine amplitude=NaN period=1", &format!("'NaN' is no amplitude: {angle}")),
        ("profile", "shaft 'profile' lacks points T:A as in 0s:0 1.5s:90deg"),
        ("profile -1s:0", &format!("'-1s' is no time: {time}")),
        ("profile 0s:90grad", &format!("'90grad' is no angle: {angle}")),
        (
            "profile 0s:0 1s:1 1s:2",
            "the times of a shaft rise from point to point, but '1s:2' does not come after '1s:1'",
        ),
        (
            "profile 0s:0 again",
            "'again' means nothing to shaft 'profile', which takes points T:A as in 1.5s:90deg, \
             repeat and angle=A",
        ),
        (
            "profile 0s:0 repeat",
            "a repeated profile lasts 1 ms at least, but its last point is '0s:0'",
        ),
        ("csv", "shaft 'csv' lacks the name of its FILE"),
        ("csv angle=1", "shaft 'csv' lacks the name of its FILE"),
    ];
    for (text, expected) in cases {
        assert_eq!(error(text), expected);
    }
    let geometry = Shaft::parse("still", 0, 1).unwrap_err().to_string();
    assert_eq!(
        geometry,
        "a code disc of 0 steps per turn and 1 turns makes no sense: their product is 1 to 4294967295"
    );
    assert!(Shaft::parse("still", 1 << 16, 1 << 16).is_err());
}

proptest! {
    #[test]
    fn no_text_panics_and_every_code_is_in_range(
        words in proptest::collection::vec(
            prop_oneof![
                Just("still".to_owned()), Just("turn".to_owned()), Just("sine".to_owned()),
                Just("profile".to_owned()), Just("repeat".to_owned()),
                "(rpm|angle|period|amplitude)=-?[0-9]{1,11}(\\.[0-9]{1,9})?(s|ms|deg|turns)?",
                "[0-9]{1,11}m?s?:-?[0-9]{1,11}(deg|turn)?",
                ".{0,8}",
            ],
            0..6,
        ),
        nanos in prop_oneof![any::<u64>(), Just(u64::MAX), Just(0)],
        revolutions in 1..=1_u32 << 13,
    ) {
        if let Ok(shaft) = Shaft::parse(&words.join(" "), 1 << 18, revolutions) {
            let now = Instant::from_nanos(nanos);
            prop_assert!(shaft.code(now) < shaft.codes());
            prop_assert!(shaft.changes_at(now).is_none_or(|at| at >= now));
        }
    }

    #[test]
    fn a_shaft_that_says_it_rests_does_rest(
        angles in proptest::collection::vec(0..3_u32, 1..8),
        repeat in any::<bool>(),
        at in 0..20_000_u64,
    ) {
        let points = angles.iter().zip(1..).map(|(angle, second)| format!(" {second}s:{angle}turns"));
        let repeat = if repeat { " repeat" } else { "" };
        let shaft = shaft(&format!("profile{}{repeat}", points.collect::<String>()));
        let end = shaft.changes_at(millis(at)).unwrap_or(millis(100_000));
        for step in 0..=10 {
            let between = end.since(millis(at)).as_nanos() / 10 * step;
            let code = shaft.code(millis(at) + Duration::from_nanos(between));
            prop_assert_eq!(code, shaft.code(millis(at)));
        }
    }

    #[test]
    fn an_even_turn_is_the_formula(rpm in -20_000_000_i64..20_000_000, nanos in 0..u64::MAX / 2) {
        let text = format!("turn rpm={}{}.{:03}", if rpm < 0 { "-" } else { "" }, rpm.abs() / 1_000, rpm.abs() % 1_000);
        let steps = (i128::from(rpm) * i128::from(nanos) * i128::from(S)).div_euclid(60_000_000_000_000);
        let expected = steps.rem_euclid(i128::from(S * M)) as u32;
        prop_assert_eq!(code(&text, Instant::from_nanos(nanos)), expected);
    }
}
