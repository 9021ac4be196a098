use super::*;

/// The data line right after each edge of `clocks` clocks of 500 kHz, two letters a clock.
fn waveform(encoder: &mut VirtualEncoder<Disc>, from: Instant, clocks: u64) -> String {
    let mut drawn = String::new();
    let mut draw = |high| drawn.push(if high { '‾' } else { '_' });
    for clock in 0..clocks {
        let falls = from + Duration::from_micros(2 * clock);
        encoder.clock_falls(falls);
        draw(encoder.data_is_high(falls));
        let rises = falls + Duration::from_micros(1);
        encoder.clock_rises(rises);
        draw(encoder.data_is_high(rises));
    }
    drawn
}

/// Four bits, 1011, at a monoflop of 20 µs.
fn four_bits(repeats: bool) -> VirtualEncoder<Disc> {
    let behaviour =
        Behaviour { bits: 4, code: Code::Binary, repeats, ..Behaviour::of_word(Word::Bits13) };
    VirtualEncoder::new(Disc(0b1011), behaviour)
}

#[test]
fn a_bit_appears_at_each_rising_edge_the_highest_first_and_low_after_the_last() {
    let drawn = waveform(&mut four_bits(true), micros(100), 5);
    assert_eq!(drawn, "‾‾ ‾_ _‾ ‾‾ ‾_".replace(' ', ""));
}

#[test]
fn the_line_is_low_until_the_monoflop_has_seen_no_falling_edge_for_its_time() {
    let mut encoder = four_bits(true);
    assert!(encoder.data_is_high(micros(99)), "it rests high");
    waveform(&mut encoder, micros(100), 5);
    assert!(!encoder.data_is_high(micros(127)));
    assert!(encoder.data_is_high(micros(128)), "20 µs after the last falling edge");
}

#[test]
fn clocks_that_go_on_show_the_word_again_or_a_low_line() {
    let repeated = waveform(&mut four_bits(true), micros(100), 11);
    assert_eq!(repeated, "‾‾ ‾_ _‾ ‾‾ ‾_ _‾ ‾_ _‾ ‾‾ ‾_ _‾".replace(' ', ""));
    let low = waveform(&mut four_bits(false), micros(100), 11);
    assert_eq!(low, "‾‾ ‾_ _‾ ‾‾ ‾_ __ __ __ __ __ __".replace(' ', ""));
}

#[test]
fn the_code_is_that_of_the_first_falling_edge_until_the_monoflop_time_is_over() {
    let mut encoder = four_bits(true);
    encoder.clock_falls(micros(100));
    encoder.sensor_mut().0 = 0b0100;
    encoder.clock_rises(micros(101));
    assert!(encoder.data_is_high(micros(101)), "1 of 1011");
    let drawn = waveform(&mut encoder, micros(102), 9);
    assert_eq!(drawn, "‾_ _‾ ‾‾ ‾_ _‾ ‾_ _‾ ‾‾ ‾_".replace(' ', ""));
    // The last falling edge was at 118 µs.
    assert_eq!(waveform(&mut encoder, micros(138), 5), "‾_ _‾ ‾_ __ __".replace(' ', ""));
}

#[test]
fn a_clock_slower_than_the_monoflop_latches_anew_with_each_period() {
    let mut encoder = four_bits(true);
    for clock in 0..8 {
        let falls = micros(100 + 40 * clock);
        assert!(encoder.data_is_high(falls));
        encoder.clock_falls(falls);
        assert!(encoder.data_is_high(falls + Duration::from_micros(19)));
        encoder.clock_rises(falls + Duration::from_micros(20));
        assert!(encoder.data_is_high(falls + Duration::from_micros(39)));
    }
}

#[test]
fn a_word_is_never_longer_than_a_code_nor_shorter_than_a_bit() {
    for (bits, clocks, drawn) in [(0, 2, "‾‾ ‾_"), (1, 2, "‾‾ ‾_"), (255, 2, "‾_ __")]
    {
        let behaviour = Behaviour { bits, code: Code::Binary, ..Behaviour::of_word(Word::Bits13) };
        let mut encoder = VirtualEncoder::new(Disc(1), behaviour);
        assert_eq!(waveform(&mut encoder, micros(100), clocks), drawn.replace(' ', ""), "{bits}");
    }
}
