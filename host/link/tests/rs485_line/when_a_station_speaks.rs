//! The loop: an answer leaves when it is due, not before, and not when somebody was faster.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use codewheel_link::{
    Clock, LinkError, Rs485Loop, Rs485Port, Rs485Received, Rs485Tap, Waker, open_rs485,
};
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Duration as Span, Instant as Time, Station};

use crate::bench::{ANSWER, PATIENCE, REQUEST, Running, Slave};

/// A port that gives from a list; what is `None` there is a look that finds nothing.
#[derive(Debug)]
struct Script {
    clock: Clock,
    input: VecDeque<Option<Rs485Received>>,
    /// Given once, at that time.
    later: Option<(Time, Rs485Received)>,
    /// How long it takes to say that nothing came.
    lag: Duration,
    sent: Vec<(Time, Transmission)>,
    rates: Vec<BaudRate>,
    /// The looks since the last sent telegram, and whether each found something.
    looks: Vec<bool>,
}

impl Script {
    fn new(clock: Clock, input: impl IntoIterator<Item = Option<Rs485Received>>) -> Self {
        let input = input.into_iter().collect();
        let (sent, rates, looks) = (Vec::new(), Vec::new(), Vec::new());
        Self { clock, input, later: None, lag: Duration::ZERO, sent, rates, looks }
    }

    fn look(&mut self) -> Option<Rs485Received> {
        let is_later = |(at, _): &mut (Time, Rs485Received)| *at <= self.clock.now();
        if let Some((_, received)) = self.later.take_if(is_later) {
            return Some(received);
        }
        self.input.pop_front().flatten()
    }
}

impl Rs485Port for Script {
    fn send(&mut self, transmission: &Transmission) -> Result<(), LinkError> {
        assert_eq!(self.looks.last(), Some(&false), "sent without a look at the line");
        self.sent.push((self.clock.now(), *transmission));
        Ok(())
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Rs485Received>, LinkError> {
        let end = self.clock.now() + Span::from(wait.expect("a wait without end"));
        loop {
            let received = self.look();
            if received.is_some() || self.clock.now() >= end {
                self.looks.push(received.is_some());
                if received.is_none() {
                    std::thread::sleep(self.lag);
                }
                return Ok(received);
            }
            // Other tests need the processor too.
            let left = Duration::from(end.since(self.clock.now()));
            std::thread::sleep((left / 2).min(Duration::from_micros(500)));
        }
    }

    fn waker(&self) -> Waker {
        unreachable!("nobody wakes it")
    }

    fn has_rate(&self) -> bool {
        true
    }

    fn set_baud_rate(&mut self, rate: BaudRate) -> Result<(), LinkError> {
        self.rates.push(rate);
        Ok(())
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        "script".to_owned()
    }
}

fn octets(octets: &[u8]) -> Option<Rs485Received> {
    Some(Rs485Received::Octets(octets.to_vec()))
}

/// Turns until `span` is over.
fn run<N: Node>(drive: &mut Rs485Loop, station: &mut N, port: &mut dyn Rs485Port, span: Span) {
    let until = drive.clock().now() + span;
    while drive.clock().now() < until {
        drive.turn(station, port, Some(until)).unwrap();
    }
}

#[test]
fn an_answer_leaves_when_t_sdr_is_over_and_never_before() {
    for (rate, t_sdr) in [
        (BaudRate::Mbit12, 11),
        (BaudRate::Mbit1_5, 11),
        (BaudRate::Kbit500, 100),
        (BaudRate::Kbit19_2, 60),
        (BaudRate::Kbit9_6, 11),
    ] {
        let mut drive = Rs485Loop::new(Clock::new());
        let mut slave = Slave::at(rate, t_sdr);
        let mut port = Script::new(drive.clock(), []);
        for number in 0..20 {
            port.input.push_back(octets(&REQUEST));
            while port.sent.len() == number {
                let until = drive.clock().now() + Span::from_secs(1);
                drive.turn(&mut slave, &mut port, Some(until)).unwrap();
            }
        }
        let mut lateness = Vec::new();
        for ((sent, _), (_, due)) in port.sent.iter().zip(&slave.spoke) {
            assert!(sent >= due, "early at {rate}");
            lateness.push(sent.since(*due).as_nanos());
        }
        // A busy machine may hold some of them up; not most.
        lateness.sort_unstable();
        assert!(lateness[5] < 50_000, "{lateness:?} ns late at {rate}");
    }
}

#[test]
fn an_octet_that_comes_before_the_answer_takes_the_word() {
    let mut drive = Rs485Loop::new(Clock::new());
    let mut slave = Slave::at(BaudRate::Kbit9_6, 255);
    let mut port = Script::new(drive.clock(), [octets(&REQUEST)]);
    let soon = drive.clock().now() + Span::from_millis(10);
    port.later = Some((soon, Rs485Received::Octets(vec![0xDC])));
    run(&mut drive, &mut slave, &mut port, Span::from_millis(40));
    assert_eq!((slave.dropped, port.sent.len()), (1, 0));
}

#[test]
fn an_octet_that_lies_there_when_the_answer_is_due_takes_the_word() {
    let mut drive = Rs485Loop::new(Clock::new());
    // Both in one look after the other, and the answer due between them.
    let mut slave = Slave::at(BaudRate::Mbit12, 0);
    let mut port = Script::new(drive.clock(), [octets(&REQUEST), octets(&[0xDC]), None]);
    run(&mut drive, &mut slave, &mut port, Span::from_millis(5));
    assert_eq!((slave.dropped, port.sent.len()), (1, 0));
}

#[test]
fn an_octet_that_comes_while_the_machine_is_busy_takes_the_word() {
    let mut drive = Rs485Loop::new(Clock::new());
    let mut slave = Slave::at(BaudRate::Kbit9_6, 255);
    let mut port = Script::new(drive.clock(), [octets(&REQUEST)]);
    drive.turn(&mut slave, &mut port, Some(Time::ZERO)).unwrap();
    let due = slave.due.unwrap();
    port.later = Some((due + Span::from_millis(1), Rs485Received::Octets(vec![0xDC])));
    // The look before the answer is due ends after the octet came.
    port.lag = Duration::from_millis(5);
    run(&mut drive, &mut slave, &mut port, Span::from_millis(40));
    assert_eq!((slave.dropped, port.sent.len()), (1, 0));
}

#[test]
fn a_look_without_waiting_finds_what_is_there() {
    let listening = "rs485-listen:127.0.0.1:0".parse().unwrap();
    let server = open_rs485(&listening, BaudRate::Mbit12).unwrap();
    let client = format!("rs485:{}", server.local_address().unwrap());
    let mut pairs = vec![(server, client)];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("line");
    if cfg!(unix) {
        let uri = format!("rs485-listen:pty:{}", path.display()).parse().unwrap();
        let pty = open_rs485(&uri, BaudRate::Mbit12).unwrap();
        pairs.push((pty, format!("rs485:{}", path.display())));
    }
    for (mut far, near) in pairs {
        let mut near = open_rs485(&near.parse().unwrap(), BaudRate::Mbit12).unwrap();
        while near.receive(Some(Duration::ZERO)).unwrap().is_some() {}
        while far.receive(Some(Duration::from_millis(20))).unwrap().is_some() {}
        for side in 0..2 {
            let (from, to) = if side == 0 { (&mut near, &mut far) } else { (&mut far, &mut near) };
            from.send(&Transmission::new(&REQUEST).unwrap()).unwrap();
            let start = std::time::Instant::now();
            let mut found = None;
            while found.is_none() && start.elapsed() < PATIENCE {
                found = to.receive(Some(Duration::ZERO)).unwrap();
            }
            assert_eq!(found, octets(&REQUEST), "by {}", to.describe());
        }
    }
}

#[test]
fn a_broken_character_takes_the_word_like_any_other() {
    let mut drive = Rs485Loop::new(Clock::new());
    let mut slave = Slave::at(BaudRate::Mbit12, 0);
    let broken = Some(Rs485Received::BrokenCharacter);
    let mut port = Script::new(drive.clock(), [octets(&REQUEST), broken, octets(&REQUEST)]);
    run(&mut drive, &mut slave, &mut port, Span::from_millis(5));
    assert_eq!((slave.broken, slave.dropped, port.sent.len()), (1, 1, 1));
}

#[test]
fn an_answer_is_late_rather_than_lost() {
    let mut drive = Rs485Loop::new(Clock::new());
    let mut slave = Slave::at(BaudRate::Mbit12, 11);
    let mut port = Script::new(drive.clock(), []);
    slave.handle(drive.clock().now(), Input::Octets(&REQUEST));
    std::thread::sleep(Duration::from_millis(50));
    run(&mut drive, &mut slave, &mut port, Span::from_millis(1));
    assert_eq!(port.sent.len(), 1);
    assert_eq!(port.sent[0].1.octets(), ANSWER);
}

#[test]
fn nobody_speaks_while_the_line_is_not_read_to_its_end() {
    let mut drive = Rs485Loop::new(Clock::new());
    let mut slave = Slave::at(BaudRate::Mbit12, 0);
    let mut port = Script::new(drive.clock(), (0..1_000).map(|_| octets(&REQUEST)));
    let mut turns = 0;
    while !port.input.is_empty() {
        assert_eq!(port.sent.len(), 0);
        drive.turn(&mut slave, &mut port, Some(Time::ZERO)).unwrap();
        turns += 1;
    }
    assert_eq!((turns, slave.heard.len()), (4, 1_000 * REQUEST.len()));
    assert_eq!((slave.dropped, port.sent.len()), (999, 1));
}

#[test]
fn an_idle_station_is_one_turn_however_long() {
    let (folder, path) = (tempfile::tempdir().unwrap(), "line");
    let pty = format!("rs485-listen:pty:{}", folder.path().join(path).display());
    let mut uris = vec!["rs485-listen:127.0.0.1:0".to_owned()];
    uris.extend(cfg!(unix).then_some(pty));
    for uri in uris {
        let mut port = open_rs485(&uri.parse().unwrap(), BaudRate::Mbit12).unwrap();
        let mut drive = Rs485Loop::new(Clock::new());
        let until = drive.clock().now() + Span::from_millis(300);
        let mut turns = 0;
        while drive.clock().now() < until {
            let mut slave = Slave::at(BaudRate::Mbit12, 11);
            drive.turn(&mut slave, port.as_mut(), Some(until)).unwrap();
            turns += 1;
        }
        assert_eq!(turns, 1, "{uri}");
    }
    let slave = Running::listening();
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(slave.stop().2, 1);
}

/// A station that searches for its rate, and whose deadline stays.
#[derive(Debug)]
struct Searching {
    rate: usize,
    due: Time,
    calls: usize,
}

impl Station for Searching {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, _: Time, _: Input<'_>) {
        self.rate = 0;
    }

    fn advance(&mut self, now: Time) {
        self.calls += 1;
        if self.due <= now && self.rate + 1 < BaudRate::ALL.len() {
            self.rate += 1;
            self.due = now + Span::from_millis(5);
        }
    }

    fn transmit(&mut self, _: Time) -> Option<Transmission> {
        None
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.due)
    }
}

impl Node for Searching {
    fn baud_rate(&self) -> BaudRate {
        BaudRate::ALL[self.rate]
    }
}

#[test]
fn the_port_follows_the_rate_of_the_station_and_a_deadline_that_stays_does_not_spin() {
    let mut drive = Rs485Loop::new(Clock::new());
    let mut station =
        Searching { rate: 0, due: drive.clock().now() + Span::from_millis(5), calls: 0 };
    let mut port = Script::new(drive.clock(), []);
    run(&mut drive, &mut station, &mut port, Span::from_millis(200));
    assert_eq!(port.rates, BaudRate::ALL);
    assert!(station.calls < 100, "{} calls", station.calls);
    port.input.push_back(octets(&[0x10]));
    run(&mut drive, &mut station, &mut port, Span::from_millis(1));
    assert_eq!(port.rates.get(10), Some(&BaudRate::ALL[0]));
}

/// A tap that passes on what it sees.
#[derive(Debug)]
struct Told(Sender<(&'static str, Time, Vec<u8>)>);

impl Rs485Tap for Told {
    fn received(&mut self, at: Time, octets: &[u8]) {
        self.0.send(("received", at, octets.to_vec())).unwrap();
    }

    fn broken_character(&mut self, at: Time) {
        self.0.send(("broken", at, Vec::new())).unwrap();
    }

    fn sent(&mut self, at: Time, octets: &[u8]) {
        self.0.send(("sent", at, octets.to_vec())).unwrap();
    }
}

#[test]
fn a_tap_sees_what_comes_and_what_is_sent_at_the_times_of_the_station() {
    let (told, seen) = channel();
    let mut drive = Rs485Loop::new(Clock::new());
    drive.set_tap(Some(Box::new(Told(told))));
    let mut slave = Slave::at(BaudRate::Kbit19_2, 60);
    let (first, rest) = REQUEST.split_at(2);
    let broken = Some(Rs485Received::BrokenCharacter);
    let mut port = Script::new(drive.clock(), [broken, octets(first), octets(rest)]);
    run(&mut drive, &mut slave, &mut port, Span::from_millis(20));
    drive.set_tap(None);
    port.input.push_back(octets(&REQUEST));
    run(&mut drive, &mut slave, &mut port, Span::from_millis(20));
    assert_eq!(port.sent.len(), 2);
    let all: Vec<_> = seen.try_iter().collect();
    let said: Vec<_> = all.iter().map(|(how, _, octets)| (*how, octets.as_slice())).collect();
    let expected: [(&str, &[u8]); 4] =
        [("broken", &[]), ("received", first), ("received", rest), ("sent", &ANSWER)];
    assert_eq!(said, expected);
    assert!(all.is_sorted_by_key(|(_, at, _)| at));
    assert_eq!(all[3].1, slave.spoke[0].0);
}
