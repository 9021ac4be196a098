//! Clients that do not read, or that never stop sending.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use codewheel_link::{Clock, Notice, Rs485Loop, Rs485Received, open_rs485};
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Duration as Span, Instant as Time, Station};

use crate::bench::PATIENCE;

#[test]
fn a_client_that_never_reads_loses_octets_and_stalls_nobody() {
    let uri = "rs485-listen:127.0.0.1:0".parse().unwrap();
    let mut port = open_rs485(&uri, BaudRate::Mbit12).unwrap();
    let address = port.local_address().unwrap();
    let mut deaf = TcpStream::connect(address).unwrap();
    let mut reader = TcpStream::connect(address).unwrap();
    for _ in 0..2 {
        let connected = port.receive(Some(PATIENCE)).unwrap();
        assert!(matches!(connected, Some(Rs485Received::Notice(Notice::ClientConnected { .. }))));
    }
    let fetch = std::thread::spawn(move || {
        let mut buffer = vec![0; 1 << 20];
        let mut total = 0;
        while let Ok(count @ 1..) = reader.read(&mut buffer) {
            total += count;
        }
        total
    });
    // Enough to fill every buffer the system has for a socket that nobody reads.
    let telegram: [u8; 255] = std::array::from_fn(|place| place as u8);
    let telegram = Transmission::new(&telegram).unwrap();
    let client = deaf.local_addr().unwrap();
    let mut too_slow = 0;
    for _ in 0..500_000 {
        port.send(&telegram).unwrap();
        while let Some(received) = port.receive(Some(Duration::ZERO)).unwrap() {
            assert_eq!(received, Rs485Received::Notice(Notice::ClientTooSlow { client }));
            too_slow += 1;
        }
        if too_slow > 0 {
            break;
        }
    }
    for _ in 0..1_000 {
        port.send(&telegram).unwrap();
        assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), None, "told twice");
    }
    // What there is for the deaf one is whole telegrams, and it hears what it lost.
    deaf.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut whole = [0; 255];
    for _ in 0..100 {
        deaf.read_exact(&mut whole).unwrap();
        assert_eq!(whole, telegram.octets());
    }
    drop(deaf);
    let left = port.receive(Some(PATIENCE)).unwrap();
    let Some(Rs485Received::Notice(Notice::ClientLeftShort { octets_lost, .. })) = left else {
        panic!("{left:?}");
    };
    assert!(octets_lost > 0 && octets_lost % 255 == 0, "{octets_lost}");
    drop(port);
    assert!(fetch.join().unwrap() > 255 * 1_000);
}

/// Does something every five milliseconds.
#[derive(Debug)]
struct Metronome {
    next: Time,
    beats: usize,
    heard: usize,
    /// Inputs in a row that came after the beat was due and before it was struck.
    overdue: usize,
    most_overdue: usize,
}

const BEAT: Span = Span::from_millis(5);

impl Station for Metronome {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Time, input: Input<'_>) {
        if let Input::Octets(octets) = input {
            self.heard += octets.len();
        }
        self.overdue += usize::from(self.next <= now);
        self.most_overdue = self.most_overdue.max(self.overdue);
    }

    fn advance(&mut self, now: Time) {
        if self.next <= now {
            self.beats += 1;
            self.overdue = 0;
            self.next = now + BEAT;
        }
    }

    fn transmit(&mut self, _: Time) -> Option<Transmission> {
        None
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }
}

impl Node for Metronome {
    fn baud_rate(&self) -> BaudRate {
        BaudRate::Mbit12
    }
}

#[test]
fn deadlines_are_kept_while_octets_flow() {
    let uri = "rs485-listen:127.0.0.1:0".parse().unwrap();
    let mut port = open_rs485(&uri, BaudRate::Mbit12).unwrap();
    let address = port.local_address().unwrap();
    let mut drive = Rs485Loop::new(Clock::new());
    let flood = std::thread::spawn(move || {
        let mut stream = TcpStream::connect(address).unwrap();
        let octets = [0x68; 65_536];
        let start = Instant::now();
        let mut said = 0;
        while start.elapsed() < Duration::from_millis(300) {
            said += stream.write(&octets).unwrap();
        }
        said
    });
    let next = drive.clock().now() + BEAT;
    let mut metronome = Metronome { next, beats: 0, heard: 0, overdue: 0, most_overdue: 0 };
    let until = drive.clock().now() + Span::from_millis(300);
    while drive.clock().now() < until {
        drive.turn(&mut metronome, port.as_mut(), Some(until)).unwrap();
    }
    // What is still under way when the time is over.
    while !flood.is_finished() || {
        let before = metronome.heard;
        let soon = drive.clock().now() + Span::from_millis(20);
        drive.turn(&mut metronome, port.as_mut(), Some(soon)).unwrap();
        metronome.heard > before
    } {
        let now = drive.clock().now();
        drive.turn(&mut metronome, port.as_mut(), Some(now)).unwrap();
    }
    assert_eq!(metronome.heard, flood.join().unwrap(), "octets were lost or invented");
    // How often is up to the machine, which may be busy; that no input comes between is not.
    assert!(metronome.beats > 0);
    assert!(metronome.most_overdue <= 1, "{} inputs while overdue", metronome.most_overdue);
}

#[test]
fn a_flood_does_not_drown_a_wake_up() {
    let uri = "rs485-listen:127.0.0.1:0".parse().unwrap();
    let mut port = open_rs485(&uri, BaudRate::Mbit12).unwrap();
    let mut stream = TcpStream::connect(port.local_address().unwrap()).unwrap();
    stream.write_all(&[0xE5; 60_000]).unwrap();
    port.receive(Some(PATIENCE)).unwrap();
    port.waker().wake();
    port.waker().wake();
    assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(Rs485Received::Woken));
    assert!(matches!(
        port.receive(Some(PATIENCE)).unwrap(),
        Some(Rs485Received::Octets(_) | Rs485Received::Notice(_))
    ));
}
