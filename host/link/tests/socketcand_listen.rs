//! We play the socketcand server: clients on real sockets share one bus with a station.
#![allow(clippy::unwrap_used)]

mod common;

use std::net::TcpStream;
use std::time::Duration;

use codewheel_link::{Notice, Received, open};
use codewheel_station::can::{BitRate, Frame};
use common::{Client, PATIENCE, Running, next};

const LISTEN: &str = "socketcand-listen:127.0.0.1:0";

/// A client that sees every frame.
fn raw(encoder: &Running) -> Client {
    let mut client = encoder.client();
    client.expect("< hi >");
    client.say("< open can0 >");
    client.expect("< ok >");
    client.say("< rawmode >");
    client.expect("< ok >");
    client
}

/// Expects a frame, whatever its time.
fn expect_frame(client: &mut Client, identifier: &str, data: &str) {
    client.expect(&format!("< frame {identifier} "));
    client.skip_to(b' ');
    client.expect(&format!("{data} >"));
}

#[test]
fn a_poll_is_answered() {
    let encoder = Running::on(LISTEN);
    let mut master = raw(&encoder);
    for poll in ["0001", "0002"] {
        master.say("< send 42D 0  >");
        expect_frame(&mut master, "3C5", poll);
    }
    let (echo, _, _) = encoder.stop();
    assert_eq!(echo.heard, [Frame::standard(0x42D, &[]); 2]);
    assert_eq!(echo.sent.len(), 2);
}

#[test]
fn clients_and_the_station_share_one_bus_without_echo() {
    let encoder = Running::on(LISTEN);
    let (mut master, mut watcher) = (raw(&encoder), raw(&encoder));
    let mut outside = encoder.client();
    outside.expect("< hi >");
    outside.say("< open can0 >");
    outside.expect("< ok >");
    master.say("< send 42D 0 >");
    expect_frame(&mut master, "3C5", "0001");
    expect_frame(&mut watcher, "42D", "");
    expect_frame(&mut watcher, "3C5", "0001");
    watcher.say("< send 00000421 1 AB >");
    expect_frame(&mut master, "00000421", "AB");
    for client in [&mut master, &mut watcher, &mut outside] {
        client.say("< echo >");
        client.expect("< echo >");
        client.expect_nothing();
    }
}

#[test]
fn people_hear_who_comes_and_goes() {
    let mut port = open(&LISTEN.parse().unwrap(), BitRate::Kbit125).unwrap();
    let address = port.local_address().unwrap();
    assert_eq!(port.describe(), format!("socketcand-listen:{address}"));
    assert!(port.confirms());
    let mut client = Client::new(TcpStream::connect(address).unwrap());
    let from = client.stream.local_addr().unwrap();
    client.say("< open can0 >");
    let mut told = || port.receive(Some(PATIENCE)).unwrap().unwrap();
    assert_eq!(told(), Received::Notice(Notice::ClientConnected { client: from }));
    let opened = Notice::ClientOpened { client: from, listen_only: false };
    assert_eq!(told(), Received::Notice(opened));
    drop(client);
    let left = Notice::ClientLeft { client: from, frames_lost: 0 };
    assert_eq!(told(), Received::Notice(left));
}

#[test]
fn what_is_no_command_is_refused_and_harms_nobody() {
    let encoder = Running::on(LISTEN);
    let mut master = raw(&encoder);
    let mut stranger = encoder.client();
    stranger.expect("< hi >");
    stranger.say("GET / HTTP/1.1\r\n\r\n< send 42D 0 >< send 42D 9 1 >< shutdown >");
    stranger.expect(&"< error unknown command >".repeat(3));
    master.expect_nothing();
    master.say("< send 42D 0 >");
    expect_frame(&mut master, "3C5", "0001");
}

#[test]
fn the_server_acknowledges_without_clients() {
    let mut port = open(&LISTEN.parse().unwrap(), BitRate::Kbit500).unwrap();
    let frame = Frame::standard(0x42F, &[0; 7]);
    assert!(port.send(&frame).unwrap());
    assert_eq!(next(port.as_mut()), Received::Sent(frame));
    assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), None);
}
