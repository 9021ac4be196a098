use codewheel_station::rs485::Input;
use codewheel_station::{Station, earlier};

use super::*;

/// Writes down when it is advanced; its deadlines lie `period` apart.
struct Clock {
    period: Duration,
    next: Instant,
    advanced: Vec<Instant>,
    /// How often it speaks, as often as it may.
    speaks: u32,
}

impl Clock {
    fn every(period: Duration) -> Self {
        Self { period, next: Instant::ZERO + period, advanced: Vec::new(), speaks: 0 }
    }
}

impl Station for Clock {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, _now: Instant, _input: Input<'_>) {}

    fn advance(&mut self, now: Instant) {
        if now >= self.next {
            self.advanced.push(now);
            self.next = now + self.period;
        }
    }

    fn transmit(&mut self, _now: Instant) -> Option<Transmission> {
        self.speaks = self.speaks.checked_sub(1)?;
        Some(telegram(ASK_7))
    }

    fn deadline(&self) -> Option<Instant> {
        Some(self.next)
    }
}

impl Node for Clock {
    fn baud_rate(&self) -> BaudRate {
        RATE
    }
}

#[test]
fn each_station_is_advanced_exactly_at_its_deadlines() {
    let mut wire = Wire::new(1);
    let periods = [7, 11, 13, 17].map(Duration::from_micros);
    let clocks =
        periods.map(|period| wire.attach("clock", Clock::every(period), Attachment::default()));
    events(&mut wire, millis(10));
    for (id, period) in clocks.into_iter().zip(periods) {
        let count = 10_000_000 / period.as_nanos();
        let expected: Vec<_> = (1..=count).map(|n| Instant::ZERO + period.times(n)).collect();
        assert_eq!(wire.node(id).unwrap().advanced, expected);
    }
}

#[test]
fn deadlines_pass_while_a_station_speaks() {
    let mut wire = Wire::new(1);
    let clock = Clock { speaks: u32::MAX, ..Clock::every(Duration::from_micros(10)) };
    let id = wire.attach("clock", clock, Attachment::default());
    events(&mut wire, millis(1));
    let expected: Vec<_> = (1..=100).map(|n| micros(10 * n)).collect();
    assert_eq!(wire.node(id).unwrap().advanced, expected);
}

#[test]
fn a_station_whose_deadline_does_not_move_on_is_named_and_left_alone_until_its_next_input() {
    for period in [0, 1] {
        let mut wire = Wire::new(1);
        let stuck = Clock::every(Duration::from_nanos(period));
        let id = wire.attach("stuck", stuck, Attachment::default());
        let found = violations(&events(&mut wire, millis(1_000_000)));
        assert_eq!(found.len(), 1);
        assert!(
            found[0]
                .starts_with("stuck asks to be called again and again: 1000 turns within 100 µs")
        );
        assert!(wire.node(id).unwrap().advanced.len() < 3_000);
        assert_eq!(wire.next_event(), None);
        let again = Clock { speaks: 1, ..Clock::every(Duration::from_millis(1)) };
        wire.attach("other", again, Attachment::default());
        let found = violations(&events(&mut wire, millis(1_000_001)));
        let stalls = found.iter().filter(|rule| rule.starts_with("stuck")).count();
        assert_eq!(stalls, 6, "once more for each character");
    }
}

/// Two wires whose stations talk for a while.
fn wires() -> [Wire<Script>; 2] {
    [BaudRate::Kbit500, BaudRate::Mbit12].map(|rate| {
        let mut wire = Wire::new(3);
        let talk = (0..50)
            .fold(Script::new(rate), |script, n| script.sending(micros(n * 777), telegram(ASK_7)));
        wire.attach("talk", talk, Attachment::default());
        wire.attach("listener", Script::new(rate), Attachment::default());
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
    let (mut wire, [script]) = line([("script", listener())]);
    events(&mut wire, millis(5));
    assert_eq!(wire.next_event(), None);
    wire.node_mut(script).unwrap().send(millis(0), telegram(ASK_7));
    assert_eq!(wire.next_event(), Some(millis(5)));
    assert_eq!(telegrams(&events(&mut wire, millis(6)))[0].0, millis(5));
    events(&mut wire, millis(1));
    assert_eq!(wire.now(), millis(6), "time does not go back");
}

/// Always has something to say, and has a watchdog behind that.
struct Talker {
    watchdog: Instant,
    bitten: Option<Instant>,
}

impl Station for Talker {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, _now: Instant, _input: Input<'_>) {}

    fn advance(&mut self, now: Instant) {
        if now >= self.watchdog && self.bitten.is_none() {
            self.bitten = Some(now);
        }
    }

    fn transmit(&mut self, _now: Instant) -> Option<Transmission> {
        Transmission::new(&[0; 255])
    }

    fn deadline(&self) -> Option<Instant> {
        Some(Instant::ZERO)
    }
}

impl Node for Talker {
    fn baud_rate(&self) -> BaudRate {
        BaudRate::Kbit9_6
    }
}

#[test]
fn a_deadline_hidden_behind_a_telegram_that_must_wait_is_met_within_a_millisecond() {
    let mut wire = Wire::new(1);
    let talker = Talker { watchdog: millis(100), bitten: None };
    let id = wire.attach("talker", talker, Attachment::default());
    let found = violations(&events(&mut wire, millis(2_000)));
    assert!(found.iter().all(|rule| rule.ends_with("no whole telegram")), "{found:?}");
    let bitten = wire.node(id).unwrap().bitten.unwrap();
    assert!(bitten.since(millis(100)) <= Duration::from_millis(1), "{bitten}");
}
