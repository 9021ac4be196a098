//! We play the adapter at a pty, for the one program that opens it.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

mod common;

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use codewheel_link::{Notice, Received, open};
use codewheel_station::can::{BitRate, Frame};
use common::{PATIENCE, Running, next};
use tempfile::TempDir;

/// A path for a pty in a folder of its own, and the bus there.
fn place() -> (TempDir, PathBuf, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("adapter");
    let uri = format!("slcan-listen:pty:{}", path.display());
    (folder, path, uri)
}

fn program(path: &Path) -> File {
    OpenOptions::new().read(true).write(true).open(path).unwrap()
}

fn expect(program: &mut File, text: &str) {
    let mut octets = vec![0; text.len()];
    program.read_exact(&mut octets).unwrap();
    assert_eq!(octets.escape_ascii().to_string(), text.as_bytes().escape_ascii().to_string());
}

#[test]
fn a_program_opens_polls_closes_and_comes_again() {
    let (_folder, path, uri) = place();
    let encoder = Running::on(&uri);
    assert_eq!(encoder.address, None);
    for poll in 1..=3 {
        let mut program = program(&path);
        // The first finds its channel closed already, and hears so.
        program.write_all(b"C\rS4\rO\r").unwrap();
        expect(&mut program, if poll == 1 { "\x07\r\r" } else { "\r\r\r" });
        program.write_all(b"t42D0\r").unwrap();
        expect(&mut program, &format!("z\rt3C52{poll:04X}\r"));
    }
    let (echo, notices, turns) = encoder.stop();
    assert_eq!((echo.polls, echo.sent.len(), notices), (3, 3, Vec::new()));
    assert!(turns < 40, "{turns} turns");
}

#[test]
fn a_channel_that_is_closed_hears_nothing_and_frames_count_as_sent() {
    let (_folder, path, uri) = place();
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    assert_eq!(port.describe(), uri);
    assert!(port.confirms());
    let frame = Frame::standard(0x42F, &[0; 7]);
    assert!(port.send(&frame).unwrap());
    assert_eq!(next(port.as_mut()), Received::Sent(frame));
    let mut program = program(&path);
    program.write_all(b"V\r").unwrap();
    assert_eq!(port.receive(Some(Duration::from_millis(30))).unwrap(), None);
    expect(&mut program, "V1013\r");
}

#[test]
fn another_bit_rate_is_told_once() {
    let (_folder, path, uri) = place();
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    let mut program = program(&path);
    program.write_all(b"S6\rO\rC\rS6\rO\rC\r").unwrap();
    let told = port.receive(Some(PATIENCE)).unwrap();
    let (client, segment) = (format!("at {}", path.display()), BitRate::Kbit125);
    let notice = Notice::OtherBitRate { client, chosen: 500_000, segment };
    assert_eq!(told, Some(Received::Notice(notice)));
    assert_eq!(port.receive(Some(Duration::from_millis(30))).unwrap(), None);
}

#[test]
fn a_program_that_left_its_channel_open_stalls_nobody() {
    let (_folder, path, uri) = place();
    let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    let mut first = program(&path);
    first.write_all(b"O\r").unwrap();
    assert_eq!(port.receive(Some(Duration::from_millis(30))).unwrap(), None);
    drop(first);
    let frame = Frame::standard(0x3C5, &[0xAA; 8]);
    let mut told = Vec::new();
    let start = Instant::now();
    for _ in 0..10_000 {
        assert!(port.send(&frame).unwrap());
        while let Some(received) = port.receive(Some(Duration::ZERO)).unwrap() {
            if let Received::Notice(notice) = received {
                told.push(notice);
            }
        }
    }
    assert_eq!(told, [Notice::LineUnread]);
    assert!(start.elapsed() < PATIENCE, "{:?}", start.elapsed());
    // The next one begins at a clean table.
    std::thread::sleep(Duration::from_millis(1_100));
    let mut next = program(&path);
    next.write_all(b"C\r").unwrap();
    assert_eq!(port.receive(Some(Duration::from_millis(30))).unwrap(), None);
    expect(&mut next, "\r");
}

#[test]
fn the_name_is_there_as_long_as_the_port() {
    let (_folder, path, uri) = place();
    let port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
    assert!(fs::read_link(&path).unwrap().exists());
    let taken = open(&uri.parse().unwrap(), BitRate::Kbit125).err().unwrap().to_string();
    assert!(taken.starts_with("cannot put a serial port at "), "{taken}");
    drop(port);
    assert!(fs::symlink_metadata(&path).is_err());
}

#[test]
fn our_own_client_finds_the_adapter_at_its_path() {
    let (_folder, path, uri) = place();
    let encoder = Running::on(&uri);
    let client = format!("slcan:{}", path.display());
    let mut port = open(&client.parse().unwrap(), BitRate::Kbit125).unwrap();
    let poll = Frame::standard(0x42D, &[]);
    for number in 1..=20_u16 {
        assert!(port.send(&poll).unwrap());
        assert_eq!(next(port.as_mut()), Received::Sent(poll));
        let answer = Frame::standard(0x3C5, &number.to_be_bytes());
        assert_eq!(next(port.as_mut()), Received::Frame(answer));
    }
    encoder.stop();
}
