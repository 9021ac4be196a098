//! A converter: encoder, line and the encoder as such behind it.

use codewheel_encoder::{ALARM_TIME, Direction, Encoder, Model, Settings as Scaling};
use codewheel_sim::shaft::Shaft;

use super::*;

/// The converter of a word, with a virtual encoder on a shaft at its line.
struct Converter {
    input: Input<VirtualLine<Shaft>>,
    encoder: Encoder,
    now: Instant,
}

impl Converter {
    fn new(word: Word, shaft: &str, direction: Direction) -> Self {
        let geometry = word.geometry();
        let model = Model { geometry, lithium_cell: false, total_follows_steps: false };
        let mut encoder = Encoder::with_defaults(model);
        encoder.apply(Scaling { direction, ..Scaling::default_for(model) }).unwrap();
        let shaft =
            Shaft::parse(shaft, geometry.singleturn_resolution(), geometry.revolutions()).unwrap();
        let line = VirtualLine::new(VirtualEncoder::new(shaft, Behaviour::of_word(word)));
        let input = Input::new(line, Settings::of_word(word)).unwrap();
        Self { input, encoder, now: Instant::ZERO }
    }

    /// Looks at the sensor when it is due.
    fn cycle(&mut self) {
        self.now = self.input.changes_at(self.now).expect("a line is always read again");
        self.encoder.sample(self.now, self.input.sample(self.now));
    }

    fn cycles(&mut self, count: u32) {
        for _ in 0..count {
            self.cycle();
        }
    }

    fn set_fault(&mut self, fault: Option<Fault>) {
        self.input.line_mut().encoder_mut().set_fault(fault);
    }

    /// By how much the position grows in a second, the shorter way round.
    fn growth(&mut self) -> i64 {
        self.cycle();
        let before = self.encoder.unwrapped();
        self.cycles(1_000);
        self.encoder.unwrapped() - before
    }
}

/// PROFIBUS manual §4, "Sense of rotation", HEAG.
#[test]
fn growing_values_give_growing_positions_with_cw_and_falling_ones_with_ccw() {
    for word in WORDS {
        let turn = i64::from(word.geometry().singleturn_resolution());
        let cw = Direction::Cw;
        let ccw = Direction::Ccw;
        for (shaft, direction, growth) in [
            ("turn rpm=60", cw, turn),
            ("turn rpm=60", ccw, -turn),
            ("turn rpm=-60", cw, -turn),
            ("turn rpm=-60", ccw, turn),
        ] {
            let mut converter = Converter::new(word, shaft, direction);
            assert_eq!(converter.growth(), growth, "{word:?} {shaft} {direction:?}");
            assert!(!converter.encoder.alarm());
        }
    }
}

#[test]
fn a_fault_holds_the_position_and_its_alarm_ends_two_and_a_half_seconds_after_the_last_cycle() {
    let mut converter = Converter::new(Word::Bits29, "turn rpm=60", Direction::Cw);
    converter.cycles(100);
    let held = converter.encoder.position();
    assert!(!converter.encoder.alarm());

    converter.set_fault(Some(Fault::Unplugged));
    for _ in 0..5_000 {
        converter.cycle();
        assert_eq!(converter.encoder.position(), held);
        assert_eq!(converter.encoder.line_fault(), Some(LineFault::StuckHigh));
        assert_eq!(converter.encoder.deadline(), Some(converter.now + ALARM_TIME));
    }
    let last = converter.now;

    converter.set_fault(None);
    converter.cycle();
    assert_eq!(converter.encoder.line_fault(), None);
    assert_eq!(
        converter.encoder.code(),
        converter.input.line().encoder().sensor().code(converter.now)
    );
    while converter.now < last + ALARM_TIME {
        assert!(converter.encoder.alarm());
        converter.cycle();
    }
    assert!(!converter.encoder.alarm());
    assert_eq!(converter.now, last + ALARM_TIME);
}

#[test]
fn a_line_that_never_answered_gives_an_alarm_and_no_position() {
    let mut converter = Converter::new(Word::Bits13, "turn rpm=60", Direction::Cw);
    converter.set_fault(Some(Fault::Shorted));
    converter.cycles(10);
    assert!(!converter.encoder.has_sample());
    assert!(converter.encoder.alarm());
    assert_eq!(converter.encoder.line_fault(), Some(LineFault::StuckLow));
    converter.set_fault(None);
    converter.cycle();
    assert!(converter.encoder.has_sample());
}

#[test]
fn a_flipped_high_bit_is_a_code_jump_whose_value_is_taken() {
    let mut converter = Converter::new(Word::Bits25, "still angle=10000", Direction::Cw);
    converter.cycles(10);
    converter.set_fault(Some(Fault::FlippedBits(1 << 24)));
    converter.cycle();
    assert!(converter.encoder.alarm());
    assert_eq!(converter.encoder.line_fault(), None);
    // The highest Gray bit inverts all bits of the code.
    assert_eq!(converter.encoder.position(), (1 << 25) - 1 - 10_000);
}

#[test]
fn a_fast_shaft_that_is_polled_between_the_readings_raises_no_alarm() {
    let mut converter = Converter::new(Word::Bits29, "turn rpm=11900", Direction::Cw);
    for micro in (0..1_000_000).step_by(130) {
        let now = micros(micro);
        let sample = converter.input.sample(now);
        converter.encoder.sample(now, sample);
        assert!(!converter.encoder.alarm(), "at {micro} µs");
    }
    assert!(converter.encoder.position() > 198 * 8_192);
}
