//! The loop keeps a station's time and its driver's promises.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use codewheel_link::{CanPort, Clock, LinkError, Loop, Received, STAND_IN, Tap, Waker, open};
use codewheel_station::can::{self, BitRate, Frame};
use codewheel_station::{Duration as Span, Instant as Time, Station};
use common::{Echo, Running};

/// A station that does something at a given time, once.
#[derive(Debug)]
struct Alarm {
    due: Option<Time>,
    rang: Option<Time>,
}

impl Station for Alarm {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _: Time, _: can::Input<'_>) {}

    fn advance(&mut self, now: Time) {
        if self.due.is_some_and(|due| due <= now) {
            self.due = None;
            self.rang = Some(now);
        }
    }

    fn transmit(&mut self, _: Time) -> Option<Frame> {
        None
    }

    fn deadline(&self) -> Option<Time> {
        self.due
    }
}

/// A station whose frame is overdue from the start and that can do nothing about it.
#[derive(Debug, Default)]
struct Overdue {
    calls: u32,
}

impl Station for Overdue {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _: Time, _: can::Input<'_>) {}

    fn advance(&mut self, _: Time) {
        self.calls += 1;
    }

    fn transmit(&mut self, _: Time) -> Option<Frame> {
        Some(Frame::standard(0x42F, &[0; 7]))
    }

    fn deadline(&self) -> Option<Time> {
        Some(Time::ZERO)
    }
}

/// A port that reads from a list.
#[derive(Debug, Default)]
struct Script {
    input: VecDeque<Received>,
    sent: Vec<Frame>,
    /// How many frames it says it is ready for and does not take.
    refusals: u32,
    /// Whether it says that it reports what was sent; the list does.
    confirms: bool,
}

impl CanPort for Script {
    fn is_ready(&self) -> bool {
        true
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        if self.refusals > 0 {
            self.refusals -= 1;
            return Ok(false);
        }
        self.sent.push(*frame);
        Ok(true)
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        let input = self.input.pop_front();
        if input.is_none() {
            std::thread::sleep(wait.expect("a wait without end"));
        }
        Ok(input)
    }

    fn waker(&self) -> Waker {
        unreachable!("nobody wakes it")
    }

    fn confirms(&self) -> bool {
        self.confirms
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        "script".to_owned()
    }
}

/// A tap that passes on what it sees.
#[derive(Debug)]
struct Told(Sender<(&'static str, Frame)>);

impl Tap for Told {
    fn received(&mut self, _: Time, frame: &Frame) {
        self.0.send(("received", *frame)).unwrap();
    }

    fn sent(&mut self, _: Time, frame: &Frame) {
        self.0.send(("sent", *frame)).unwrap();
    }
}

fn ports() -> [Box<dyn CanPort>; 2] {
    ["virtual:turn-alarms", "slcan-listen:127.0.0.1:0"]
        .map(|uri| open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap())
}

#[test]
fn a_deadline_is_met_never_early_and_at_most_a_millisecond_late() {
    for mut port in ports() {
        let mut drive = Loop::new(Clock::new());
        let mut lateness = Vec::new();
        for micros in [300, 1_000, 1_700, 5_250, 20_100] {
            let due = drive.clock().now() + Span::from_micros(micros);
            let mut alarm = Alarm { due: Some(due), rang: None };
            drive.turn(&mut alarm, port.as_mut(), None).unwrap();
            let rang = alarm.rang.expect("one turn is enough");
            assert!(rang >= due);
            lateness.push(rang.since(due).as_nanos());
        }
        // A busy machine may hold any one of them up; not all.
        lateness.sort_unstable();
        assert!(lateness[1] < 1_500_000, "{lateness:?} ns on {}", port.describe());
    }
}

#[test]
fn a_deadline_that_is_past_is_served_at_once() {
    for mut port in ports() {
        let mut drive = Loop::new(Clock::new());
        let mut alarm = Alarm { due: Some(Time::ZERO), rang: None };
        drive.turn(&mut alarm, port.as_mut(), Some(Time::ZERO)).unwrap();
        assert!(alarm.rang.is_some());
    }
}

#[test]
fn an_idle_station_is_one_turn_however_long() {
    for mut port in ports() {
        let mut drive = Loop::new(Clock::new());
        let until = drive.clock().now() + Span::from_millis(300);
        let mut turns = 0;
        while drive.clock().now() < until {
            drive.turn(&mut Echo::default(), port.as_mut(), Some(until)).unwrap();
            turns += 1;
        }
        assert_eq!(turns, 1, "{}", port.describe());
    }
    let encoder = Running::on("virtual:turn-idle");
    std::thread::sleep(Duration::from_millis(100));
    let (_, _, turns) = encoder.stop();
    assert_eq!(turns, 1);
}

#[test]
fn a_frame_counts_as_sent_after_the_stand_in_where_the_port_is_silent() {
    let mut drive = Loop::new(Clock::new());
    let (mut echo, mut port) = (Echo { owed: true, ..Echo::default() }, Script::default());
    let start = drive.clock().now();
    let until = start + STAND_IN - Span::from_millis(50);
    drive.turn(&mut echo, &mut port, Some(until)).unwrap();
    assert_eq!(port.sent.len(), 1);
    assert!(echo.sent.is_empty());
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!(echo.sent, port.sent);
    assert!(drive.clock().now() >= start + STAND_IN);
    // The report that comes after all is not a second one; a report for the next frame is.
    let frame = port.sent[0];
    port.input.push_back(Received::Sent(frame));
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!(echo.sent.len(), 1);
    port.input.push_back(Received::Sent(frame));
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!(echo.sent.len(), 2);
}

#[test]
fn a_frame_the_port_did_not_take_is_offered_again() {
    let mut drive = Loop::new(Clock::new());
    let mut echo = Echo { owed: true, ..Echo::default() };
    let mut port = Script { refusals: 2, ..Script::default() };
    for _ in 0..2 {
        drive.turn(&mut echo, &mut port, Some(Time::ZERO)).unwrap();
    }
    assert_eq!(port.sent, [Frame::standard(0x3C5, &[0, 0])]);
}

#[test]
fn two_polls_in_one_turn_have_two_answers() {
    let mut drive = Loop::new(Clock::new());
    let (mut echo, mut port) = (Echo::default(), Script::default());
    let poll = Received::Frame(Frame::standard(0x42D, &[]));
    port.input.extend([poll.clone(), poll]);
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!(port.sent.len(), 2);
}

#[test]
fn no_input_is_dropped_when_a_turn_has_had_enough() {
    let mut drive = Loop::new(Clock::new());
    let (mut echo, mut port) = (Echo::default(), Script::default());
    for number in 0..1000_u16 {
        port.input.push_back(Received::Frame(Frame::standard(1, &number.to_be_bytes())));
    }
    let mut turns = 0;
    while !port.input.is_empty() {
        drive.turn(&mut echo, &mut port, Some(Time::ZERO)).unwrap();
        turns += 1;
    }
    assert_eq!(turns, 4);
    let heard: Vec<_> = echo.heard.iter().map(|frame| frame.data().to_vec()).collect();
    let all: Vec<_> = (0..1000_u16).map(|number| number.to_be_bytes().to_vec()).collect();
    assert_eq!(heard, all);
}

#[test]
fn a_station_overdue_on_a_bus_that_takes_nothing_does_not_spin() {
    let mut port = open(&"virtual:turn-stuck".parse().unwrap(), BitRate::Kbit125).unwrap();
    let (mut drive, mut station) = (Loop::new(Clock::new()), Overdue::default());
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(100) {
        drive.turn(&mut station, port.as_mut(), None).unwrap();
    }
    assert!(station.calls <= 24, "{} calls", station.calls);
}

#[test]
fn a_tap_sees_what_comes_and_what_is_handed_over_to_a_port_that_does_not_confirm_each_once() {
    let (told, seen) = channel();
    let mut drive = Loop::new(Clock::new());
    drive.set_tap(Some(Box::new(Told(told))));
    let (mut echo, mut port) = (Echo::default(), Script::default());
    let poll = Frame::standard(0x42D, &[]);
    let answer = Frame::standard(0x3C5, &[0, 1]);
    port.input.push_back(Received::Frame(poll));
    drive.turn(&mut echo, &mut port, None).unwrap();
    // A report that comes all the same, and one that comes late.
    for _ in 0..2 {
        port.input.push_back(Received::Sent(answer));
        drive.turn(&mut echo, &mut port, None).unwrap();
        std::thread::sleep(STAND_IN.into());
    }
    let all: Vec<_> = seen.try_iter().collect();
    assert_eq!(all[..2], [("received", poll), ("sent", answer)]);
    // Nothing on its way looks like the second report, so it is another frame.
    assert_eq!(all[2..], [("sent", answer)]);
    drive.set_tap(None);
    port.input.push_back(Received::Frame(poll));
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!(seen.try_iter().count(), 0);
}

#[test]
fn a_tap_sees_a_frame_as_sent_when_a_port_that_confirms_says_so_and_never_one_that_was_lost() {
    let (told, seen) = channel();
    let mut drive = Loop::new(Clock::new());
    drive.set_tap(Some(Box::new(Told(told))));
    let mut echo = Echo { owed: true, ..Echo::default() };
    let mut port = Script { confirms: true, ..Script::default() };
    drive.turn(&mut echo, &mut port, Some(Time::ZERO)).unwrap();
    assert_eq!(port.sent.len(), 1);
    assert_eq!(seen.try_iter().count(), 0, "not yet on the bus");
    port.input.push_back(Received::Sent(port.sent[0]));
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!(seen.try_iter().collect::<Vec<_>>(), [("sent", port.sent[0])]);
    echo.owed = true;
    drive.turn(&mut echo, &mut port, Some(Time::ZERO)).unwrap();
    port.input.extend([Received::BusOff, Received::Recovered]);
    drive.turn(&mut echo, &mut port, None).unwrap();
    assert_eq!((port.sent.len(), seen.try_iter().count()), (2, 0));
}
