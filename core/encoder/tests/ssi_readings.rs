//! What is clocked on an SSI line, and what the samples mean.

mod common;

use codewheel_encoder::ssi::{
    Code, Input, Line, LineFault, Refusal, Settings, Word, octets_for, samples_of,
};
use codewheel_encoder::{Geometry, Reading, Sample, Sensor};
use codewheel_station::{Duration, Instant};
use common::{at_millis, cases};
use proptest::prelude::*;

const WORDS: [Word; 4] = [Word::Bits13, Word::Bits18, Word::Bits25, Word::Bits29];

/// Samples as one would note them at the oscilloscope; blanks are for the reader.
fn samples(text: &str) -> u64 {
    let bits = text.chars().filter(|bit| !bit.is_whitespace());
    bits.fold(0, |all, bit| all << 1 | u64::from(bit.to_digit(2).expect("a bit")))
}

fn binary(word: Word) -> Settings {
    Settings { code: Code::Binary, ..Settings::of_word(word) }
}

fn twice(word: Word) -> Settings {
    Settings { double_read: true, ..binary(word) }
}

/// Each bit of the code is the sum, mod 2, of the Gray bits from it upwards.
fn bit_by_bit(gray: u32) -> u32 {
    (0..32).map(|bit| ((gray >> bit).count_ones() & 1) << bit).sum()
}

#[test]
fn gray_code_is_read_as_the_sum_of_its_upper_bits() {
    for gray in 0..1 << 18 {
        assert_eq!(Code::Gray.decode(gray), bit_by_bit(gray), "{gray:018b}");
    }
    for gray in (0..u64::from(u32::MAX)).step_by(99_991) {
        assert_eq!(Code::Gray.decode(gray as u32), bit_by_bit(gray as u32), "{gray:032b}");
    }
    // The first codes, as every book prints them.
    let printed = [0b000, 0b001, 0b011, 0b010, 0b110, 0b111, 0b101, 0b100];
    assert_eq!(printed.map(|gray| Code::Gray.decode(gray)), [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn a_word_is_clocked_with_a_clock_before_it_and_one_after() {
    for (word, once, twice, geometry) in [
        (Word::Bits13, 15, 29, Geometry::SINGLETURN_13),
        (Word::Bits18, 20, 39, Geometry::SINGLETURN_18),
        (Word::Bits25, 27, 53, Geometry::MULTITURN_25),
        (Word::Bits29, 31, 61, Geometry::MULTITURN_29),
    ] {
        let settings = Settings::of_word(word);
        assert_eq!(settings.clocks(), once);
        assert_eq!(Settings { double_read: true, ..settings }.clocks(), twice);
        assert_eq!(word.geometry(), geometry);
        assert_eq!(Word::from_bits(word.bits()), Some(word));
        assert_eq!(1 << word.bits(), geometry.range());
    }
    assert_eq!([0, 12, 14, 24, 30, 255].map(Word::from_bits), [None; 6]);
}

#[test]
fn each_converter_reads_the_words_that_fit_it() {
    assert_eq!(Word::choices(Geometry::SINGLETURN_13), [Word::Bits13]);
    assert_eq!(Word::choices(Geometry::SINGLETURN_18), [Word::Bits18]);
    assert_eq!(Word::choices(Geometry::MULTITURN_29), [Word::Bits29, Word::Bits25]);
    assert_eq!(Word::choices(Geometry::MULTITURN_25), [Word::Bits29, Word::Bits25]);
}

#[test]
fn samples_of_a_sound_line_are_a_code() {
    let gray = Settings::of_word;
    for (settings, sampled, code) in [
        (binary(Word::Bits13), "1 0000000000000 0", 0),
        (binary(Word::Bits13), "1 1000000000001 0", 4_097),
        (binary(Word::Bits13), "1 1111111111111 0", 8_191),
        (gray(Word::Bits13), "1 1000000000000 0", 8_191),
        (gray(Word::Bits13), "1 1100000000000 0", 4_096),
        (binary(Word::Bits18), "1 100000000000000001 0", 131_073),
        (gray(Word::Bits18), "1 100000000000000000 0", 262_143),
        (binary(Word::Bits25), "1 000000000011 0000000000101 0", 3 * 8_192 + 5),
        (gray(Word::Bits25), "1 100000000000 0000000000000 0", 33_554_431),
        (binary(Word::Bits29), "1 1000000000000000 0000000000001 0", 268_435_457),
        (gray(Word::Bits29), "1 1000000000000000 0000000000000 0", 536_870_911),
        (twice(Word::Bits13), "1 1000000000001 0 1000000000001 0", 4_097),
        (twice(Word::Bits13), "1 1111111111111 0 1111111111111 0", 8_191),
    ] {
        assert_eq!(settings.decode(samples(sampled)), Ok(code), "{sampled}");
        let above = u64::MAX << settings.clocks();
        assert_eq!(settings.decode(samples(sampled) | above), Ok(code), "{sampled}");
    }
}

#[test]
fn each_line_fault_is_told_apart() {
    let high = LineFault::StuckHigh;
    let low = LineFault::StuckLow;
    let no_low = LineFault::NoLowAfterWord;
    for (settings, sampled, fault) in [
        (binary(Word::Bits13), "1 1111111111111 1", high),
        (binary(Word::Bits13), "0 0000000000000 0", low),
        (binary(Word::Bits13), "0 0110000000000 1", low),
        (binary(Word::Bits13), "1 0110000000000 1", no_low),
        (binary(Word::Bits13), "1 1111111111110 1", no_low),
        (Settings::of_word(Word::Bits18), "1 111111111111111111 1", high),
        (Settings::of_word(Word::Bits25), "0 0000000000000000000000000 0", low),
        (Settings::of_word(Word::Bits29), "1 00000000000000000000000000001 1", no_low),
        (twice(Word::Bits13), "1 1111111111111 1 1111111111111 1", high),
        (twice(Word::Bits13), "0 0000000000000 0 0000000000000 0", low),
        (twice(Word::Bits13), "1 0000000000001 1 0000000000001 0", no_low),
        (twice(Word::Bits13), "1 0000000000001 0 0000000000001 1", no_low),
        (twice(Word::Bits13), "1 0000000000001 0 0000000000000 0", LineFault::Mismatch),
        (twice(Word::Bits13), "1 0000000000001 0 1111111111111 1", LineFault::Mismatch),
    ] {
        assert_eq!(settings.decode(samples(sampled)), Err(fault), "{sampled}");
    }
}

#[test]
fn a_line_fault_says_what_was_seen_and_what_to_look_at() {
    for (fault, seen, advice) in [
        (LineFault::StuckHigh, "stays high", "supply"),
        (LineFault::StuckLow, "low before the first clock", "crossed data wires"),
        (LineFault::NoLowAfterWord, "not low after the last bit", "number of bits"),
        (LineFault::Mismatch, "read a second time is another", "double reading off"),
        (LineFault::NoTransfer, "could not be clocked", "port"),
    ] {
        let sentence = fault.to_string();
        assert!(sentence.contains(seen) && sentence.contains(advice), "{sentence}");
    }
}

#[test]
fn settings_no_line_can_be_read_with_are_refused() {
    let defaults = Settings::of_word(Word::Bits29);
    let micros = Duration::from_micros;
    let clock = |clock_hz| Settings { clock_hz, ..defaults }.check();
    let monoflop = |monoflop| Settings { monoflop, ..defaults }.check();
    let cycle = |cycle| Settings { cycle, ..defaults }.check();
    for word in WORDS {
        assert_eq!(Settings::of_word(word).check(), Ok(()));
    }
    assert_eq!(clock(99_999), Err(Refusal::Clock));
    assert_eq!(clock(100_000), Ok(()));
    assert_eq!(clock(1_000_000), Ok(()));
    assert_eq!(clock(1_000_001), Err(Refusal::Clock));
    assert_eq!(clock(0), Err(Refusal::Clock));
    assert_eq!(monoflop(micros(2)), Err(Refusal::Monoflop { above: micros(2) }));
    assert_eq!(monoflop(Duration::from_nanos(2_001)), Ok(()));
    // 31 clocks are 4 octets: 64 µs.
    assert_eq!(monoflop(micros(936)), Ok(()));
    assert_eq!(monoflop(micros(937)), Err(Refusal::Cycle { min: micros(1_001) }));
    assert_eq!(cycle(micros(84)), Ok(()));
    assert_eq!(cycle(micros(83)), Err(Refusal::Cycle { min: micros(84) }));
    assert_eq!(cycle(micros(2_000)), Ok(()));
    assert_eq!(cycle(micros(2_001)), Err(Refusal::Cycle { min: micros(84) }));
    let slowest = Settings { clock_hz: 100_000, double_read: true, ..defaults };
    assert_eq!(slowest.transfer_time(), micros(640));
    assert_eq!(slowest.check(), Ok(()));
}

#[test]
fn a_refusal_says_what_is_allowed() {
    for (refusal, sentence) in [
        (Refusal::Clock, "the SSI clock is 100000 to 1000000 Hz"),
        (
            Refusal::Monoflop { above: Duration::from_micros(10) },
            "the monoflop time is longer than a period of the SSI clock, here 10 µs: raise the \
             time or the clock",
        ),
        (
            Refusal::Cycle { min: Duration::from_micros(84) },
            "the SSI cycle is 84 to 2000 µs with this word, clock and monoflop time",
        ),
        (
            Refusal::Cycle { min: Duration::from_millis(3) },
            "one SSI reading and the monoflop time after it take 3000 µs, and the cycle is at \
             most 2000 µs: lower the monoflop time or raise the clock",
        ),
    ] {
        assert_eq!(refusal.to_string(), sentence);
    }
}

#[test]
fn samples_are_cut_out_of_whole_octets() {
    assert_eq!([13, 15, 16, 17, 31, 39, 61, 64].map(octets_for), [2, 2, 2, 3, 4, 5, 8, 8]);
    assert_eq!(samples_of(&[0b1000_0000, 0b0000_1101], 15), samples("1 0000000000011 0"));
    assert_eq!(samples_of(&[0xFF; 8], 61), (1 << 61) - 1);
    assert_eq!(samples_of(&[0x80, 0, 0, 0, 0, 0, 0, 1], 64), 1 << 63 | 1);
    assert_eq!(samples_of(&[0xA5], 16), 0xA500, "too few octets read as 0");
    assert_eq!(samples_of(&[0xFF; 9], 255), u64::MAX);
    assert_eq!(samples_of(&[0xFF], 0), 0);
}

/// A line that plays what it was given, and notes when it was clocked.
#[derive(Debug, Default)]
struct Played {
    sampled: Option<u64>,
    clocked: Vec<(Instant, u8, u32)>,
}

impl Line for Played {
    fn transfer(&mut self, now: Instant, clocks: u8, clock_hz: u32) -> Option<u64> {
        self.clocked.push((now, clocks, clock_hz));
        self.sampled
    }
}

#[test]
fn the_line_is_read_once_a_cycle_however_often_the_input_is_asked() {
    let line = Played { sampled: Some(samples("1 0000000000011 0")), ..Played::default() };
    let mut input = Input::new(line, binary(Word::Bits13)).unwrap();
    assert_eq!(input.changes_at(at_millis(5)), Some(at_millis(5)), "it has not read yet");
    let fresh = |code| Sample { code, ..Sample::default() };
    let repeated = |code| Sample { reading: Reading::Repeated, ..fresh(code) };

    assert_eq!(input.sample(at_millis(5)), fresh(3));
    input.line_mut().sampled = Some(samples("1 0000000000111 0"));
    for micro in [0, 1, 500, 999] {
        let now = at_millis(5) + Duration::from_micros(micro);
        assert_eq!(input.sample(now), repeated(3));
        assert_eq!(input.changes_at(now), Some(at_millis(6)));
    }
    assert_eq!(input.sample(at_millis(6)), fresh(7));
    assert_eq!(input.sample(at_millis(100)), fresh(7));
    let clocked = [5, 6, 100].map(|milli| (at_millis(milli), 15, 500_000));
    assert_eq!(input.line().clocked, clocked);
}

#[test]
fn a_port_that_fails_is_a_fault_of_its_own() {
    let mut input = Input::new(Played::default(), binary(Word::Bits13)).unwrap();
    let sample = input.sample(Instant::ZERO);
    assert_eq!(sample.reading, Reading::Failed(LineFault::NoTransfer));
}

#[test]
fn an_input_with_wrong_settings_is_not_made() {
    let settings = Settings { clock_hz: 2_000_000, ..binary(Word::Bits13) };
    assert_eq!(Input::new(Played::default(), settings).err(), Some(Refusal::Clock));
}

proptest! {
    #![proptest_config(cases(2_000))]

    /// Noise may be taken for a code, but never for one the product does not have.
    #[test]
    fn whatever_is_sampled_is_a_code_of_the_disc_or_a_fault(
        sampled: u64,
        word in prop::sample::select(WORDS.to_vec()),
        double_read: bool,
        gray: bool,
    ) {
        let code = if gray { Code::Gray } else { Code::Binary };
        let settings = Settings { code, double_read, ..Settings::of_word(word) };
        if let Ok(code) = settings.decode(sampled) {
            prop_assert!(code < word.geometry().range());
        }
    }
}
