//! We are the client: of our own adapter, and of adapters that behave as some do.
#![allow(clippy::unwrap_used)]

mod common;

use std::net::TcpListener;
use std::time::{Duration, Instant};

use codewheel_link::{CanPort, Clock, LinkError, Loop, Notice, Received, open};
use codewheel_station::can::{BitRate, Frame};
use common::{Client, Echo, PATIENCE, Running, adapter, next};

fn connected(listener: &TcpListener, uri: &str) -> (Box<dyn CanPort>, Client) {
    let port = open(&uri.parse().unwrap(), BitRate::Kbit250).unwrap();
    let mut peer = Client::new(listener.accept().unwrap().0);
    peer.expect("C\rS5\rO\r");
    (port, peer)
}

#[test]
fn a_client_polls_an_encoder_through_our_own_adapter() {
    let encoder = Running::listening();
    let uri = format!("slcan:{}", encoder.address.unwrap());
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    assert_eq!(port.describe(), uri);
    let poll = Frame::standard(0x42D, &[]);
    for number in 1..=20_u16 {
        assert!(port.send(&poll).unwrap());
        assert_eq!(next(port.as_mut()), Received::Sent(poll));
        let answer = Frame::standard(0x3C5, &number.to_be_bytes());
        assert_eq!(next(port.as_mut()), Received::Frame(answer));
    }
    assert!(port.confirms());
    drop(port);
    let (_, notices, _) = encoder.stop();
    assert!(!notices.iter().any(|notice| matches!(notice, Notice::OtherBitRate { .. })));
}

#[test]
fn an_encoder_joins_the_bus_of_another_as_client() {
    let first = Running::listening();
    let _second = Running::on(&format!("slcan:{}", first.address.unwrap()));
    let mut master = first.client();
    master.join();
    let start = Instant::now();
    // The second answers as soon as its channel is open.
    while start.elapsed() < PATIENCE {
        master.say("t42D0\r");
        master.expect("z\rt3C52");
        let mut rest = [0; 5 + 10];
        master.stream.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        let both = std::io::Read::read_exact(&mut master.stream, &mut rest).is_ok();
        if both {
            assert_eq!(&rest[5..9], b"t3C5");
            return;
        }
    }
    panic!("the second encoder never answered");
}

#[test]
fn with_an_adapter_that_answers_one_frame_is_on_its_way_at_a_time() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    assert!(!port.confirms());
    let frame = Frame::standard(0x3C5, &[1]);
    assert!(port.send(&frame).unwrap());
    peer.expect("t3C5101\r");
    peer.say("\x07\r\rz\r");
    assert_eq!(next(port.as_mut()), Received::Sent(frame));
    assert!(port.confirms());
    assert!(port.send(&frame).unwrap());
    assert!(!port.is_ready());
    assert!(!port.send(&frame).unwrap());
    // A lone CR confirms as well, and frames of the bus come in between.
    peer.say("t42D0\rT000000421FF1234\r\r");
    assert_eq!(next(port.as_mut()), Received::Frame(Frame::standard(0x42D, &[])));
    assert_eq!(next(port.as_mut()), {
        let identifier = codewheel_station::can::Identifier::Extended(0x42);
        Received::Frame(Frame::new(identifier, &[0xFF]).unwrap())
    });
    assert_eq!(next(port.as_mut()), Received::Sent(frame));
    assert!(port.is_ready());
}

#[test]
fn a_refused_frame_is_tried_once_more_and_then_given_up() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    peer.say("\r\r\r");
    let frame = Frame::standard(0x3C5, &[]);
    assert!(port.send(&frame).unwrap());
    peer.expect("t3C50\r");
    peer.say("\x07");
    let notice = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(notice, Some(Received::Notice(Notice::FrameRefused { frame })));
    peer.expect("t3C50\r");
    peer.say("\x07");
    let notice = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(notice, Some(Received::Notice(Notice::FrameGivenUp { frame })));
    assert_eq!(next(port.as_mut()), Received::Sent(frame));
    assert!(port.is_ready());
    // A second frame that is refused is no news.
    assert!(port.send(&frame).unwrap());
    peer.say("\x07\x07");
    assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(Received::Sent(frame)));
}

#[test]
fn an_adapter_that_refuses_a_command_is_reported_and_one_that_stays_closed_is_an_error() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    peer.say("\x07\x07\x07");
    let notice = port.receive(Some(PATIENCE)).unwrap();
    let command = "S5".to_owned();
    assert_eq!(notice, Some(Received::Notice(Notice::CommandRefused { command })));
    let error = port.receive(Some(PATIENCE)).unwrap_err();
    assert!(matches!(error, LinkError::Refused { .. }), "{error}");
    assert!(!port.send(&Frame::standard(0, &[])).unwrap());
    assert!(port.receive(None).is_err(), "it stays closed");
}

#[test]
fn a_mute_adapter_hangs_nobody() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    let clock = Clock::new();
    let (mut drive, mut echo) = (Loop::new(clock), Echo { owed: true, ..Echo::default() });
    let start = Instant::now();
    while echo.sent.is_empty() {
        drive.turn(&mut echo, port.as_mut(), None).unwrap();
    }
    let took = start.elapsed();
    assert!(took >= Duration::from_millis(100) && took < Duration::from_secs(1), "{took:?}");
    peer.expect("t3C520000\r");
    // An answer that comes after all is not a second report.
    peer.say("z\rt42D0\r");
    while echo.heard.is_empty() {
        drive.turn(&mut echo, port.as_mut(), None).unwrap();
    }
    assert_eq!(echo.sent.len(), 1);
    assert!(port.confirms());
}

#[test]
fn an_adapter_that_falls_silent_is_noticed_and_hangs_nobody() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    let (mut drive, mut echo) = (Loop::new(Clock::new()), Echo { owed: true, ..Echo::default() });
    peer.say("z\r");
    drive.turn(&mut echo, port.as_mut(), Some(drive.clock().now())).unwrap();
    peer.say("z\rt42D0\r");
    let mut notices = Vec::new();
    let start = Instant::now();
    while echo.sent.len() < 2 && start.elapsed() < PATIENCE {
        let outcome = drive.turn(&mut echo, port.as_mut(), None).unwrap();
        notices.extend(outcome.notices);
    }
    assert_eq!(notices, [Notice::AdapterSilent]);
    assert_eq!(echo.sent.len(), 2);
    assert!(port.is_ready());
}

#[test]
fn a_lost_connection_is_said_after_what_had_arrived() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    peer.say("\r\r\rt42D0\rt42");
    drop(peer);
    assert_eq!(next(port.as_mut()), Received::Frame(Frame::standard(0x42D, &[])));
    let reason = "the other side closed it".to_owned();
    let lost = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(lost, Some(Received::Notice(Notice::BusLost { bus: uri, reason })));
    assert_eq!(next(port.as_mut()), Received::Detached);
}

#[test]
fn nobody_listening_is_said_in_plain_words() {
    let (listener, uri) = adapter();
    drop(listener);
    let error = open(&uri.parse().unwrap(), BitRate::Kbit125).err().unwrap().to_string();
    assert!(error.ends_with("connection refused; nothing listens there: start the adapter first"));
}

#[test]
fn garbage_is_told_once() {
    let (listener, uri) = adapter();
    let (mut port, mut peer) = connected(&listener, &uri);
    peer.say("login:\rpassword:\rt42D0\r");
    let notice = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(notice, Some(Received::Notice(Notice::AdapterGarbled)));
    let frame = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(frame, Some(Received::Frame(Frame::standard(0x42D, &[]))));
}
