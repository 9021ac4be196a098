use codewheel_encoder::Reading;

use super::*;

#[test]
fn each_fault_of_the_encoder_is_told_apart() {
    for (fault, seen) in [
        (Fault::Unplugged, LineFault::StuckHigh),
        (Fault::Shorted, LineFault::StuckLow),
        (Fault::NoMonoflop, LineFault::NoLowAfterWord),
    ] {
        for word in WORDS {
            for repeats in [false, true] {
                for code in [0, 1, 4_711, word.geometry().range() - 1] {
                    let settings = Settings::of_word(word);
                    let mut line = line(Behaviour { repeats, ..Behaviour::of_word(word) });
                    let mut now = Instant::ZERO;
                    assert_eq!(read(&mut line, &settings, &mut now, code), Ok(code));
                    line.encoder_mut().set_fault(Some(fault));
                    assert_eq!(line.encoder().fault(), Some(fault));
                    assert_eq!(read(&mut line, &settings, &mut now, code), Err(seen));
                    line.encoder_mut().set_fault(None);
                    assert_eq!(read(&mut line, &settings, &mut now, code), Ok(code));
                }
            }
        }
    }
}

#[test]
fn a_word_of_ones_is_no_broken_wire_and_a_word_of_zeros_no_short() {
    for word in WORDS {
        let behaviour = Behaviour { code: Code::Binary, ..Behaviour::of_word(word) };
        let settings = Settings { code: Code::Binary, ..Settings::of_word(word) };
        let mut line = line(behaviour);
        let mut now = Instant::ZERO;
        for code in [0, word.geometry().range() - 1] {
            assert_eq!(read(&mut line, &settings, &mut now, code), Ok(code));
        }
    }
}

#[test]
fn a_monoflop_longer_than_the_pause_looks_like_a_short() {
    let monoflop = Duration::from_millis(2);
    let mut line = line(Behaviour { monoflop, repeats: false, ..Behaviour::of_word(Word::Bits13) });
    let mut now = Instant::ZERO;
    let settings = Settings::of_word(Word::Bits13);
    assert_eq!(read(&mut line, &settings, &mut now, 1), Ok(1));
    assert_eq!(read(&mut line, &settings, &mut now, 1), Err(LineFault::StuckLow));
}

#[test]
fn a_monoflop_shorter_than_a_clock_looks_like_no_encoder() {
    let monoflop = Duration::from_nanos(900);
    let mut line = line(Behaviour { monoflop, ..Behaviour::of_word(Word::Bits13) });
    let settings = Settings::of_word(Word::Bits13);
    let mut now = Instant::ZERO;
    assert_eq!(read(&mut line, &settings, &mut now, 1), Err(LineFault::StuckHigh));
}

#[test]
fn flipped_bits_that_are_read_once_pass_for_a_code() {
    let mut line = line(Behaviour::of_word(Word::Bits13));
    line.encoder_mut().set_fault(Some(Fault::FlippedBits(1)));
    let settings = Settings::of_word(Word::Bits13);
    let mut now = Instant::ZERO;
    // Gray 0110 with its last bit inverted.
    assert_eq!(read(&mut line, &settings, &mut now, 4), Ok(5));
}

#[test]
fn the_input_says_the_fault_and_keeps_the_last_good_code() {
    let line = line(Behaviour::of_word(Word::Bits29));
    let mut input = Input::new(line, Settings::of_word(Word::Bits29)).unwrap();
    input.line_mut().encoder_mut().sensor_mut().0 = 77;
    assert_eq!(input.sample(millis(1)).code, 77);
    input.line_mut().encoder_mut().set_fault(Some(Fault::Unplugged));
    assert_eq!(input.sample(millis(2)).reading, Reading::Failed(LineFault::StuckHigh));
    assert_eq!(input.sample(micros(2_500)).code, 77);
    assert_eq!(input.sample(micros(2_500)).reading, Reading::Repeated);
}
