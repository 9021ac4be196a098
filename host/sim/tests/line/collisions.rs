use super::*;

#[test]
fn the_characters_of_two_that_overlap_are_broken_for_everybody_and_both_are_named() {
    // The second begins in the third character of the first and ends six characters later.
    let begin = bits_after(micros(0), 25);
    let (mut wire, [first, second, listener]) = line([
        ("first", saying(micros(0), ASK_7)),
        ("second", saying(begin, ASK_7)),
        ("listener", listener()),
    ]);
    let seen = events(&mut wire, millis(1));
    let collision = Event::Collision { at: begin, first: "first".into(), second: "second".into() };
    assert!(seen.contains(&collision), "{seen:?}");
    assert_eq!(wire.statistics().collisions, 1);
    // Characters 3 to 6 of the first end after bit 25; 1 to 4 of the second begin before bit 66.
    assert_eq!(broken(wire.node(listener).unwrap()), 8);
    assert_eq!(wire.node(listener).unwrap().octets(), octets("10 07 52 16"));
    assert_eq!(wire.node(second).unwrap().octets(), octets("10 07"), "then it speaks itself");
    assert_eq!(wire.node(first).unwrap().octets(), octets("52 16"), "when it is silent again");
    assert_eq!(wire.statistics().disturbed, 2);
}

#[test]
fn telegrams_that_touch_do_not_collide() {
    let end = bits_after(micros(0), 66);
    let (mut wire, [.., listener]) = line([
        ("first", saying(micros(0), ASK_7)),
        ("second", saying(end, ASK_7)),
        ("listener", listener()),
    ]);
    events(&mut wire, millis(1));
    assert_eq!(wire.statistics().collisions, 0);
    assert_eq!(wire.node(listener).unwrap().octets().len(), 12);
}

#[test]
fn who_hears_telegrams_hears_a_collision_as_broken_characters_too() {
    let mut wire = Wire::new(1);
    wire.attach("first", saying(micros(0), ASK_7), Attachment::default());
    let begin = bits_after(micros(0), 25);
    wire.attach("second", saying(begin, "E5"), Attachment::default());
    let id = wire.attach("listener", listener(), by_telegrams());
    events(&mut wire, millis(1));
    let heard: Vec<&Heard> =
        wire.node(id).unwrap().heard().iter().map(|(_, heard)| heard).collect();
    let octet = |octet| Heard::Octets(vec![octet]);
    let (a, e, f) = (octet(0x10), octet(0x52), octet(0x16));
    let broken = Heard::Broken;
    assert_eq!(heard, [&a, &broken, &broken, &broken, &e, &f], "octets 2 and 3 never come");
}

#[test]
fn two_stations_of_one_address_are_found_when_both_answer() {
    let asked = bits_after(micros(0), 66);
    let answer = bits_after(asked, 11);
    let (mut wire, [master, ..]) = line([
        ("master", saying(micros(0), ASK_7)),
        ("pump", saying(answer, ANSWER_OF_7)),
        ("valve", saying(answer, ANSWER_OF_7)),
    ]);
    let seen = events(&mut wire, millis(1));
    assert_eq!(
        violations(&seen),
        ["valve answers the request to address 7 while pump answers it: each address belongs to \
             one station"]
    );
    assert_eq!(wire.statistics().collisions, 1);
    assert_eq!(wire.node(master).unwrap().octets(), [], "even the same octets destroy each other");
}
