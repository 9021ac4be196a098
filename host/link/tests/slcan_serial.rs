//! An adapter at a serial port of this machine; a pty stands in for one, as far as it can.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::File;
use std::io::{Read, Write};
use std::path::PathBuf;

use codewheel_link::{CanPort, Notice, Received, open};
use codewheel_station::can::{BitRate, Frame};
use common::{PATIENCE, next};
use rustix::pty::{OpenptFlags, openpt, ptsname, unlockpt};
use rustix::termios::{ControlModes, InputModes, LocalModes, tcgetattr};

/// The adapter's end of a serial line, and the path of ours.
fn line() -> (File, PathBuf) {
    let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    unlockpt(&far).unwrap();
    let near = ptsname(&far, Vec::new()).unwrap().into_string().unwrap();
    (File::from(far), PathBuf::from(near))
}

fn connected(rate: BitRate) -> (Box<dyn CanPort>, File) {
    let (far, near) = line();
    let port = open(&format!("slcan:{}", near.display()).parse().unwrap(), rate).unwrap();
    (port, far)
}

fn expect(far: &mut File, text: &str) {
    let mut octets = vec![0; text.len()];
    far.read_exact(&mut octets).unwrap();
    assert_eq!(octets.escape_ascii().to_string(), text.as_bytes().escape_ascii().to_string());
}

#[test]
fn the_channel_is_closed_set_and_opened_and_closed_at_the_end() {
    for (rate, letters) in
        [(BitRate::Kbit125, "S4"), (BitRate::Kbit250, "S5"), (BitRate::Kbit500, "S6")]
    {
        let (port, mut far) = connected(rate);
        expect(&mut far, &format!("C\r{letters}\rO\r"));
        drop(port);
        expect(&mut far, "C\r");
    }
}

#[test]
fn a_frame_goes_out_is_confirmed_and_one_comes_in() {
    let (mut port, mut far) = connected(BitRate::Kbit125);
    expect(&mut far, "C\rS4\rO\r");
    far.write_all(b"\x07\r\r").unwrap();
    let frame = Frame::standard(0x3C5, &[0xFF, 0x00, 0x11]);
    assert!(port.send(&frame).unwrap());
    expect(&mut far, "t3C53FF0011\r");
    far.write_all(b"z\rt42D0\r").unwrap();
    assert_eq!(next(port.as_mut()), Received::Sent(frame));
    assert_eq!(next(port.as_mut()), Received::Frame(Frame::standard(0x42D, &[])));
}

#[test]
fn the_port_is_raw_at_the_speed_asked_for() {
    for (suffix, speed) in [("", 115_200), ("@57600", 57_600), ("@3000000", 3_000_000)] {
        let (far, near) = line();
        let uri = format!("slcan:{}{suffix}", near.display());
        let port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
        assert_eq!(port.describe(), uri);
        let settings = tcgetattr(&far).unwrap();
        assert_eq!(settings.output_speed(), speed);
        assert!(!settings.input_modes.intersects(InputModes::IXON | InputModes::ICRNL));
        assert!(!settings.input_modes.contains(InputModes::PARMRK));
        assert!(!settings.local_modes.intersects(LocalModes::ICANON | LocalModes::ECHO));
        assert!(settings.control_modes.contains(ControlModes::CS8 | ControlModes::CREAD));
        assert!(!settings.control_modes.intersects(ControlModes::PARENB | ControlModes::CRTSCTS));
    }
}

#[test]
fn what_lay_in_the_port_before_is_nobodys() {
    let (mut far, near) = line();
    let held = File::options().read(true).write(true).open(&near).unwrap();
    far.write_all(b"t42D0\n").unwrap();
    let uri = format!("slcan:{}", near.display());
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    far.write_all(b"\r\r\rt42F0\r").unwrap();
    assert_eq!(next(port.as_mut()), Received::Frame(Frame::standard(0x42F, &[])));
    drop(held);
}

#[test]
fn an_adapter_that_is_pulled_out_is_told_and_the_station_is_off_the_bus() {
    let (mut port, far) = connected(BitRate::Kbit125);
    drop(far);
    match port.receive(Some(PATIENCE)).unwrap() {
        Some(Received::Notice(Notice::BusLost { bus, .. })) => assert_eq!(bus, port.describe()),
        other => panic!("{other:?}"),
    }
    assert_eq!(port.receive(Some(PATIENCE)).unwrap(), Some(Received::Detached));
    assert!(!port.is_ready());
    assert!(!port.send(&Frame::standard(1, &[])).unwrap());
}

#[test]
fn a_path_without_an_adapter_is_said_in_plain_words() {
    let refusal = |uri: &str| open(&uri.parse().unwrap(), BitRate::Kbit125).err().unwrap();
    let missing = refusal("slcan:/dev/ttyNothing0").to_string();
    assert!(missing.starts_with("cannot open the serial port /dev/ttyNothing0: "), "{missing}");
    assert!(missing.ends_with("; plug the adapter in and look in /dev for its name"), "{missing}");
    let no_terminal = refusal("slcan:/dev/null").to_string();
    assert!(no_terminal.ends_with("; check that the path is that of a serial port"));
}
