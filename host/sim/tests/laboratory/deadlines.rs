use codewheel_sim::can::{Event, Script, Wire};
use codewheel_station::can::{BitRate, Filter, Frame, Input};
use codewheel_station::{Station, earlier};

use super::*;

/// Writes down when it is advanced; its deadlines lie `period` apart.
struct Clock {
    period: Duration,
    next: Instant,
    advanced: Vec<Instant>,
}

impl Clock {
    fn every(period: Duration) -> Self {
        Self { period, next: Instant::ZERO + period, advanced: Vec::new() }
    }
}

impl Station for Clock {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _now: Instant, _input: Input<'_>) {}

    fn advance(&mut self, now: Instant) {
        if now >= self.next {
            self.advanced.push(now);
            self.next += self.period;
        }
    }

    fn transmit(&mut self, _now: Instant) -> Option<Frame> {
        None
    }

    fn deadline(&self) -> Option<Instant> {
        Some(self.next)
    }
}

#[test]
fn each_station_is_advanced_exactly_at_its_deadlines() {
    let mut wire = Wire::new(BitRate::Kbit125, 1);
    let periods = [7, 11, 13, 17].map(Duration::from_micros);
    let clocks = periods.map(|period| wire.attach("clock", Clock::every(period), &[], false));
    events(&mut wire, millis(10));
    for (id, period) in clocks.into_iter().zip(periods) {
        let count = 10_000_000 / period.as_nanos();
        let expected: Vec<_> = (1..=count).map(|n| Instant::ZERO + period.times(n)).collect();
        assert_eq!(wire.node(id).unwrap().advanced, expected);
    }
}

/// Two wires whose stations talk for a while.
fn wires() -> [Wire<Script>; 2] {
    [BitRate::Kbit125, BitRate::Kbit500].map(|rate| {
        let mut wire = Wire::new(rate, 3);
        let talk = (0..50).fold(Script::new(), |script, n| {
            script.sending(micros(n * 777), frame(&format!("3C5#{n:02X}")))
        });
        wire.attach("talk", talk, &[], true);
        wire.attach("listener", Script::new(), &[Filter::ALL], true);
        wire
    })
}

#[test]
fn wires_that_run_from_event_to_event_together_run_as_each_does_alone() {
    let mut alone = wires();
    let expected = alone.each_mut().map(|wire| events(wire, millis(60)));

    let mut together = wires();
    let mut seen: [Vec<Event>; 2] = Default::default();
    let mut last = None;
    while let Some(next) =
        together.iter().fold(None, |least, wire| earlier(least, wire.next_event()))
    {
        assert!(last < Some(next), "time moves on with every turn");
        last = Some(next);
        for (wire, seen) in together.iter_mut().zip(&mut seen) {
            wire.run_until(next, &mut |event| seen.push(event.clone()));
            assert_eq!(wire.now(), next);
        }
    }
    assert_eq!(seen, expected);
}

#[test]
fn a_station_that_is_changed_is_asked_anew_at_once() {
    let mut wire = wire();
    let script = wire.attach("script", Script::new(), &[], true);
    wire.attach("listener", Script::new(), &[Filter::ALL], true);
    events(&mut wire, millis(5));
    assert_eq!(wire.next_event(), None);
    wire.node_mut(script).unwrap().send(millis(0), frame("3C5#"));
    assert_eq!(wire.next_event(), Some(millis(5)));
    assert_eq!(frames(&events(&mut wire, millis(6))), ["3C5#"]);
}

#[test]
fn time_does_not_go_back() {
    let mut wire = wire();
    events(&mut wire, millis(5));
    events(&mut wire, millis(1));
    assert_eq!(wire.now(), millis(5));
}

/// Wants to send and has a watchdog behind that wish.
struct Blocked {
    watchdog: Instant,
    bitten: Option<Instant>,
}

impl Station for Blocked {
    type Input<'a> = Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _now: Instant, _input: Input<'_>) {}

    fn advance(&mut self, now: Instant) {
        if now >= self.watchdog && self.bitten.is_none() {
            self.bitten = Some(now);
        }
    }

    fn transmit(&mut self, _now: Instant) -> Option<Frame> {
        Some(Frame::standard(0x3C5, &[]))
    }

    fn deadline(&self) -> Option<Instant> {
        Some(Instant::ZERO)
    }
}

#[test]
fn a_deadline_hidden_behind_a_frame_that_cannot_go_out_is_met_within_a_millisecond() {
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let blocked = Blocked { watchdog: millis(100), bitten: None };
    let id = wire.attach("blocked", blocked, &[], true);
    let events = events(&mut wire, millis(200));
    assert!(violations(&events).is_empty());
    let bitten = wire.node(id).unwrap().bitten.unwrap();
    assert!(bitten.since(millis(100)) <= Duration::from_millis(1), "{bitten}");
}
