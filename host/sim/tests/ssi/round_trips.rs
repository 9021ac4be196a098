use codewheel_encoder::ssi::{MAX_CLOCK_HZ, MIN_CLOCK_HZ};
use proptest::prelude::*;

use super::*;

const CODES: [Code; 2] = [Code::Gray, Code::Binary];

/// A line and settings that agree.
fn agreed(word: Word, code: Code) -> (DiscLine, Settings) {
    let behaviour = Behaviour { code, ..Behaviour::of_word(word) };
    (line(behaviour), Settings { code, ..Settings::of_word(word) })
}

#[test]
fn every_code_of_the_short_words_arrives() {
    for code in CODES {
        for word in [Word::Bits13, Word::Bits18] {
            let (mut line, settings) = agreed(word, code);
            let mut now = Instant::ZERO;
            for value in 0..1 << word.bits() {
                assert_eq!(read(&mut line, &settings, &mut now, value), Ok(value));
            }
        }
    }
}

#[test]
fn the_corners_of_the_long_words_arrive() {
    for code in CODES {
        for word in [Word::Bits25, Word::Bits29] {
            let (mut line, settings) = agreed(word, code);
            let mut now = Instant::ZERO;
            let ones = (0..=word.bits()).map(|bits| (1_u32 << bits) - 1);
            let powers = (0..word.bits()).map(|bit| 1 << bit);
            for value in ones.chain(powers) {
                assert_eq!(read(&mut line, &settings, &mut now, value), Ok(value));
            }
        }
    }
}

#[test]
fn the_next_reading_is_sound_right_after_the_monoflop_time() {
    for in_whole_octets in [false, true] {
        for word in WORDS {
            let settings = Settings::of_word(word);
            let encoder = VirtualEncoder::new(Disc(5), Behaviour::of_word(word));
            let mut line = if in_whole_octets {
                VirtualLine::in_whole_octets(encoder)
            } else {
                VirtualLine::new(encoder)
            };
            let pause = settings.transfer_time() + settings.monoflop;
            let mut now = Instant::ZERO;
            for _ in 0..10 {
                now += pause;
                let sampled = line.transfer(now, settings.clocks(), settings.clock_hz).unwrap();
                assert_eq!(settings.decode(sampled), Ok(5), "{word:?}");
            }
        }
    }
}

#[test]
fn a_port_without_a_clock_reads_nothing() {
    assert_eq!(line(Behaviour::of_word(Word::Bits13)).transfer(millis(1), 15, 0), None);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2_000) })]

    #[test]
    fn any_code_arrives_at_any_clock_through_any_port(
        value: u32,
        word in prop::sample::select(WORDS.to_vec()),
        code in prop::sample::select(CODES.to_vec()),
        clock_hz in MIN_CLOCK_HZ..=MAX_CLOCK_HZ,
        double_read: bool,
        repeats: bool,
        in_whole_octets: bool,
    ) {
        let value = value % word.geometry().range();
        let repeats = repeats || double_read;
        let behaviour = Behaviour { code, repeats, ..Behaviour::of_word(word) };
        let encoder = VirtualEncoder::new(Disc(value), behaviour);
        let line = if in_whole_octets {
            VirtualLine::in_whole_octets(encoder)
        } else {
            VirtualLine::new(encoder)
        };
        let settings = Settings { code, clock_hz, double_read, ..Settings::of_word(word) };
        let mut input = Input::new(line, settings).unwrap();
        for milli in 1..4 {
            let expected = Sample { code: value, ..Sample::default() };
            prop_assert_eq!(input.sample(millis(milli)), expected);
        }
    }
}
