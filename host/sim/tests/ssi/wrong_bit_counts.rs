//! Master and encoder that disagree about the bits of the word.

use codewheel_encoder::{Encoder, Model};
use codewheel_sim::shaft::Shaft;

use super::*;

/// What the encoder shows from the first rising edge on, written out: its word of `bits` and a low
/// bit, again and again or followed by zeros.
fn shown(code: u32, bits: usize, repeats: bool) -> String {
    let word = format!("{:0bits$b}0", code ^ (code >> 1));
    if repeats { word.repeat(5) } else { word + &"0".repeat(70) }
}

#[test]
fn a_longer_word_of_the_encoder_is_named_whenever_its_next_bit_is_high() {
    for (master, encoder) in [(Word::Bits13, 25), (Word::Bits25, 29), (Word::Bits18, 29)] {
        let behaviour = Behaviour { bits: encoder, ..Behaviour::of_word(master) };
        let mut line = line(behaviour);
        let settings = Settings::of_word(master);
        let mut now = Instant::ZERO;
        let mut named = 0;
        for code in (0..1 << encoder).step_by(99_991) {
            let shown = shown(code, encoder.into(), true);
            let next = shown.as_bytes()[usize::from(master.bits())];
            let seen = read(&mut line, &settings, &mut now, code);
            if next == b'1' {
                assert_eq!(seen, Err(LineFault::NoLowAfterWord), "{code}");
                named += 1;
            } else {
                // Its upper bits, which are a Gray word of their own.
                assert_eq!(seen, Ok(code >> (encoder - master.bits())), "{code}");
            }
        }
        assert!(named > 100, "{master:?}: {named}");
    }
}

#[test]
fn a_shorter_word_of_the_encoder_is_named_whenever_the_repeated_bit_there_is_high() {
    for (master, encoder) in [(Word::Bits25, 13), (Word::Bits29, 25), (Word::Bits29, 13)] {
        let behaviour = Behaviour { bits: encoder, ..Behaviour::of_word(master) };
        let mut line = line(behaviour);
        let settings = Settings::of_word(master);
        let mut now = Instant::ZERO;
        let mut named = 0;
        for code in (0..1 << encoder).step_by(if encoder == 13 { 7 } else { 99_991 }) {
            let shown = shown(code, encoder.into(), true);
            let last = shown.as_bytes()[usize::from(master.bits())];
            let seen = read(&mut line, &settings, &mut now, code);
            assert_eq!(seen.is_err(), last == b'1', "{code}");
            if let Err(fault) = seen {
                assert_eq!(fault, LineFault::NoLowAfterWord);
                named += 1;
            }
        }
        assert!(named > 100, "{master:?}: {named}");
    }
}

/// What a converter on a turning shaft shows within a second: whether there was an alarm, and the
/// line fault if there was one.
fn shown_within_a_second(master: Settings, encoder: Behaviour) -> (bool, Option<LineFault>) {
    let shaft = Shaft::parse("turn rpm=60", 8_192, 1 << (encoder.bits - 13)).unwrap();
    let line = VirtualLine::new(VirtualEncoder::new(shaft, encoder));
    let mut input = Input::new(line, master).unwrap();
    let geometry = master.word.geometry();
    let model = Model { geometry, lithium_cell: false, total_follows_steps: false };
    let mut converter = Encoder::with_defaults(model);
    let mut shown = (false, None);
    for now in (1..1_000).map(millis) {
        converter.sample(now, input.sample(now));
        shown = (shown.0 | converter.alarm(), shown.1.or(converter.line_fault()));
    }
    shown
}

#[test]
fn a_turning_shaft_gives_a_wrong_bit_count_away() {
    let repeating = |bits| Behaviour { bits, ..Behaviour::of_word(Word::Bits13) };
    let silent = |bits| Behaviour { repeats: false, ..repeating(bits) };
    let no_low = Some(LineFault::NoLowAfterWord);
    for (master, encoder, fault) in [
        (Word::Bits13, repeating(25), no_low),
        (Word::Bits13, silent(25), no_low),
        (Word::Bits25, repeating(13), no_low),
        // A line that stays low after the word is taken for its lower bits: a step of the shaft is
        // 4096 of them, and what jumps further than a shaft turns is a position error.
        (Word::Bits25, silent(13), None),
    ] {
        let shown = shown_within_a_second(Settings::of_word(master), encoder);
        assert_eq!(shown, (true, fault), "{master:?} at {encoder:?}");
    }
    let sound = shown_within_a_second(Settings::of_word(Word::Bits25), repeating(25));
    assert_eq!(sound, (false, None));
}

#[test]
fn the_fault_on_demand_changes_the_length_of_the_word() {
    let mut line = line(Behaviour::of_word(Word::Bits25));
    let settings = Settings::of_word(Word::Bits25);
    let mut now = Instant::ZERO;
    assert_eq!(read(&mut line, &settings, &mut now, 1), Ok(1));
    // 1 in the lowest of 26 bits, where the line is to be low.
    line.encoder_mut().set_fault(Some(Fault::WordLength(26)));
    assert_eq!(read(&mut line, &settings, &mut now, 1), Err(LineFault::NoLowAfterWord));
}
