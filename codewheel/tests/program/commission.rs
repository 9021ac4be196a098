//! Commissioning from a shell: two buses, two programs, and what is left when one of them is killed.

use std::fs;
use std::path::Path;

use rustix::process::Signal;
use serde_json::Value;

use crate::prompt::{Running, codewheel, printed, stderr};
use crate::terminal::Terminal;

/// A plant with a DeviceNet and a PROFIBUS that others join, of which nobody is the master, and two
/// encoders on each: one at work, and one that could replace it.
const PLANT: &str = r#"
[[bus]]
name = "line"
uri = "slcan-listen:127.0.0.1:0"

[[bus]]
name = "field"
kind = "profibus"
uri = "rs485-listen:127.0.0.1:0"

[[device]]
bus = "line"
model = "amg11-d29"
address = 5
serial = 1001
shaft = "still angle=1234567"
memory = "five.memory"

[[device]]
bus = "line"
model = "amg11-d29"
address = 6
serial = 1002
shaft = "still angle=33turns"
memory = "six.memory"

[[device]]
bus = "field"
model = "amg11-p29"
address = 7
shaft = "still angle=765432"
memory = "seven.memory"

[[device]]
bus = "field"
model = "amg11-p29"
address = 8
shaft = "still angle=4000turns"
memory = "eight.memory"
"#;

/// The plant while it runs, in a folder with its memories.
struct Plant {
    running: Running,
    line: String,
    field: String,
}

impl Plant {
    fn start(folder: &Path) -> Self {
        let file = folder.join("plant.toml");
        fs::write(&file, PLANT).expect("written");
        let mut running = Running::start(&["run", file.to_str().expect("text")]);
        let mut port = |prefix: &str| {
            let message = running.message();
            let port = message.strip_prefix(prefix).and_then(|rest| rest.split(": ").next());
            port.unwrap_or_else(|| panic!("not ready: {message:?}")).to_owned()
        };
        let line = port("codewheel: line on slcan-listen:");
        let field = port("codewheel: field on rs485-listen:");
        running.ignore_stdout();
        Self { running, line: format!("slcan:{line}"), field: format!("rs485:{field}") }
    }

    /// What a verb prints for the encoder at `address` of DeviceNet, or of PROFIBUS from 7 on.
    #[track_caller]
    fn does(&self, words: &[&str], address: &str) -> String {
        printed(&self.words(words, address))
    }

    fn words<'a>(&'a self, words: &[&'a str], address: &'a str) -> Vec<&'a str> {
        let bus = if matches!(address, "5" | "6") { &self.line } else { &self.field };
        [words, &["--bus", bus, "--address", address]].concat()
    }

    #[track_caller]
    fn position(&self, address: &str) -> i64 {
        self.does(&["get", "position"], address).trim().parse().expect("a number")
    }

    /// Switches everything off without a warning.
    fn kill(self) {
        self.running.signal(Signal::KILL);
        assert!(!self.running.end().0.success());
    }
}

/// The addresses and serial numbers that a scan of `bus` finds.
fn found(bus: &str) -> Vec<(u64, Option<u64>)> {
    let lines = printed(&["scan", "--bus", bus, "--json"]);
    let nodes = lines.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let nodes = nodes.filter(|node| node["address"].is_number());
    nodes
        .map(|node| (node["address"].as_u64().expect("it"), node["identity"]["serial"].as_u64()))
        .collect()
}

#[test]
fn encoders_of_both_buses_are_found_set_saved_and_replaced_across_a_power_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    let passport = |name: &str| folder.path().join(name).display().to_string();
    let (five, seven) = (passport("five.toml"), passport("seven.toml"));
    let plant = Plant::start(folder.path());

    assert_eq!(found(&plant.line), [(5, Some(1_001)), (6, Some(1_002))]);
    assert_eq!(found(&plant.field), [(7, None), (8, None)]);

    plant.does(&["set", "steps-per-turn", "3600", "--yes"], "5");
    plant.does(&["set", "direction", "ccw", "--yes"], "5");
    plant.does(&["preset", "50000", "--yes"], "5");
    plant.does(&["save", "--yes"], "5");
    plant.does(&["backup", &five], "5");
    // On PROFIBUS the preset is kept at once, together with its parameters.
    let range = "total-resolution=235929600";
    plant.does(&["set", "steps-per-turn", "3600", "--parameter", range, "--yes"], "7");
    plant.does(&["preset", "60000", "--yes"], "7");
    plant.does(&["backup", &seven], "7");

    plant.kill();
    let plant = Plant::start(folder.path());

    assert_eq!(plant.does(&["diff", &five], "5"), "");
    assert_eq!(plant.position("5"), 50_000);
    // Its own master brings the parameters, as this one does.
    let parameters = ["--parameter", "steps-per-turn=3600", "--parameter", range];
    assert_eq!(plant.does(&[&["diff", &seven][..], &parameters].concat(), "7"), "");
    assert_eq!(plant.position("7"), 60_000);

    // Replaced, while the machine stands where it stood.
    plant.does(&["apply", &five, "--yes"], "6");
    assert!((plant.position("6") - 50_000).abs() <= 1);
    plant.does(&["apply", &seven, "--yes"], "8");
    assert!((plant.position("8") - 60_000).abs() <= 1);
    let differs = codewheel(&plant.words(&["diff", &five, "--json"], "6"));
    let text = String::from_utf8(differs.stdout).expect("text");
    assert_eq!(differs.status.code(), Some(0), "another unit is no fault: {text}");
    assert!(text.contains("\"was\":1001,\"is\":1002"), "{text}");

    // And back: what it was before stands in a file beside the passport.
    plant.does(&["apply", &passport("five.before.toml"), "--yes"], "6");
    assert_eq!(plant.position("6"), 33 * 8_192);
}

#[test]
fn on_profibus_one_command_undoes_a_change_and_the_offset_comes_back_with_the_parameters() {
    let folder = tempfile::tempdir().expect("a folder");
    let plant = Plant::start(folder.path());
    let scaled = ["--parameter", "total-resolution=6000"];
    plant.does(&[&["set", "steps-per-turn", "100", "--yes"][..], &scaled].concat(), "7");
    plant.does(&["preset", "77", "--yes"], "7");
    let before = plant.does(&["get", "--json"], "7");
    for change in [
        &["set", "direction", "ccw"][..],
        &["set", "class-2", "off"],
        &["set", "scaling", "off"],
        &["preset", "5999"],
    ] {
        let done = plant.does(&[change, &["--yes", "--json"]].concat(), "7");
        assert_ne!(plant.does(&["get", "--json"], "7"), before, "{change:?}");
        let done: Value = serde_json::from_str(&done).expect("JSON");
        let [undo] = done["undo"].as_array().expect("commands").as_slice() else {
            panic!("{change:?}: {done}")
        };
        let words = shlex::split(undo.as_str().expect("text")).expect("words of a shell");
        let words: Vec<&str> = words.iter().map(String::as_str).skip(1).collect();
        printed(&[&words[..], &["--yes"]].concat());
        assert_eq!(plant.does(&["get", "--json"], "7"), before, "{change:?}: {undo}");
    }
}

/// An encoder on a free TCP port, as `--bus` names it.
fn encoder() -> (Running, String) {
    let (running, address) = Running::encoder("amg11-d29", &["--shaft", "still angle=1000"]);
    (running, format!("slcan:{address}"))
}

#[test]
fn ctrl_c_ends_watching_and_the_encoder_is_free_for_another_master_at_once() {
    let (_encoder, bus) = encoder();
    let at = ["--bus", &bus, "--address", "5"];
    let mut watch = Running::start(&[&["watch", "--json"], &at[..]].concat());
    assert!(watch.line().contains("\"position\":1000"));
    watch.signal(Signal::INT);
    let (status, messages) = watch.end();
    assert_eq!((status.code(), messages.as_str()), (Some(0), ""));
    let other = [&["get", "position", "--master", "9"], &at[..]].concat();
    assert_eq!(printed(&other), "1000\n");
}

#[test]
fn a_reader_that_goes_away_ends_watching_cleanly() {
    let (_encoder, bus) = encoder();
    let mut watch = Running::start(&["watch", "--json", "--bus", &bus, "--address", "5"]);
    assert!(watch.line().contains("\"position\":1000"));
    watch.close_stdout();
    let (status, messages) = watch.end();
    assert_eq!((status.code(), messages.as_str()), (Some(0), ""));
}

#[test]
fn a_reader_that_goes_away_keeps_nobody_from_hearing_how_a_change_is_undone() {
    let (_encoder, bus) = encoder();
    for change in [&["set", "direction", "ccw"][..], &["preset", "7"], &["reset"]] {
        let mut changes =
            Running::start(&[change, &["--yes", "--bus", &bus, "--address", "5"]].concat());
        changes.close_stdout();
        let (status, messages) = changes.end();
        assert_eq!(status.code(), Some(0), "{messages}");
        assert!(messages.contains("codewheel: undo: codewheel "), "{change:?}: {messages}");
    }
}

#[test]
fn ctrl_c_while_the_bus_is_listened_to_ends_at_once() {
    let (_encoder, bus) = encoder();
    let scan = Running::start(&["scan", "--bus", &bus, "--listen-for", "1h"]);
    std::thread::sleep(std::time::Duration::from_millis(500));
    scan.signal(Signal::INT);
    let (status, messages) = scan.end();
    assert_eq!((status.code(), messages.as_str()), (Some(130), "codewheel: interrupted\n"));
}

#[test]
fn a_person_at_a_terminal_is_asked_and_only_yes_writes() {
    let (_encoder, bus) = encoder();
    let at = ["--bus", &bus, "--address", "5"];
    let preset = [&["preset", "7"], &at[..]].concat();
    let position = || printed(&[&["get", "position"], &at[..]].concat());

    let mut asked = Terminal::start_with_keyboard(&preset);
    asked.read_until("Preset it? [y/N] ");
    asked.press("n\n");
    let seen = asked.end_with(None, 2);
    assert!(seen.contains("position: 1000 → 7 step") && seen.contains("nothing was written"));
    assert_eq!(position(), "1000\n");

    let mut asked = Terminal::start_with_keyboard(&preset);
    asked.read_until("Preset it? [y/N] ");
    let seen = asked.end_with(Some(Signal::INT), 130);
    assert!(seen.contains("the encoder was released") && seen.contains("interrupted"), "{seen}");
    assert_eq!(position(), "1000\n");

    let mut asked = Terminal::start_with_keyboard(&preset);
    asked.read_until("Preset it? [y/N] ");
    // As long as a person may take: a connection that nobody uses would be over.
    std::thread::sleep(std::time::Duration::from_secs(11));
    asked.press("y\n");
    let seen = asked.end_with(None, 0);
    assert!(seen.contains("undo: codewheel preset --by 993"), "{seen}");
    assert_eq!(position(), "7\n");
}

#[test]
fn a_shaft_that_turned_while_a_person_thought_is_moved_by_what_was_asked_for_alone() {
    let (_encoder, address) = Running::encoder("amg11-d29", &["--shaft", "turn rpm=60"]);
    let bus = format!("slcan:{address}");
    let at = ["--bus", &bus, "--address", "5", "--by", "5"];
    let mut asked = Terminal::start_with_keyboard(&[&["preset"], &at[..]].concat());
    asked.read_until("Preset it? [y/N] ");
    std::thread::sleep(std::time::Duration::from_secs(2));
    asked.press("y\n");
    let seen = asked.end_with(None, 0);
    let by = seen.split("undo: codewheel preset --by ").nth(1).and_then(|it| it.split(' ').next());
    let by: i64 = by.and_then(|by| by.parse().ok()).unwrap_or_else(|| panic!("{seen}"));
    // Two turns were 16384 steps.
    assert!((by + 5).abs() < 4_096, "{seen}");
    let offset = printed(&["get", "offset", "--bus", &bus, "--address", "5"]);
    assert_eq!(offset.trim().parse(), Ok(-by), "what is undone is what was done");
}

#[test]
fn watching_on_a_terminal_draws_in_its_place_and_gives_the_terminal_back() {
    let (_encoder, bus) = encoder();
    let at = ["--bus", &bus, "--address", "5"];
    let mut watch = Terminal::start_with_keyboard(&[&["watch"], &at[..]].concat());
    watch.read_until("\x1b[6F");
    watch.read_until("0 steps/s, 0.0 rpm");
    let seen = watch.end_with(Some(Signal::INT), 0);
    assert!(seen.contains("amg11-d29 at address 5 of DeviceNet"), "{seen}");
    assert!(seen.contains("\x1b[?25l") && seen.ends_with("\x1b[?25h"), "{seen:?}");
}

#[test]
fn a_dead_encoder_leaves_its_passport_in_a_recording_of_its_bus() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).display().to_string();
    let capture = file("session.log");
    let more = ["--shaft", "still angle=1000", "--record", &capture, "--serial", "77"];
    let (encoder, address) = Running::encoder("amg11-d29", &more);
    let bus = format!("slcan:{address}");
    printed(&["set", "steps-per-turn", "3600", "--yes", "--bus", &bus, "--address", "5"]);
    encoder.signal(Signal::TERM);
    assert_eq!(encoder.end().0.code(), Some(0));

    let text = printed(&["passport", &capture]);
    assert!(text.contains("steps-per-turn = 3600") && text.contains("serial = 77"), "{text}");
    let told: serde_json::Value =
        serde_json::from_str(&printed(&["passport", &capture, "--json"])).expect("one object");
    assert_eq!(told["file"], serde_json::Value::Null);
    assert_eq!(told["passport"]["settings"]["steps-per-turn"], 3600);
    let passports = file("passports");
    let listed = printed(&["passport", &capture, "-o", &passports]);
    assert!(listed.ends_with("devicenet-5.toml\n"), "{listed}");
    assert_eq!(fs::read_to_string(listed.trim()).expect("there"), text);

    let nothing = file("nothing.log");
    fs::write(&nothing, "").expect("written");
    let output = codewheel(&["passport", &nothing]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}
