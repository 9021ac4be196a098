//! What leads to a bus is lost and comes back: the process lives on, and the station knows.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use codewheel_link::{
    CanPort, Clock, Loop, Notice, Received, Rs485Port, Rs485Received, open, open_rs485,
};
use codewheel_station::can::{BitRate, Frame};
use codewheel_station::rs485::{BaudRate, Transmission};
use common::{Client, Echo, PATIENCE, adapter};

/// Longer than two attempts to come back take.
const LONG: Duration = Duration::from_secs(6);

/// A client of an adapter that vanishes, and where that was.
fn lost(listener: TcpListener, uri: &str) -> (Box<dyn CanPort>, SocketAddr) {
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    let address = listener.local_addr().unwrap();
    drop((listener.accept().unwrap(), listener));
    let notice = told(port.as_mut());
    assert!(matches!(notice, Notice::BusLost { bus, .. } if bus == uri));
    assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(Received::Detached));
    (port, address)
}

/// The next report, which is a notice.
fn told(port: &mut dyn CanPort) -> Notice {
    match port.receive(Some(LONG)).unwrap() {
        Some(Received::Notice(notice)) => notice,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_adapter_that_comes_back_is_opened_again_at_the_same_rate() {
    let (listener, uri) = adapter();
    let (mut port, address) = lost(listener, &uri);
    assert!(!port.is_ready());
    let listener = TcpListener::bind(address).unwrap();
    let start = Instant::now();
    assert_eq!(told(port.as_mut()), Notice::BusBack { bus: uri });
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    assert!(!port.is_ready(), "the station has yet to hear that it was away");
    assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(Received::Attached));
    let mut peer = Client::new(listener.accept().unwrap().0);
    peer.expect("C\rS4\rO\r");
    peer.say("\x07\r\rt42D0\r");
    let poll = Received::Frame(Frame::standard(0x42D, &[]));
    assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(poll));
    assert!(port.send(&Frame::standard(0x3C5, &[1])).unwrap());
    peer.expect("t3C5101\r");
}

#[test]
fn why_it_is_not_back_is_told_once() {
    let (listener, uri) = adapter();
    let (mut port, address) = lost(listener, &uri);
    match told(port.as_mut()) {
        Notice::BusStillLost { reason } => {
            assert!(reason.starts_with(&format!("cannot connect to {address}: ")), "{reason}");
        }
        other => panic!("{other}"),
    }
    assert_eq!(port.receive(Some(Duration::from_millis(1_200))).unwrap(), None);
}

#[test]
fn attempts_stop_with_the_port() {
    let (listener, uri) = adapter();
    let (port, address) = lost(listener, &uri);
    drop(port);
    let listener = TcpListener::bind(address).unwrap();
    listener.set_nonblocking(true).unwrap();
    std::thread::sleep(Duration::from_millis(1_200));
    assert!(listener.accept().is_err(), "somebody still knocks");
}

#[test]
fn a_wait_is_neither_short_nor_long_while_there_is_no_adapter() {
    let (listener, uri) = adapter();
    let (mut port, _) = lost(listener, &uri);
    let wait = Duration::from_millis(100);
    let start = Instant::now();
    assert_eq!(port.receive(Some(wait)).unwrap(), None);
    let took = start.elapsed();
    assert!(took >= wait && took < 2 * wait, "{took:?}");
    assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), None);
}

#[test]
fn a_waker_wakes_before_while_and_after_the_adapter_is_gone() {
    let (listener, uri) = adapter();
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    let waker = port.waker();
    let address = listener.local_addr().unwrap();
    let (peer, _) = listener.accept().unwrap();
    waker.wake();
    waker.wake();
    assert_eq!(port.receive(None).unwrap(), Some(Received::Woken));
    drop((peer, listener));
    assert!(matches!(told(port.as_mut()), Notice::BusLost { .. }));
    assert_eq!(port.receive(None).unwrap(), Some(Received::Detached));
    let late = waker.clone();
    let thread = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(50));
        late.wake();
    });
    assert_eq!(port.receive(None).unwrap(), Some(Received::Woken));
    thread.join().unwrap();
    let _listener = TcpListener::bind(address).unwrap();
    assert!(matches!(told(port.as_mut()), Notice::BusBack { .. }));
    assert_eq!(port.receive(None).unwrap(), Some(Received::Attached));
    waker.wake();
    assert_eq!(port.receive(None).unwrap(), Some(Received::Woken));
    assert_eq!(port.receive(Some(Duration::from_millis(20))).unwrap(), None, "woken once");
}

#[test]
fn a_station_goes_on_after_the_gap_and_what_it_owed_is_not_sent_late() {
    let (listener, uri) = adapter();
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    let address = listener.local_addr().unwrap();
    let mut peer = Client::new(listener.accept().unwrap().0);
    let (mut drive, mut echo) = (Loop::new(Clock::new()), Echo::default());
    let mut until = |echo: &mut Echo, done: &mut dyn FnMut(&Echo, &[Notice]) -> bool| {
        let start = Instant::now();
        let mut notices = Vec::new();
        while !done(echo, &notices) {
            assert!(start.elapsed() < LONG, "{notices:?}");
            let soon = drive.clock().now() + codewheel_station::Duration::from_millis(20);
            notices.extend(drive.turn(echo, port.as_mut(), Some(soon)).unwrap().notices);
        }
    };
    peer.say("\r\r\rt42D0\r");
    until(&mut echo, &mut |echo, _| echo.polls == 1 && !echo.owed);
    peer.expect("C\rS4\rO\rt3C520001\r");
    drop((peer, listener));
    until(&mut echo, &mut |_, told| matches!(told, [Notice::BusLost { .. }, ..]));
    let listener = TcpListener::bind(address).unwrap();
    until(&mut echo, &mut |_, told| told.iter().any(|it| matches!(it, Notice::BusBack { .. })));
    let mut peer = Client::new(listener.accept().unwrap().0);
    peer.say("\x07\r\rt42D0\r");
    until(&mut echo, &mut |echo, _| echo.polls == 2 && !echo.owed);
    // The state of before the gap is there, and the answer to the second poll alone.
    peer.expect("C\rS4\rO\rt3C520002\r");
}

#[test]
fn an_adapter_that_refuses_is_an_error_at_the_start_and_patience_later() {
    let (listener, uri) = adapter();
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    drop(listener.accept().unwrap());
    assert!(matches!(told(port.as_mut()), Notice::BusLost { .. }));
    assert_eq!(port.receive(None).unwrap(), Some(Received::Detached));
    assert!(matches!(told(port.as_mut()), Notice::BusBack { .. }));
    let mut peer = Client::new(listener.accept().unwrap().0);
    peer.say("\r\r\x07");
    assert_eq!(port.receive(None).unwrap(), Some(Received::Attached));
    match told(port.as_mut()) {
        Notice::BusLost { reason, .. } => assert!(reason.contains("refused"), "{reason}"),
        other => panic!("{other}"),
    }
}

#[cfg(unix)]
#[test]
fn a_serial_adapter_that_is_plugged_in_again_is_opened_again() {
    use std::os::unix::fs::symlink;

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ttyACM0");
    let plug = || {
        use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
        let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        unlockpt(&far).unwrap();
        symlink(ptsname(&far, Vec::new()).unwrap().into_string().unwrap(), &path).unwrap();
        std::fs::File::from(far)
    };
    let far = plug();
    let uri = format!("slcan:{}", path.display());
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit250).unwrap();
    drop(far);
    std::fs::remove_file(&path).unwrap();
    assert!(matches!(told(port.as_mut()), Notice::BusLost { .. }));
    assert_eq!(port.receive(None).unwrap(), Some(Received::Detached));
    match told(port.as_mut()) {
        Notice::BusStillLost { reason } => assert!(reason.contains("plug the adapter in")),
        other => panic!("{other}"),
    }
    let mut far = plug();
    assert_eq!(told(port.as_mut()), Notice::BusBack { bus: uri });
    assert_eq!(port.receive(None).unwrap(), Some(Received::Attached));
    let mut octets = [0; 7];
    far.read_exact(&mut octets).unwrap();
    assert_eq!(&octets, b"C\rS5\rO\r");
}

/// A line that vanishes, and where it was.
fn lost_line() -> (Box<dyn Rs485Port>, SocketAddr) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let uri = format!("rs485:{address}");
    let mut port = open_rs485(&uri.parse().unwrap(), BaudRate::Kbit500).unwrap();
    drop((listener.accept().unwrap(), listener));
    match port.receive(Some(PATIENCE)).unwrap() {
        Some(Rs485Received::Notice(Notice::BusLost { bus, .. })) => assert_eq!(bus, uri),
        other => panic!("{other:?}"),
    }
    (port, address)
}

#[test]
fn a_line_that_comes_back_is_joined_again_and_what_was_said_meanwhile_is_gone() {
    let (mut port, address) = lost_line();
    port.send(&Transmission::new(&[0xE5]).unwrap()).unwrap();
    port.set_baud_rate(BaudRate::Mbit12).unwrap();
    let listener = TcpListener::bind(address).unwrap();
    loop {
        match port.receive(Some(LONG)).unwrap() {
            Some(Rs485Received::Notice(Notice::BusBack { .. })) => break,
            Some(Rs485Received::Notice(Notice::BusStillLost { .. })) => {}
            other => panic!("{other:?}"),
        }
    }
    let mut peer: TcpStream = listener.accept().unwrap().0;
    peer.set_read_timeout(Some(PATIENCE)).unwrap();
    port.send(&Transmission::new(&[0x10, 0x16]).unwrap()).unwrap();
    peer.write_all(&[0xDC]).unwrap();
    let mut octets = [0; 2];
    peer.read_exact(&mut octets).unwrap();
    assert_eq!(octets, [0x10, 0x16]);
    let heard = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(heard, Some(Rs485Received::Octets(vec![0xDC])));
}
