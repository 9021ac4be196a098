//! We play the adapter: clients on real sockets share one bus with a station.
#![allow(clippy::unwrap_used)]

mod common;

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use codewheel_link::{Notice, Received, open};
use codewheel_station::can::{BitRate, Frame};
use common::{Client, PATIENCE, Running, next};

#[test]
fn a_poll_is_confirmed_and_answered() {
    let encoder = Running::listening();
    let mut master = encoder.client();
    master.say("\r\rC\rS4\r\rO\rO\r");
    master.expect("\r\r\x07\r\r\r\x07");
    master.say("t42D0\r");
    master.expect("z\rt3C520001\r");
    master.say("t42D0\r");
    master.expect("z\rt3C520002\r");
    let (echo, _, _) = encoder.stop();
    assert_eq!(echo.heard, [Frame::standard(0x42D, &[]); 2]);
    assert_eq!(echo.sent.len(), 2);
}

#[test]
fn clients_and_the_station_share_one_bus_without_echo() {
    let encoder = Running::listening();
    let (mut master, mut watcher) = (encoder.client(), encoder.client());
    let (mut second, mut closed) = (encoder.client(), encoder.client());
    master.join();
    second.join();
    watcher.say("L\r");
    watcher.expect("\r");
    closed.say("S4\r");
    closed.expect("\r");
    master.say("t42D0\r");
    master.expect("z\rt3C520001\r");
    second.expect("t42D0\rt3C520001\r");
    watcher.expect("t42D0\rt3C520001\r");
    second.say("T000000421AB\r");
    second.expect("Z\r");
    master.expect("T000000421AB\r");
    watcher.expect("T000000421AB\r");
    watcher.say("t42D0\r");
    watcher.expect("\x07");
    for client in [&mut master, &mut second, &mut closed] {
        client.expect_nothing();
    }
}

#[test]
fn all_clients_see_the_frames_in_one_order() {
    let encoder = Running::listening();
    let (mut a, mut b) = (encoder.client(), encoder.client());
    let (mut first, mut second) = (encoder.client(), encoder.client());
    for client in [&mut a, &mut b, &mut first, &mut second] {
        client.join();
    }
    for number in 0..100 {
        a.say(&format!("t0012{number:04X}\r"));
        b.say(&format!("t0022{number:04X}\r"));
    }
    let mut seen = [vec![0; 200 * 10], vec![0; 200 * 10]];
    first.stream.read_exact(&mut seen[0]).unwrap();
    second.stream.read_exact(&mut seen[1]).unwrap();
    assert_eq!(seen[0].escape_ascii().to_string(), seen[1].escape_ascii().to_string());
}

#[test]
fn people_hear_who_comes_at_which_rate_and_goes() {
    let mut port = open(&"slcan-listen:127.0.0.1:0".parse().unwrap(), BitRate::Kbit125).unwrap();
    assert_eq!(port.describe(), format!("slcan-listen:{}", port.local_address().unwrap()));
    let mut client = Client::new(TcpStream::connect(port.local_address().unwrap()).unwrap());
    let address = client.stream.local_addr().unwrap();
    client.say("S6\rO\r");
    client.stream.shutdown(Shutdown::Write).unwrap();
    let notices: Vec<_> = (0..4).map(|_| port.receive(Some(PATIENCE)).unwrap().unwrap()).collect();
    assert_eq!(
        notices,
        [
            Notice::ClientConnected { client: address },
            Notice::ClientOpened { client: address, listen_only: false },
            Notice::OtherBitRate {
                client: address.to_string(),
                chosen: 500_000,
                segment: BitRate::Kbit125,
            },
            Notice::ClientLeft { client: address, frames_lost: 0 },
        ]
        .map(Received::Notice)
    );
    // One that only stopped sending still gets its answers.
    client.expect("\r\r");
}

#[test]
fn a_client_that_opens_and_closes_for_ever_is_no_news() {
    let encoder = Running::listening();
    let mut client = encoder.client();
    client.say(&"O\rC\r".repeat(100));
    client.expect(&"\r".repeat(200));
    let (_, notices, _) = encoder.stop();
    assert_eq!(notices.len(), 5, "{notices:?}");
}

#[test]
fn the_adapter_acknowledges_without_clients() {
    let mut port = open(&"slcan-listen:127.0.0.1:0".parse().unwrap(), BitRate::Kbit500).unwrap();
    let frame = Frame::standard(0x42F, &[0; 7]);
    assert!(port.confirms());
    assert!(port.send(&frame).unwrap());
    assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), Some(Received::Sent(frame)));
    assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), None);
}

#[test]
fn a_client_that_vanishes_in_mid_line_is_dropped_quietly() {
    let encoder = Running::listening();
    let mut master = encoder.client();
    master.join();
    let mut vanishing = encoder.client();
    vanishing.join();
    vanishing.say("t42D0\rt42D8001");
    let address = vanishing.stream.local_addr().unwrap();
    drop(vanishing);
    master.expect("t42D0\rt3C520001\r");
    master.say("t42D0\r");
    master.expect("z\rt3C520002\r");
    let (_, notices, _) = encoder.stop();
    assert!(notices.contains(&Notice::ClientLeft { client: address, frames_lost: 0 }));
}

#[test]
fn a_client_that_floods_garbage_stalls_nobody() {
    let encoder = Running::listening();
    let mut flood = encoder.client();
    flood.stream.set_write_timeout(Some(Duration::from_millis(200))).unwrap();
    let mut reading = flood.stream.try_clone().unwrap();
    let drain = std::thread::spawn(move || {
        let mut buffer = [0; 65536];
        while reading.read(&mut buffer).is_ok_and(|count| count > 0) {}
    });
    let garbage = std::thread::spawn(move || {
        let octets: Vec<u8> =
            (0..65536_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(500) && flood.stream.write(&octets).is_ok() {}
        let _ = flood.stream.shutdown(Shutdown::Both);
    });
    let mut master = encoder.client();
    master.join();
    let mut slowest = Duration::ZERO;
    for poll in 1..=50 {
        let start = Instant::now();
        master.say("t42D0\r");
        master.expect(&format!("z\rt3C52{poll:04X}\r"));
        slowest = slowest.max(start.elapsed());
    }
    assert!(slowest < Duration::from_millis(500), "a poll took {slowest:?}");
    garbage.join().unwrap();
    drain.join().unwrap();
    encoder.stop();
}

#[test]
fn a_client_that_never_reads_loses_frames_and_stalls_nobody() {
    let mut port = open(&"slcan-listen:127.0.0.1:0".parse().unwrap(), BitRate::Kbit125).unwrap();
    let address = port.local_address().unwrap();
    let mut deaf = Client::new(TcpStream::connect(address).unwrap());
    let mut reader = Client::new(TcpStream::connect(address).unwrap());
    deaf.say("O\r");
    reader.say("O\r");
    let mut opened = 0;
    while opened < 2 {
        if let Some(Received::Notice(Notice::ClientOpened { .. })) =
            port.receive(Some(PATIENCE)).unwrap()
        {
            opened += 1;
        }
    }
    // Enough to fill every buffer the system has for a socket that nobody reads.
    let fetch = std::thread::spawn(move || {
        let mut buffer = vec![0; 1 << 20];
        let mut total = 0;
        while let Ok(count @ 1..) = reader.stream.read(&mut buffer) {
            total += count;
        }
        total
    });
    let frame = Frame::standard(0x3C5, &[0xAA; 8]);
    let mut too_slow = 0;
    let start = Instant::now();
    for _ in 0..5_000_000 {
        assert!(port.send(&frame).unwrap());
        while let Some(received) = port.receive(Some(Duration::ZERO)).unwrap() {
            let deaf_one = Notice::ClientTooSlow { client: deaf.stream.local_addr().unwrap() };
            too_slow += u32::from(received == Received::Notice(deaf_one));
            if received == Received::Sent(frame) {
                break;
            }
        }
        if too_slow > 0 {
            break;
        }
    }
    assert_eq!(too_slow, 1, "after {:?}", start.elapsed());
    // What is left for the deaf one is whole lines.
    drop(port);
    let mut rest = Vec::new();
    deaf.stream.read_to_end(&mut rest).unwrap_or_default();
    let lines = rest.strip_prefix(b"\r").unwrap();
    assert!(lines.chunks_exact(22).all(|line| line == b"t3C58AAAAAAAAAAAAAAAA\r"));
    assert!(fetch.join().unwrap() > 0);
}

#[test]
fn a_port_that_is_taken_is_said_in_plain_words() {
    let port = open(&"slcan-listen:127.0.0.1:0".parse().unwrap(), BitRate::Kbit125).unwrap();
    let uri = port.describe();
    let error = open(&uri.parse().unwrap(), BitRate::Kbit125).err().unwrap().to_string();
    let address = port.local_address().unwrap();
    assert_eq!(
        error,
        format!(
            "cannot listen on {address}: address already in use; another program holds the port: \
             choose another or stop it"
        )
    );
    drop(port);
    assert!(open(&uri.parse().unwrap(), BitRate::Kbit125).is_ok());
}

#[test]
fn dropping_the_port_closes_every_connection() {
    let mut port = open(&"slcan-listen:127.0.0.1:0".parse().unwrap(), BitRate::Kbit125).unwrap();
    let mut client = Client::new(TcpStream::connect(port.local_address().unwrap()).unwrap());
    client.say("V\r");
    port.receive(Some(PATIENCE)).unwrap();
    port.receive(Some(Duration::from_millis(50))).unwrap();
    client.expect("V1013\r");
    drop(port);
    assert_eq!(client.stream.read(&mut [0; 8]).unwrap(), 0);
}

#[test]
fn a_wake_up_before_the_wait_is_not_lost_and_many_are_one() {
    let mut port = open(&"slcan-listen:127.0.0.1:0".parse().unwrap(), BitRate::Kbit125).unwrap();
    let waker = port.waker();
    waker.wake();
    waker.clone().wake();
    assert_eq!(next(port.as_mut()), Received::Woken);
    assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), None);
    let late = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(20));
        waker.wake();
    });
    assert_eq!(port.receive(None).unwrap(), Some(Received::Woken));
    late.join().unwrap();
}
