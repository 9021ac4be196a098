use super::*;

/// What a listener at `hears` makes of 200 octets said at `says`.
fn misheard(says: BaudRate, hears: BaudRate, seed: u64) -> Vec<(Instant, Heard)> {
    let mut wire = Wire::new(seed);
    let said = Transmission::new(&[0x55; 200]).unwrap();
    wire.attach("sender", Script::new(says).sending(micros(0), said), Attachment::default());
    let id = wire.attach("listener", Script::new(hears), Attachment::default());
    events(&mut wire, millis(1_000));
    wire.node(id).unwrap().heard().to_vec()
}

#[test]
fn a_station_at_another_rate_hears_mostly_broken_characters_and_some_octets_of_the_seed() {
    let heard = misheard(BaudRate::Kbit500, BaudRate::Mbit1_5, 1);
    assert_eq!(heard.len(), 200, "one for each");
    let broken = heard.iter().filter(|(_, heard)| *heard == Heard::Broken).count();
    assert!((120..180).contains(&broken), "{broken}");
    assert_eq!(heard, misheard(BaudRate::Kbit500, BaudRate::Mbit1_5, 1));
    assert_ne!(heard, misheard(BaudRate::Kbit500, BaudRate::Mbit1_5, 2));
}

#[test]
fn a_slow_station_hears_no_more_characters_than_it_has_time_for() {
    // A character at 500k lasts as long as three at 1.5M.
    let heard = misheard(BaudRate::Mbit1_5, BaudRate::Kbit500, 1);
    assert_eq!(heard.len(), 67);
    assert!(heard.windows(2).all(|pair| pair[1].0 > pair[0].0));
}

#[test]
fn a_station_that_changes_its_rate_hears_what_is_said_at_it_from_then_on() {
    let twice = saying(micros(0), ASK_7).sending(millis(1), telegram(ASK_7));
    let searching = Script::new(BaudRate::Mbit12);
    let (mut wire, [_, listener]) = line([("sender", twice), ("listener", searching)]);
    events(&mut wire, micros(500));
    assert_ne!(wire.node(listener).unwrap().octets(), octets(ASK_7));
    let script = wire.node_mut(listener).unwrap();
    script.take_heard();
    script.set_baud_rate(RATE);
    events(&mut wire, millis(2));
    assert_eq!(wire.node(listener).unwrap().octets(), octets(ASK_7));
    assert_eq!(broken(wire.node(listener).unwrap()), 0);
}

#[test]
fn who_hears_telegrams_mishears_each_character_once_its_rate_is_another() {
    let twice = saying(micros(0), ASK_7).sending(millis(1), telegram(ASK_7));
    let mut wire = Wire::new(1);
    wire.attach("sender", twice, Attachment::default());
    let id = wire.attach("listener", listener(), by_telegrams());
    events(&mut wire, micros(500));
    let script = wire.node_mut(id).unwrap();
    assert_eq!(script.take_heard().len(), 2);
    script.set_baud_rate(BaudRate::Mbit12);
    events(&mut wire, millis(2));
    assert_eq!(wire.node(id).unwrap().heard().len(), 6);
}
