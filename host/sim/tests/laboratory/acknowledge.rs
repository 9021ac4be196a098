use codewheel_sim::can::{Event, Script};
use codewheel_station::can::Filter;

use super::*;

#[test]
fn a_station_alone_repeats_its_frame_until_somebody_is_there() {
    let mut wire = wire();
    let alone = wire.attach("alone", saying(millis(1), &["42F#00", "42F#01"]), &[], true);
    let lonely = events(&mut wire, Instant::ZERO + Duration::from_secs(3_600));
    assert_eq!(lonely.len(), 16, "then the controller is error-passive and the frame held");
    assert!(lonely.iter().all(|event| matches!(event, Event::Unacknowledged { from, frame, .. }
        if *from == alone && frame.to_string() == "42F#00")));
    assert!(wire.node(alone).unwrap().sent().is_empty());

    let now = wire.now();
    let second = wire.attach("second", Script::new(), &[], true);
    assert_eq!(wire.next_event(), Some(now));
    let together = events(&mut wire, now + Duration::from_millis(1));
    assert_eq!(frames(&together), ["42F#00", "42F#01"], "whatever the filters of the second say");
    assert_eq!(wire.node(alone).unwrap().sent().len(), 2);
    assert!(wire.node(second).unwrap().received().is_empty());
}

#[test]
fn each_try_takes_its_time_on_the_wire() {
    let mut wire = wire();
    wire.attach("alone", saying(millis(0), &["000#"]), &[], true);
    let events = events(&mut wire, millis(100));
    // SOF to CRC of 000# is 34 zeros with a stuff bit behind each fifth; CRC delimiter and empty acknowledge slot; error
    // flag 6, delimiter 8, intermission 3.
    let one_try = (34 + 6 + 2 + 6 + 8 + 3) * 2;
    let ends: Vec<Instant> = events.iter().map(Event::at).collect();
    assert_eq!(ends, (1..=16).map(|count| micros(count * one_try)).collect::<Vec<_>>());
}

#[test]
fn a_frame_held_for_want_of_company_lets_deadlines_pass() {
    let mut wire = wire();
    let alone = wire.attach("alone", saying(millis(1), &["42F#00"]), &[], true);
    events(&mut wire, millis(500));
    wire.node_mut(alone).unwrap().send(millis(600), frame("42F#01"));
    events(&mut wire, millis(1_000));
    assert_eq!(wire.now(), millis(1_000));
    wire.attach("second", Script::new(), &[Filter::ALL], true);
    assert_eq!(frames(&events(&mut wire, millis(1_001))), ["42F#00", "42F#01"]);
}

#[test]
fn the_last_listener_that_leaves_takes_the_acknowledge_with_it() {
    let mut wire = wire();
    let sender = wire.attach("sender", saying(millis(0), &["42F#00"]), &[], true);
    let listener = wire.attach("listener", Script::new(), &[Filter::ALL], true);
    events(&mut wire, micros(50));
    wire.detach(listener);
    let rest = events(&mut wire, millis(100));
    assert!(frames(&rest).is_empty());
    assert!(matches!(rest[0], Event::Unacknowledged { .. }));
    assert!(wire.node(sender).unwrap().sent().is_empty());
}
