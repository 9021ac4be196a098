use codewheel_sim::can::{Event, Script};
use codewheel_station::can::Filter;

use super::*;

#[test]
fn a_station_unplugged_in_its_frame_destroys_it() {
    let mut wire = wire();
    let sender = wire.attach("sender", saying(millis(0), &["3C5#0102"]), &[], true);
    let listener = wire.attach("listener", Script::new(), &[Filter::ALL], true);
    wire.attach("third", Script::new(), &[Filter::ALL], true);
    events(&mut wire, micros(60));
    assert!(wire.detach(sender).is_some());
    assert!(wire.detach(sender).is_none());
    let rest = events(&mut wire, millis(10));
    let expected =
        Event::Corrupted { at: micros(60 + 2 * 20), from: sender, frame: frame("3C5#0102") };
    assert_eq!(rest, [expected]);
    assert!(wire.node(listener).unwrap().received().is_empty());
}

#[test]
fn a_station_plugged_in_during_a_frame_does_not_take_it() {
    let mut wire = wire();
    wire.attach("sender", saying(millis(0), &["3C5#01", "3C5#02"]), &[], true);
    wire.attach("listener", Script::new(), &[], true);
    events(&mut wire, micros(60));
    let late = wire.attach("late", Script::new(), &[Filter::ALL], false);
    events(&mut wire, millis(10));
    let heard: Vec<_> =
        wire.node(late).unwrap().received().iter().map(|(_, heard)| *heard).collect();
    assert_eq!(heard, [frame("3C5#02")]);
}

#[test]
fn a_power_cycle_drops_the_frame_that_waited_and_gives_a_new_id() {
    let mut wire = wire();
    wire.attach("loud", saying(millis(0), &["001#"]), &[], true);
    let quiet = wire.attach("quiet", saying(millis(0), &["002#"]), &[], true);
    events(&mut wire, micros(10));
    let script = wire.detach(quiet).unwrap();
    let again = wire.attach("quiet", script, &[], true);
    assert_ne!(quiet, again);
    assert!(wire.node(quiet).is_none());
    assert_eq!(wire.name(again), Some("quiet"));
    assert_eq!(frames(&events(&mut wire, millis(10))), ["001#"]);
    assert_eq!(wire.nodes().count(), 2);
}

#[test]
fn many_power_cycles_leave_nothing_behind() {
    let mut wire = wire();
    wire.attach("talk", Script::new(), &[Filter::ALL], true);
    for cycle in 0..2_000 {
        let at = millis(cycle);
        let id = wire.attach("cycled", saying(at, &["3C5#"]), &[Filter::ALL], true);
        assert_eq!(frames(&events(&mut wire, at + Duration::from_micros(200))), ["3C5#"]);
        wire.detach(id);
        events(&mut wire, millis(cycle + 1));
    }
    assert_eq!(wire.statistics().frames, 2_000);
    assert_eq!(wire.next_event(), None);
}
