use codewheel_sim::can::{Event, Faults, Script};
use codewheel_station::can::{Filter, Input};
use codewheel_station::{Instant, Station};

use super::*;

/// A script that writes down when its controller left and came back.
#[derive(Default)]
struct Witness {
    script: Script,
    told: Vec<(Instant, &'static str)>,
}

impl Station for Witness {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: Input<'_>) {
        match input {
            Input::BusOff => self.told.push((now, "bus-off")),
            Input::Recovered => self.told.push((now, "recovered")),
            Input::Detached | Input::Attached => {}
            _ => self.script.handle(now, input),
        }
    }

    fn advance(&mut self, now: Instant) {
        self.script.advance(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        self.script.transmit(now)
    }

    fn deadline(&self) -> Option<Instant> {
        self.script.deadline()
    }
}

fn witness(at: Instant, texts: &[&str]) -> Witness {
    Witness { script: saying(at, texts), told: Vec::new() }
}

#[test]
fn a_bus_off_station_is_deaf_and_mute_until_128_times_11_recessive_bits() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let off = wire.attach("off", witness(millis(2), &["001#"]), &[Filter::ALL], true);
    wire.attach("talker", witness(millis(2), &["002#"]), &[], true);
    wire.attach("third", Witness::default(), &[], false);
    events(&mut wire, millis(1));
    wire.bus_off(off, &mut |_| {});
    wire.bus_off(off, &mut |_| panic!("it is off already"));
    assert!(wire.is_bus_off(off));
    let seen = events(&mut wire, millis(10));
    assert_eq!(frames(&seen), ["002#", "001#"], "the lower identifier waits for its controller");
    let node = wire.node(off).unwrap();
    assert!(node.script.received().is_empty());
    // 500 idle bits are 45 sequences, and what is left of them counts for nothing; the frame of 2
    // brings one, and 82 are missing when it is over.
    let frame_bits = u64::from(codewheel_sim::can::frame_bits(&frame("002#")));
    let back = micros(2_000 + 2 * (frame_bits + 82 * 11));
    assert_eq!(node.told, [(millis(1), "bus-off"), (back, "recovered")]);
    assert!(!wire.is_bus_off(off));
    assert_eq!(wire.statistics().bus_offs, 1);
}

#[test]
fn a_station_that_leaves_in_its_own_frame_destroys_it_and_forgets_it() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let sender = wire.attach("sender", witness(millis(0), &["3C5#0102"]), &[], true);
    let listener = wire.attach("listener", Witness::default(), &[Filter::ALL], true);
    wire.attach("third", Witness::default(), &[], false);
    events(&mut wire, micros(60));
    let mut seen = Vec::new();
    wire.bus_off(sender, &mut |event| seen.push(event.clone()));
    assert_eq!(seen, [Event::BusOff { at: micros(60), station: sender }]);
    let rest = events(&mut wire, millis(10));
    assert!(matches!(rest[0], Event::Corrupted { .. }), "{rest:?}");
    assert!(frames(&rest).is_empty(), "what was handed to the controller is gone");
    assert!(wire.node(listener).unwrap().script.received().is_empty());
}

#[test]
fn whoever_is_left_alone_by_a_bus_off_gets_no_acknowledge_until_it_is_over() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let sender = wire.attach("sender", witness(millis(1), &["42F#00"]), &[], true);
    let other = wire.attach("other", Witness::default(), &[Filter::ALL], true);
    wire.bus_off(other, &mut |_| {});
    let seen = events(&mut wire, millis(20));
    assert!(seen.iter().any(|event| matches!(event, Event::Unacknowledged { .. })));
    assert_eq!(frames(&seen), ["42F#00"]);
    assert_eq!(wire.node(sender).unwrap().script.sent().len(), 1);
    let place = |wanted: fn(&Event) -> bool| seen.iter().position(wanted);
    let recovered = place(|event| matches!(event, Event::Recovered { .. }));
    assert!(recovered < place(|event| matches!(event, Event::Frame { .. })));
}

#[test]
fn a_bad_transceiver_takes_its_station_off_the_bus_after_32_frames_and_no_other() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let bad = wire.attach("bad", witness(millis(0), &["001#"]), &[Filter::ALL], true);
    let good = wire.attach("good", witness(millis(0), &["002#", "003#"]), &[Filter::ALL], true);
    wire.attach("third", Witness::default(), &[], false);
    wire.set_corruption_at(bad, Some(1.0));
    let seen = events(&mut wire, millis(3));
    let destroyed = seen.iter().filter(|event| matches!(event, Event::Corrupted { .. })).count();
    assert_eq!(destroyed, 32);
    assert_eq!(frames(&seen), ["002#", "003#"]);
    assert_eq!(wire.node(bad).unwrap().told.len(), 1);
    assert!(wire.node(good).unwrap().told.is_empty());
    wire.set_corruption_at(bad, None);
    events(&mut wire, millis(20));
    wire.node_mut(bad).unwrap().script.send(millis(20), frame("004#"));
    assert_eq!(frames(&events(&mut wire, millis(21))), ["004#"]);
}

#[test]
fn the_noise_of_the_whole_wire_takes_nobody_off_the_bus() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    wire.attach("sender", witness(millis(0), &["3C5#"]), &[], true);
    wire.attach("listener", Witness::default(), &[], true);
    wire.set_faults(Faults { loss: 0.0, corruption: 1.0 });
    events(&mut wire, millis(1_000));
    assert!(wire.statistics().corrupted > 1_000);
    assert_eq!(wire.statistics().bus_offs, 0);
}

#[test]
fn an_unplugged_bus_off_station_does_not_come_back() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let off = wire.attach("off", Witness::default(), &[], true);
    wire.attach("a", witness(millis(5), &["001#"]), &[], true);
    wire.attach("b", Witness::default(), &[], true);
    wire.bus_off(off, &mut |_| {});
    assert!(wire.detach(off).is_some());
    assert!(!wire.is_bus_off(off));
    let seen = events(&mut wire, millis(10));
    assert_eq!(seen.len(), 1, "{seen:?}");
    assert_eq!(frames(&seen), ["001#"]);
}
