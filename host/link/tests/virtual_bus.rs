//! Threads on a bus inside the process.
#![allow(clippy::unwrap_used)]

mod common;

use std::time::{Duration, Instant};

use codewheel_link::{CanPort, Notice, Received, open};
use codewheel_station::can::{BitRate, Frame};
use common::{Running, next};

const NOW: Option<Duration> = Some(Duration::ZERO);

fn join(name: &str) -> Box<dyn CanPort> {
    open(&format!("virtual:{name}").parse().unwrap(), BitRate::Kbit125).unwrap()
}

#[test]
fn a_lone_node_is_acknowledged_when_another_joins() {
    let mut lone = join("lone");
    let frame = Frame::standard(0x42F, &[0; 7]);
    assert!(lone.send(&frame).unwrap());
    assert!(!lone.is_ready());
    assert!(!lone.send(&frame).unwrap());
    assert_eq!(lone.receive(NOW).unwrap(), None);
    let mut other = join("lone");
    assert_eq!(other.receive(NOW).unwrap(), Some(Received::Frame(frame)));
    assert_eq!(lone.receive(NOW).unwrap(), Some(Received::Sent(frame)));
    assert!(lone.is_ready());
}

#[test]
fn all_nodes_see_one_order_in_which_their_own_frames_have_a_place() {
    let mut ports = [join("order"), join("order"), join("order")];
    for number in 0..30_u8 {
        assert!(ports[usize::from(number % 3)].send(&Frame::standard(1, &[number])).unwrap());
    }
    for port in &mut ports {
        for number in 0..30_u8 {
            let frame = match port.receive(NOW).unwrap() {
                Some(Received::Frame(frame) | Received::Sent(frame)) => frame,
                other => panic!("{other:?}"),
            };
            assert_eq!(frame.data(), [number]);
        }
        assert_eq!(port.receive(NOW).unwrap(), None);
    }
}

#[test]
fn buses_of_different_names_are_different_and_end_with_their_last_node() {
    let (mut a, mut b) = (join("one"), join("two"));
    a.send(&Frame::standard(1, &[])).unwrap();
    assert_eq!(b.receive(NOW).unwrap(), None);
    let uri = "virtual:one".parse().unwrap();
    let error = open(&uri, BitRate::Kbit500).err().unwrap().to_string();
    assert!(error.starts_with("cannot join virtual:one at 500k: the bus runs at 125k"), "{error}");
    drop(a);
    assert!(open(&uri, BitRate::Kbit500).is_ok());
}

#[test]
fn a_port_that_is_not_asked_loses_the_oldest_frames_and_says_so() {
    let (mut asleep, mut busy) = (join("asleep"), join("asleep"));
    let own = Frame::standard(7, &[]);
    assert!(asleep.send(&own).unwrap());
    for number in 0..2000_u16 {
        assert!(busy.send(&Frame::standard(1, &number.to_be_bytes())).unwrap());
        while busy.receive(NOW).unwrap().is_some() {}
    }
    let lost = asleep.receive(NOW).unwrap();
    assert_eq!(lost, Some(Received::Notice(Notice::FramesLost { count: 977 })));
    assert_eq!(asleep.receive(NOW).unwrap(), Some(Received::Sent(own)));
    let oldest = Frame::standard(1, &977_u16.to_be_bytes());
    assert_eq!(asleep.receive(NOW).unwrap(), Some(Received::Frame(oldest)));
}

#[test]
fn a_station_answers_polls_of_another_thread() {
    let encoder = Running::on("virtual:polls");
    let mut master = join("polls");
    let poll = Frame::standard(0x42D, &[]);
    for number in 1..=100_u16 {
        assert!(master.send(&poll).unwrap());
        assert_eq!(next(master.as_mut()), Received::Sent(poll));
        let answer = Frame::standard(0x3C5, &number.to_be_bytes());
        assert_eq!(next(master.as_mut()), Received::Frame(answer));
    }
    let (echo, _, _) = encoder.stop();
    assert_eq!(echo.sent.len(), 100);
}

#[test]
fn a_wait_ends_with_its_time_or_a_wake_up() {
    let mut port = join("wait");
    let start = Instant::now();
    assert_eq!(port.receive(Some(Duration::from_millis(20))).unwrap(), None);
    assert!(start.elapsed() >= Duration::from_millis(20));
    let waker = port.waker();
    let late = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(20));
        waker.wake();
        waker
    });
    assert_eq!(port.receive(None).unwrap(), Some(Received::Woken));
    let waker = late.join().unwrap();
    drop(port);
    waker.wake();
}
