use super::*;

/// The end of bit `count`, exact and rounded up: what no sum of rounded characters may miss.
fn end_of_bit(rate: BaudRate, count: u64) -> u64 {
    (count * 1_000_000_000).div_ceil(u64::from(rate.bits_per_second()))
}

#[test]
fn each_character_ends_at_its_bit_at_every_rate() {
    for rate in BaudRate::ALL {
        let longest: Vec<u8> = (0..=254).collect();
        let mut wire = Wire::new(1);
        let begin = Instant::from_nanos(1_234_567);
        let said = Transmission::new(&longest).unwrap();
        wire.attach("sender", Script::new(rate).sending(begin, said), Attachment::default());
        let listener = wire.attach("listener", Script::new(rate), Attachment::default());
        let events = events(&mut wire, millis(1_000));
        let heard = wire.node(listener).unwrap().heard();
        assert_eq!(heard.len(), 255);
        for ((at, heard), place) in heard.iter().zip(0..=254) {
            let end = begin.as_nanos() + end_of_bit(rate, 11 * (u64::from(place) + 1));
            assert_eq!((at.as_nanos(), heard), (end, &Heard::Octets(vec![place])), "{rate}");
        }
        let &(first, last, _) = telegrams(&events).first().unwrap();
        assert_eq!(first, begin);
        assert_eq!(last.as_nanos(), begin.as_nanos() + end_of_bit(rate, 11 * 255));
    }
}

#[test]
fn a_telegram_begins_at_the_moment_it_is_handed_out() {
    let at = Instant::from_nanos(77_777);
    let (mut wire, _) = line([("sender", saying(at, ASK_7))]);
    let seen = events(&mut wire, millis(1));
    assert_eq!(telegrams(&seen), [(at, bits_after(at, 66), ASK_7.to_owned())]);
}

#[test]
fn what_falls_due_while_a_station_speaks_follows_without_a_pause() {
    let both = saying(micros(10), "E5").sending(micros(10), telegram("DC 02 02"));
    let (mut wire, _) = line([("sender", both)]);
    let seen = telegrams(&events(&mut wire, millis(1)));
    assert_eq!(seen[1].0, seen[0].1);
}

#[test]
fn the_line_is_busy_exactly_while_somebody_speaks() {
    let (mut wire, _) = line([
        ("one", saying(micros(0), ASK_7)),
        ("two", saying(bits_after(micros(0), 33), ASK_7)),
        ("three", saying(micros(500), ASK_7)),
    ]);
    events(&mut wire, micros(500));
    let silent = wire.statistics();
    assert_eq!(silent.busy, RATE.bits(33) + RATE.bits(66), "two of them overlap");
    let middle = micros(500) + RATE.bits(30);
    events(&mut wire, middle);
    assert_eq!(wire.statistics().busy, silent.busy + RATE.bits(30));
    assert!((wire.statistics().bus_load_since(&silent) - 1.0).abs() < 1e-9);
    events(&mut wire, micros(500) + RATE.bits(660));
    assert!((wire.statistics().bus_load_since(&silent) - 0.1).abs() < 1e-3);
    assert_eq!(wire.statistics().bus_load_since(&wire.statistics()), 0.0);
}
