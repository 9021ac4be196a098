use super::*;

#[test]
fn all_but_the_sender_hear_each_character_alone() {
    let (mut wire, [sender, first, second]) =
        line([("sender", saying(micros(0), ASK_7)), ("first", listener()), ("second", listener())]);
    events(&mut wire, millis(1));
    assert!(wire.node(sender).unwrap().heard().is_empty());
    for id in [first, second] {
        let heard = wire.node(id).unwrap().heard();
        assert_eq!(heard.len(), 6);
        assert_eq!(wire.node(id).unwrap().octets(), octets(ASK_7));
    }
}

#[test]
fn who_hears_telegrams_hears_the_first_character_and_then_the_rest_at_its_end() {
    let mut wire = Wire::new(1);
    wire.attach("sender", saying(micros(0), ASK_7), Attachment::default());
    let id = wire.attach("listener", listener(), by_telegrams());
    events(&mut wire, millis(1));
    assert_eq!(
        wire.node(id).unwrap().heard(),
        [
            (bits_after(micros(0), 11), Heard::Octets(vec![0x10])),
            (bits_after(micros(0), 66), Heard::Octets(octets("07 02 49 52 16"))),
        ]
    );
}

#[test]
fn a_telegram_of_one_character_comes_once() {
    let mut wire = Wire::new(1);
    wire.attach("sender", saying(micros(0), "E5"), Attachment::default());
    let id = wire.attach("listener", listener(), by_telegrams());
    events(&mut wire, millis(1));
    let end = bits_after(micros(0), 11);
    assert_eq!(wire.node(id).unwrap().heard(), [(end, Heard::Octets(vec![0xE5]))]);
}

#[test]
fn nothing_said_is_nothing() {
    let (mut wire, [_, listener]) =
        line([("sender", saying(micros(0), "")), ("listener", listener())]);
    assert!(events(&mut wire, millis(1)).is_empty());
    assert!(wire.node(listener).unwrap().heard().is_empty());
    assert_eq!(wire.next_event(), None);
}

#[test]
fn a_character_comes_before_a_deadline_of_the_same_moment() {
    // The second station begins at the end of the first one's telegram: it has heard all of it.
    let end = bits_after(micros(0), 66);
    let (mut wire, [_, second]) =
        line([("first", saying(micros(0), ASK_7)), ("second", saying(end, "E5"))]);
    let seen = events(&mut wire, millis(1));
    assert_eq!(wire.statistics().collisions, 0, "{seen:?}");
    assert_eq!(wire.node(second).unwrap().octets(), octets(ASK_7));
}
