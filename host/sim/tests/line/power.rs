use codewheel_station::Station;

use super::*;

#[test]
fn a_power_cut_breaks_a_telegram_off_in_its_character() {
    let (mut wire, [sender, ears]) =
        line([("sender", saying(micros(0), ASK_7)), ("ears", listener())]);
    events(&mut wire, bits_after(micros(0), 25));
    wire.detach(sender).unwrap();
    let rest = events(&mut wire, millis(1));
    assert_eq!(wire.node(ears).unwrap().octets(), octets("10 07"));
    assert_eq!(broken(wire.node(ears).unwrap()), 1);
    assert_eq!(wire.node(ears).unwrap().heard().len(), 3);
    let end = bits_after(micros(0), 33);
    assert!(
        matches!(rest.last(), Some(Event::Telegram { end: at, intact: false, .. }) if *at == end)
    );
    assert_eq!(wire.next_event(), None);
}

#[test]
fn a_station_switched_on_in_the_middle_of_a_telegram_hears_from_the_next_character_on() {
    for attachment in [Attachment::default(), by_telegrams()] {
        let both = saying(micros(0), ASK_7).sending(micros(500), telegram("DC 02 02"));
        let (mut wire, _) = line([("sender", both)]);
        events(&mut wire, bits_after(micros(0), 25));
        let late = wire.attach("late", listener(), attachment);
        events(&mut wire, micros(400));
        let heard = wire.node_mut(late).unwrap().take_heard();
        // Who hears telegrams hears of this one nothing: its portion began without it.
        let expected = if attachment == by_telegrams() { 0 } else { 3 };
        assert_eq!(heard.len(), expected);
        events(&mut wire, millis(1));
        assert_eq!(wire.node(late).unwrap().octets(), octets("DC 02 02"));
    }
}

#[test]
fn a_station_that_is_gone_is_not_mistaken_for_its_successor() {
    let (mut wire, [first]) = line([("first", saying(millis(5), ASK_7))]);
    let script = wire.detach(first).unwrap();
    assert_eq!(script.deadline(), Some(millis(5)));
    assert_eq!(wire.next_event(), None);
    let second = wire.attach("second", listener(), Attachment::default());
    assert_ne!(first, second);
    assert!(wire.node(first).is_none() && wire.detach(first).is_none());
    assert_eq!(wire.name(second), Some("second"));
    assert_eq!(wire.nodes().map(|(id, _)| id).collect::<Vec<_>>(), [second]);
}

#[test]
fn a_successor_in_the_place_of_a_speaker_may_speak_at_once() {
    let (mut wire, [first]) = line([("first", saying(micros(0), ASK_7))]);
    let cut = bits_after(micros(0), 25);
    events(&mut wire, cut);
    wire.detach(first);
    wire.attach("second", saying(cut, "E5"), Attachment::default());
    let seen = events(&mut wire, millis(1));
    assert_eq!(telegrams(&seen).last().unwrap().0, cut);
    let (first, second) = ("a station that lost its power".to_owned(), "second".to_owned());
    assert!(seen.contains(&Event::Collision { at: cut, first, second }), "{seen:?}");
}
