use codewheel_sim::can::{Event, Script, Wire, rules};
use codewheel_station::Station;
use codewheel_station::can::{BitRate, Filter, Frame, Input};

use super::*;

#[test]
fn frames_that_devicenet_does_not_have_name_their_sender() {
    let mut wire = wire();
    wire.attach("stranger", saying(millis(0), &["7F0#", "7FF#R0", "00000001#", "7EF#"]), &[], true);
    wire.attach("listener", Script::new(), &[Filter::ALL], true);
    assert_eq!(
        violations(&events(&mut wire, millis(5))),
        [
            "stranger sends 7F0#: the identifiers 7F0 to 7FF are invalid",
            "stranger sends 7FF#R0: DeviceNet has no remote frames",
            "stranger sends 00000001#: DeviceNet has no 29-bit identifiers",
        ]
    );
    assert_eq!(wire.statistics().violations, 3);
}

#[test]
fn a_station_under_a_strange_mac_id_is_named() {
    let mut wire = wire();
    wire.add_rule(rules::source_mac(|name| name.strip_prefix("encoder ")?.parse().ok()));
    wire.attach("encoder 5", saying(millis(0), &["3C5#", "3C7#", "42B#"]), &[], true);
    wire.attach("tool", saying(millis(0), &["433#"]), &[], true);
    assert_eq!(
        violations(&events(&mut wire, millis(5))),
        ["encoder 5 sends 3C7# with the source MAC ID 7, but its own MAC ID is 5",]
    );
}

#[test]
fn a_rule_of_ones_own_sees_every_frame_in_the_order_of_the_wire() {
    let mut wire = wire();
    let mut polled = false;
    wire.add_rule(Box::new(move |frame, _| {
        let text = frame.to_string();
        let answers_unasked = text.starts_with("3C5") && !polled;
        polled = text == "42D#";
        answers_unasked.then(|| "answers without being polled".to_owned())
    }));
    wire.attach("encoder", saying(millis(0), &["3C5#01", "3C5#02"]), &[], true);
    wire.attach("scanner", saying(millis(0), &["42D#"]), &[], true);
    let all = events(&mut wire, millis(5));
    assert_eq!(frames(&all), ["3C5#01", "3C5#02", "42D#"]);
    assert_eq!(violations(&all), ["encoder answers without being polled"; 2]);
}

#[test]
fn two_senders_of_one_identifier_are_both_named_and_destroy_each_other() {
    let mut wire = wire();
    let first = wire.attach("first", saying(millis(0), &["42F#0001"]), &[exactly(0x42F)], true);
    let second = wire.attach("second", saying(millis(0), &["42F#0002"]), &[exactly(0x42F)], true);
    let events = events(&mut wire, millis(50));
    assert_eq!(
        violations(&events),
        [
            "first sends 42F#0001 at the same moment as second sends that identifier: each identifier \
         belongs to one sender",
            "second sends 42F#0002 at the same moment as first sends that identifier: each identifier \
         belongs to one sender",
        ]
    );
    // Sixteen tries until both are error-passive, then the more dominant frame gets through.
    assert_eq!(wire.statistics().corrupted, 16);
    assert_eq!(frames(&events), ["42F#0001", "42F#0002"]);
    let heard = |id| wire.node(id).unwrap().received().len();
    assert_eq!((heard(first), heard(second)), (1, 1), "each meets its double");
}

#[test]
fn two_senders_of_one_and_the_same_frame_do_not_notice_each_other() {
    let mut wire = wire();
    let first = wire.attach("first", saying(millis(0), &["42D#"]), &[], true);
    let second = wire.attach("second", saying(millis(0), &["42D#"]), &[], true);
    let alone = events(&mut wire, millis(50));
    assert!(frames(&alone).is_empty(), "neither acknowledges");
    assert_eq!(violations(&alone).len(), 2);
    wire.attach("third", Script::new(), &[], false);
    assert_eq!(frames(&events(&mut wire, millis(60))), ["42D#"]);
    for id in [first, second] {
        assert_eq!(wire.node(id).unwrap().sent().len(), 1);
    }
}

/// Its deadline has always just passed, and it never has anything to send.
struct Stuck {
    calls: u32,
    creeps: bool,
    at: Instant,
}

impl Station for Stuck {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _now: Instant, _input: Input<'_>) {}

    fn advance(&mut self, now: Instant) {
        self.calls += 1;
        if self.creeps {
            self.at = now + Duration::from_nanos(1);
        }
    }

    fn transmit(&mut self, _now: Instant) -> Option<Frame> {
        None
    }

    fn deadline(&self) -> Option<Instant> {
        Some(self.at)
    }
}

#[test]
fn a_station_whose_deadline_does_not_move_on_is_named_and_does_not_hang_the_wire() {
    for creeps in [false, true] {
        let mut wire = Wire::new(BitRate::Kbit500, 1);
        let at = Instant::ZERO;
        let id = wire.attach("stuck", Stuck { calls: 0, creeps, at }, &[Filter::ALL], true);
        let events = events(&mut wire, Instant::ZERO + Duration::from_secs(1_000_000));
        let expected = "stuck asks to be called again and again: 1000 turns within one bit";
        assert_eq!(violations(&events).len(), 1);
        assert!(violations(&events)[0].starts_with(expected));
        assert!(wire.node(id).unwrap().calls < 3_000);
        assert_eq!(wire.next_event(), None);
    }
}

#[test]
fn a_stuck_station_is_asked_again_after_its_next_input() {
    use codewheel_sim::can::Either;
    let mut wire: Wire<Either<Stuck, Script>> = Wire::new(BitRate::Kbit500, 1);
    let stuck = Stuck { calls: 0, creeps: false, at: Instant::ZERO };
    wire.attach("stuck", Either::Left(stuck), &[Filter::ALL], true);
    wire.attach("other", Either::Right(saying(millis(5), &["3C5#"])), &[], true);
    let all = events(&mut wire, millis(10));
    assert_eq!(frames(&all), ["3C5#"]);
    let stalls: Vec<Instant> = all
        .iter()
        .filter(|event| matches!(event, Event::Violation { .. }))
        .map(Event::at)
        .collect();
    assert_eq!(stalls.len(), 2);
    assert!(stalls[1] >= millis(5));
}

#[test]
fn a_wire_without_exactly_two_terminators_says_so() {
    let mut wire = wire();
    assert_eq!(
        wire.warnings(),
        ["the wire has no terminating resistor; it needs two, one at each end"]
    );
    wire.attach("a", Script::new(), &[], true);
    assert_eq!(
        wire.warnings(),
        ["the wire has only one terminating resistor, at a; it needs two, one at each end"]
    );
    let b = wire.attach("b", Script::new(), &[], true);
    assert!(wire.warnings().is_empty());
    wire.attach("c", Script::new(), &[], true);
    assert_eq!(
        wire.warnings(),
        ["the wire has 3 terminating resistors, at a, b, c; it needs two, one at each end"]
    );
    wire.set_terminated(b, false);
    assert!(wire.warnings().is_empty());
}
