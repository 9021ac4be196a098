use super::*;

fn twice(word: Word) -> Settings {
    Settings { double_read: true, ..Settings::of_word(word) }
}

#[test]
fn a_word_that_arrives_the_same_twice_is_taken() {
    for word in WORDS {
        let mut line = line(Behaviour::of_word(word));
        let mut now = Instant::ZERO;
        for code in [0, 1, 4_711, word.geometry().range() - 1] {
            assert_eq!(read(&mut line, &twice(word), &mut now, code), Ok(code));
        }
    }
}

#[test]
fn any_bit_that_flips_in_one_of_the_two_words_is_found() {
    for word in WORDS {
        let mut line = line(Behaviour::of_word(word));
        let mut now = Instant::ZERO;
        for bit in 0..word.bits() {
            line.encoder_mut().set_fault(Some(Fault::FlippedBits(1 << bit)));
            let seen = read(&mut line, &twice(word), &mut now, 4_711);
            assert_eq!(seen, Err(LineFault::Mismatch), "{word:?} bit {bit}");
        }
    }
}

#[test]
fn an_encoder_that_does_not_repeat_its_word_cannot_be_read_twice() {
    let mut line = line(Behaviour { repeats: false, ..Behaviour::of_word(Word::Bits25) });
    let mut now = Instant::ZERO;
    let once = Settings::of_word(Word::Bits25);
    assert_eq!(read(&mut line, &once, &mut now, 4_711), Ok(4_711));
    assert_eq!(read(&mut line, &twice(Word::Bits25), &mut now, 4_711), Err(LineFault::Mismatch));
}

#[test]
fn a_broken_wire_and_a_short_are_named_also_when_read_twice() {
    for (fault, seen) in
        [(Fault::Unplugged, LineFault::StuckHigh), (Fault::Shorted, LineFault::StuckLow)]
    {
        let mut line = line(Behaviour::of_word(Word::Bits29));
        line.encoder_mut().set_fault(Some(fault));
        let mut now = Instant::ZERO;
        assert_eq!(read(&mut line, &twice(Word::Bits29), &mut now, 4_711), Err(seen));
    }
}

#[test]
fn a_wrong_bit_count_is_found_in_nearly_every_double_reading() {
    for (master, bits) in [(Word::Bits13, 25), (Word::Bits25, 13), (Word::Bits29, 25)] {
        let mut line = line(Behaviour { bits, ..Behaviour::of_word(master) });
        let mut now = Instant::ZERO;
        let codes = (0..1_u32 << bits).step_by(1 << (bits - 12));
        let missed = codes.filter(|code| read(&mut line, &twice(master), &mut now, *code).is_ok());
        // Of 4096 codes.
        let missed = missed.count();
        assert!(missed <= 40, "{master:?} at {bits}: {missed}");
    }
}
