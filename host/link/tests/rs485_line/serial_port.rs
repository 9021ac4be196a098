//! A serial port of this machine; a pty stands in for one, as far as it can.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::PathBuf;

use codewheel_link::{Notice, Rs485Received, open_rs485};
use codewheel_station::rs485::BaudRate;
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{ControlModes, InputModes, LocalModes, tcgetattr};

use crate::bench::{ANSWER, Client, PATIENCE, REQUEST, Running, Slave};

/// The far end of a line, and the path of the near one.
fn line() -> (OwnedFd, PathBuf) {
    let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    unlockpt(&far).unwrap();
    let near = ptsname(&far, Vec::new()).unwrap().into_string().unwrap();
    (far, PathBuf::from(near))
}

#[test]
fn a_slave_on_a_serial_port_answers() {
    let (far, near) = line();
    let uri = format!("rs485:{}", near.display());
    let slave = Running::on(&uri, Slave::at(BaudRate::Kbit187_5, 11));
    let mut far = File::from(far);
    far.write_all(&REQUEST).unwrap();
    let mut answer = [0; ANSWER.len()];
    far.read_exact(&mut answer).unwrap();
    assert_eq!(answer, ANSWER);
    let (_, notices, _) = slave.stop();
    assert_eq!(notices, [Notice::ParityNotTaken]);
}

#[test]
fn it_is_raw_at_the_rate_asked_for_with_broken_characters_marked() {
    for rate in BaudRate::ALL {
        let (far, near) = line();
        let uri = format!("rs485:{}", near.display());
        let port = open_rs485(&uri.parse().unwrap(), rate).unwrap();
        assert_eq!(port.describe(), uri);
        assert!(!port.has_rate(), "a pty has none");
        let settings = tcgetattr(&far).unwrap();
        assert_eq!(settings.output_speed(), rate.bits_per_second());
        assert_eq!(settings.input_speed(), rate.bits_per_second());
        assert!(settings.input_modes.contains(InputModes::PARMRK | InputModes::INPCK));
        assert!(!settings.input_modes.intersects(InputModes::IXON | InputModes::ICRNL));
        assert!(!settings.local_modes.intersects(LocalModes::ICANON | LocalModes::ECHO));
        assert!(settings.control_modes.contains(ControlModes::CS8 | ControlModes::CREAD));
    }
}

#[test]
fn the_octet_that_marks_is_an_octet_like_any_other() {
    let (far, near) = line();
    let mut client = Client::on(&format!("rs485:{}", near.display()));
    let octets = [0xFF, 0x00, 0xFF, 0xFF, 0x00, 0x00, 0xFF];
    File::from(far.try_clone().unwrap()).write_all(&octets).unwrap();
    client.expect(&octets);
    assert_eq!(client.notices, [Notice::ParityNotTaken]);
}

#[test]
fn a_port_that_is_pulled_out_says_so() {
    let (far, near) = line();
    let uri = format!("rs485:{}", near.display());
    let mut port = open_rs485(&uri.parse().unwrap(), BaudRate::Kbit19_2).unwrap();
    let notice = port.receive(Some(PATIENCE)).unwrap();
    assert_eq!(notice, Some(Rs485Received::Notice(Notice::ParityNotTaken)));
    drop(far);
    match port.receive(Some(PATIENCE)).unwrap() {
        Some(Rs485Received::Notice(Notice::BusLost { bus, .. })) => assert_eq!(bus, uri),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_lay_in_the_port_before_is_nobodys() {
    let (far, near) = line();
    let held = File::options().read(true).write(true).open(&near).unwrap();
    File::from(far.try_clone().unwrap()).write_all(b"stale\n").unwrap();
    let mut client = Client::on(&format!("rs485:{}", near.display()));
    client.expect_nothing();
    drop(held);
}
