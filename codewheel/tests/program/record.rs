//! `--record`: what buses carry, on file while they run.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use crate::prompt::{Client, Running, codewheel, example, printed, stderr};

/// What a recording holds, an object for each frame and telegram.
#[track_caller]
fn replayed(path: &Path) -> Vec<Value> {
    let text = printed(&["replay", path.to_str().expect("text"), "--json"]);
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

/// Ends it and gives what it said on stderr.
fn end(running: Running) -> String {
    running.signal(Signal::TERM);
    let (status, messages) = running.end();
    assert_eq!(status.code(), Some(0), "{messages}");
    messages
}

/// A PROFIBUS encoder at address 7 that is recorded, and its line.
fn encoder_on_a_line(file: &str) -> (Running, TcpStream) {
    let bus = ["encoder", "amg11-p29", "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
    let mut encoder = Running::start(&[&bus[..], &["--record", file]].concat());
    let line = encoder.line();
    let address = line.rsplit_once(" on rs485-listen:").expect("ready").1;
    let line = TcpStream::connect(address).expect("the encoder listens");
    line.set_read_timeout(Some(Duration::from_secs(10))).expect("a time-out");
    (encoder, line)
}

#[test]
fn the_demo_is_recorded_into_one_file_that_names_what_both_buses_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("demo.pcapng");
    let (file, demo) = (path.display().to_string(), example("demo.toml"));
    let run = ["run", demo.to_str().expect("text"), "--for", "3500ms", "--record", &file];
    let output = codewheel(&run);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let records = replayed(&path);
    let told = format!("codewheel: {file} holds {} frames and telegrams", records.len());
    assert!(stderr(&output).contains(&told), "{}", stderr(&output));
    let has = |bus: &str, key: &str, value: &str| {
        records.iter().any(|record| record["bus"] == bus && record[key] == value)
    };
    assert!(has("demo", "message", "duplicate MAC ID check request"));
    assert!(has("demo", "frame", "42D#"), "a poll");
    for service in ["Slave_Diag", "Set_Prm", "Chk_Cfg", "Data_Exchange"] {
        assert!(has("field", "service", service), "{service}");
    }
    let positions = |bus: &str| {
        let of_bus = records.iter().filter(|record| record["bus"] == bus);
        of_bus.filter(|record| record["values"]["position"].is_u64()).count()
    };
    assert!(positions("demo") > 10 && positions("field") > 1_000);
}

#[test]
fn a_devicenet_encoder_records_what_it_heard_and_what_it_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.log");
    let file = path.display().to_string();
    let more = ["--shaft", "still angle=74565", "--record", &file];
    let (encoder, address) = Running::encoder("amg11-d29", &more);
    let mut client = Client::connect(&address);
    client.allocate();
    assert_eq!(client.ask("100502096400"), "906400");
    client.send("t42D0");
    assert_eq!(client.frame("3C5"), "445230100");
    let messages = end(encoder);
    assert!(messages.contains(&format!("codewheel: {file} holds ")), "{messages}");

    let text = std::fs::read_to_string(&path).expect("the recording");
    let lines: Vec<_> =
        text.lines().map(|line| line.split_once(") can0 ").expect("a line").1).collect();
    let place = |frame| lines.iter().position(|line| *line == frame);
    let (check, poll, answer) =
        (place("42F#00D40105000000 T"), place("42D#"), place("3C5#45230100 T"));
    assert!(check.is_some() && check < poll && poll < answer, "{text}");
    assert_eq!(lines.iter().filter(|line| line.starts_with("3C5#45230100")).count(), 1, "once");
}

#[test]
fn a_recording_that_knows_directions_tells_what_the_encoder_said_from_what_it_heard() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.asc");
    let more = ["--record", &path.display().to_string()];
    let (encoder, address) = Running::encoder("hmg10-d13", &more);
    let mut client = Client::connect(&address);
    client.allocate();
    end(encoder);
    let records = replayed(&path);
    for record in &records {
        let frame = record["frame"].as_str().expect("a frame");
        let (identifier, data) = frame.split_once('#').expect("a frame");
        // The duplicate MAC ID check of the encoder itself, and its responses.
        let own = identifier == "42F" && data.starts_with("00") || identifier == "42B";
        assert_eq!(record["direction"], if own { "sent" } else { "received" }, "{record}");
    }
    assert!(records.iter().any(|record| record["direction"] == "sent"));
    assert!(records.iter().any(|record| record["direction"] == "received"));
}

#[test]
fn a_profibus_encoder_records_telegrams_however_their_octets_came_and_what_was_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("line.log");
    let (encoder, mut line) = encoder_on_a_line(&path.display().to_string());
    let mut answer = [0; 6];
    // FDL status, in two portions.
    for portion in [&[0x10, 0x07][..], &[0x02, 0x49, 0x52, 0x16]] {
        line.write_all(portion).expect("connected");
        std::thread::sleep(Duration::from_millis(5));
    }
    line.read_exact(&mut answer).expect("an answer");
    assert_eq!(answer, [0x10, 0x02, 0x07, 0x00, 0x09, 0x16]);
    // The beginning of a telegram that never ends.
    line.write_all(&[0x68, 0x05, 0x05]).expect("connected");
    std::thread::sleep(Duration::from_millis(100));
    end(encoder);
    let text = std::fs::read_to_string(&path).expect("the recording");
    let said: Vec<_> = text.lines().map(|line| line.split_once(") ").expect("a line").1).collect();
    assert_eq!(said, ["pb0 10 07 02 49 52 16", "pb0 10 02 07 00 09 16 T", "pb0 68 05 05 !"]);
}

#[test]
fn what_no_format_holds_is_refused_before_anything_starts() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let demo = example("demo.toml").display().to_string();
    let encoder = ["encoder", "amg11-p29", "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
    for (verb, bus) in [(&["run", &demo][..], "field"), (&encoder, "pb0")] {
        for (name, why) in [
            ("r.asc", &*format!("{bus} is PROFIBUS: record to .pcapng or .log")),
            ("r.trc", &*format!("{bus} is PROFIBUS: record to .pcapng or .log")),
            ("r.csv", "write .log, .asc, .trc or .pcapng"),
        ] {
            let file = at(name);
            let output = codewheel(&[verb, &["--record", &file]].concat());
            let text = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{text}");
            assert!(text.contains(&file) && text.contains(why), "{text}");
            assert!(output.stdout.is_empty() && !Path::new(&file).exists(), "nothing is started");
        }
    }
    let print = ["run", &demo, "--print-config", "--record", &at("r.log")];
    assert_eq!(codewheel(&print).status.code(), Some(2), "nothing runs that could be recorded");
}

#[test]
fn a_file_that_cannot_be_made_is_an_io_error_and_nothing_starts() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("missing/r.pcapng").display().to_string();
    let demo = example("demo.toml").display().to_string();
    let encoder = ["encoder", "amg11-d29", "--bus", "slcan-listen:127.0.0.1:0", "--address", "5"];
    for verb in [&["run", &demo][..], &encoder] {
        let output = codewheel(&[verb, &["--record", &file]].concat());
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{text}");
        assert!(text.contains(&format!("cannot record to {file}: ")), "{text}");
        assert!(output.stdout.is_empty(), "nothing is started");
    }
}

#[test]
fn an_older_recording_stays_where_the_bus_cannot_be_joined() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("r.log");
    let file = path.display().to_string();
    let (encoder, address) = Running::encoder("amg11-d29", &["--record", &file]);
    let second = format!("slcan-listen:{address}");
    let again = ["encoder", "amg11-d29", "--bus", &second, "--address", "6", "--record", &file];
    assert_eq!(codewheel(&again).status.code(), Some(3), "the port is in use");
    Client::connect(&address).allocate();
    end(encoder);
    assert!(replayed(&path).iter().any(|record| record["from"] == 5), "the first one goes on");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_no_encoder_and_is_told_at_the_end() {
    // /dev/full takes nothing; its name must have a suffix of a recording.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("full.log");
    std::os::unix::fs::symlink("/dev/full", &path).expect("a link");
    let (encoder, mut line) = encoder_on_a_line(&path.display().to_string());
    let begin = Instant::now();
    let mut answer = [0; 6];
    while begin.elapsed() < Duration::from_secs(1) {
        line.write_all(&[0x10, 0x07, 0x02, 0x49, 0x52, 0x16]).expect("connected");
        line.read_exact(&mut answer).expect("the encoder answers");
    }
    encoder.signal(Signal::TERM);
    let (status, messages) = encoder.end();
    assert_eq!(status.code(), Some(3), "{messages}");
    for part in ["full.log lacks ", "cannot record to ", "the capture cannot be written: "] {
        assert!(messages.contains(part), "{part}: {messages}");
    }
}
