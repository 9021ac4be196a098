//! A pty that programs find at a path.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use codewheel_link::{LinkError, Notice, Rs485Port, Rs485Received, open_rs485};
use codewheel_station::rs485::{BaudRate, Transmission};
use tempfile::TempDir;

use crate::bench::{ANSWER, Client, PATIENCE, REQUEST, Running, Slave};

/// A path for a pty in a folder of its own.
pub(crate) fn place() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("line");
    (folder, path)
}

fn listen(path: &Path) -> Result<Box<dyn Rs485Port>, LinkError> {
    let uri = format!("rs485-listen:pty:{}", path.display());
    open_rs485(&uri.parse().unwrap(), BaudRate::Kbit500)
}

fn program(path: &Path) -> Client {
    Client::on(&format!("rs485:{}", path.display()))
}

#[test]
fn a_program_opens_asks_closes_and_comes_again() {
    let (_folder, path) = place();
    let uri = format!("rs485-listen:pty:{}", path.display());
    let slave = Running::on(&uri, Slave::at(BaudRate::Kbit500, 11));
    assert_eq!(slave.address, None);
    for _ in 0..3 {
        let mut master = program(&path);
        master.join();
        master.say(&REQUEST);
        master.expect(&ANSWER);
    }
    // While nobody has it open, nothing happens.
    std::thread::sleep(Duration::from_millis(50));
    let (slave, notices, turns) = slave.stop();
    assert_eq!((slave.spoke.len(), notices), (6, Vec::new()));
    assert!(turns < 40, "{turns} turns");
}

#[test]
fn every_octet_passes_as_it_is_both_ways() {
    let (_folder, path) = place();
    let mut port = listen(&path).unwrap();
    assert_eq!(port.describe(), format!("rs485-listen:pty:{}", path.display()));
    assert!(!port.has_rate());
    let mut program = program(&path);
    let octets: [u8; 256] = std::array::from_fn(|place| place as u8);
    for half in octets.chunks(128) {
        program.say(half);
        port.send(&Transmission::new(half).unwrap()).unwrap();
    }
    program.expect(&octets);
    let mut heard = Vec::new();
    while heard.len() < octets.len() {
        match port.receive(Some(PATIENCE)).unwrap() {
            Some(Rs485Received::Octets(octets)) => heard.extend(octets),
            other => panic!("{other:?} after {} octets", heard.len()),
        }
    }
    assert_eq!(heard, octets);
}

#[test]
fn the_name_is_there_as_long_as_the_port() {
    let (_folder, path) = place();
    let port = listen(&path).unwrap();
    assert!(fs::read_link(&path).unwrap().exists());
    drop(port);
    assert!(fs::symlink_metadata(&path).is_err());
}

#[test]
fn a_name_that_a_killed_program_left_is_taken_over() {
    let (_folder, path) = place();
    symlink("/dev/pts/no-such-pty", &path).unwrap();
    let port = listen(&path).unwrap();
    assert!(path.exists());
    drop(port);
    assert!(fs::symlink_metadata(&path).is_err());
}

#[test]
fn what_is_there_is_never_overwritten() {
    let (folder, path) = place();
    let refusal = |path: &Path| listen(path).err().unwrap().to_string();
    fs::write(&path, "notes").unwrap();
    assert_eq!(
        refusal(&path),
        format!(
            "cannot put a serial port at {}: a file is there that is no link; remove what is there, \
             or choose another path",
            path.display()
        )
    );
    assert_eq!(fs::read_to_string(&path).unwrap(), "notes");
    let link = folder.path().join("link");
    symlink(&path, &link).unwrap();
    assert!(refusal(&link).contains(&format!("a link to {} is there", path.display())));
    assert_eq!(fs::read_link(&link).unwrap(), path);
    assert!(refusal(folder.path()).contains("a file is there that is no link"));
    let line = folder.path().join("taken");
    let _port = listen(&line).unwrap();
    assert!(refusal(&line).contains("a link to /dev/"));
    assert!(refusal(&folder.path().join("no/folder")).contains("No such file"));
}

#[test]
fn a_name_that_another_has_taken_meanwhile_stays() {
    let (_folder, path) = place();
    let port = listen(&path).unwrap();
    fs::remove_file(&path).unwrap();
    symlink("/dev/null", &path).unwrap();
    drop(port);
    assert_eq!(fs::read_link(&path).unwrap(), Path::new("/dev/null"));
}

#[test]
fn what_nobody_reads_is_thrown_away_and_told_once() {
    let (_folder, path) = place();
    let mut port = listen(&path).unwrap();
    let telegram = Transmission::new(&[0xA5; 255]).unwrap();
    // How soon the system counts what was written is its own affair.
    let start = Instant::now();
    let mut told = Vec::new();
    while told.is_empty() && start.elapsed() < PATIENCE {
        port.send(&telegram).unwrap();
        told.extend(port.receive(Some(Duration::from_millis(1))).unwrap());
    }
    assert_eq!(told, [Rs485Received::Notice(Notice::LineUnread)]);
    for _ in 0..100 {
        port.send(&telegram).unwrap();
    }
    assert_eq!(port.receive(Some(Duration::ZERO)).unwrap(), None, "told twice");
}

#[test]
fn a_program_that_reads_misses_nothing_however_much_there_is() {
    let (_folder, path) = place();
    let uri = format!("rs485-listen:pty:{}", path.display());
    let slave = Running::on(&uri, Slave::at(BaudRate::Mbit12, 11));
    let mut master = program(&path);
    for _ in 0..1_000 {
        master.say(&REQUEST);
        master.expect(&ANSWER);
    }
    let (_, notices, _) = slave.stop();
    assert_eq!(notices, []);
}

#[test]
fn the_answer_to_one_who_is_gone_is_not_for_the_next() {
    let (_folder, path) = place();
    let mut port = listen(&path).unwrap();
    // A program that only reads what comes after its request, and does not empty the port first.
    let mut next = program(&path);
    port.send(&Transmission::new(&ANSWER).unwrap()).unwrap();
    std::thread::sleep(Duration::from_millis(1_100));
    next.say(&REQUEST);
    assert!(matches!(port.receive(Some(PATIENCE)).unwrap(), Some(Rs485Received::Octets(_))));
    port.send(&Transmission::new(&[0xE5]).unwrap()).unwrap();
    next.expect(&[0xE5]);
}
