//! Several masters and listeners on one line over TCP.

use std::net::TcpStream;

use codewheel_link::{Notice, Rs485Received, open_rs485};
use codewheel_station::rs485::BaudRate;

use crate::bench::{ANSWER, PATIENCE, REQUEST, Running, hex};

#[test]
fn what_one_says_all_others_hear_and_the_one_not() {
    let slave = Running::listening();
    let (mut master, mut other) = (slave.client(), slave.client());
    other.join();
    master.expect(&REQUEST);
    master.expect(&ANSWER);
    master.say(&[0xDC, 0x02, 0x03]);
    other.expect(&[0xDC, 0x02, 0x03]);
    master.expect_nothing();
}

#[test]
fn all_hear_a_request_before_its_answer() {
    let slave = Running::listening();
    let (mut master, mut listener) = (slave.client(), slave.client());
    master.join();
    listener.hear(12);
    for _ in 0..100 {
        master.say(&REQUEST);
        master.expect(&ANSWER);
    }
    listener.expect(&[REQUEST, ANSWER].concat().repeat(100));
}

#[test]
fn all_hear_the_line_in_one_order() {
    let slave = Running::listening();
    let clients = slave.clients(4);
    let [mut a, mut b, mut first, mut second] = clients.try_into().ok().unwrap();
    for number in 0..100 {
        a.say(&[0xAA, number]);
        b.say(&[0xBB, number]);
    }
    let heard = first.hear(400);
    assert_eq!(hex(&heard), hex(&second.hear(400)));
    let (slave, _, _) = slave.stop();
    assert_eq!(hex(&slave.heard[slave.heard.len() - 400..]), hex(&heard));
}

#[test]
fn a_telegram_in_pieces_is_a_telegram() {
    let slave = Running::listening();
    let mut master = slave.client();
    for octet in REQUEST {
        master.say(&[octet]);
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    master.expect(&ANSWER);
}

#[test]
fn people_hear_who_comes_and_goes() {
    let uri = "rs485-listen:127.0.0.1:0".parse().unwrap();
    let mut port = open_rs485(&uri, BaudRate::Kbit500).unwrap();
    let address = port.local_address().unwrap();
    assert_eq!(port.describe(), format!("rs485-listen:{address}"));
    let stream = TcpStream::connect(address).unwrap();
    let client = stream.local_addr().unwrap();
    drop(stream);
    for notice in
        [Notice::ClientConnected { client }, Notice::ClientLeft { client, frames_lost: 0 }]
    {
        assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(Rs485Received::Notice(notice)));
    }
}

#[test]
fn a_crowd_is_served_and_the_next_one_turned_away() {
    let slave = Running::listening();
    let _crowd = slave.clients(64);
    let mut late = slave.client();
    late.expect_loss();
    let (_, notices, _) = slave.stop();
    assert!(matches!(notices.last(), Some(Notice::ClientTurnedAway { limit: 64, .. })));
}

#[test]
fn dropping_the_port_ends_every_connection() {
    let slave = Running::listening();
    let uri = format!("rs485:{}", slave.address.unwrap());
    let mut client = slave.client();
    client.join();
    slave.stop();
    assert_eq!(
        client.expect_loss(),
        format!("{uri} was lost: the other side closed it; it is tried until it is back")
    );
}
