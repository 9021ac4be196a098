//! Bad input: one clear sentence, the right exit status, nothing half started.

use crate::prompt::{Running, codewheel, stderr};

const BUS: [&str; 4] = ["--bus", "slcan-listen:127.0.0.1:0", "--address", "5"];

#[track_caller]
fn refused(arguments: &[&str], status: i32, sentence: &[&str]) {
    let output = codewheel(arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {text}");
    for part in sentence {
        assert!(text.contains(part), "{arguments:?} lacks {part:?}: {text}");
    }
    assert!(output.stdout.is_empty(), "nothing is started");
    assert!(!text.contains("panicked"), "{text}");
}

#[test]
fn an_unknown_model_names_the_models() {
    refused(
        &[&["encoder", "amg12-d29"], &BUS[..]].concat(),
        2,
        &["amg12-d29", "amg11-d29", "hmg10-d13"],
    );
    refused(&["describe", "amg11-p29"], 2, &["amg11-p29", "the models are"]);
}

#[test]
fn address_64_and_other_addresses_that_are_none_are_refused() {
    for address in ["64", "99", "-1", "five", ""] {
        let arguments =
            ["encoder", "amg11-d29", "--bus", "virtual:x", &format!("--address={address}")];
        refused(&arguments, 2, &["DeviceNet has 0–63"]);
    }
}

#[test]
fn a_rate_a_bus_and_a_shaft_that_make_no_sense_are_refused() {
    let encoder = [&["encoder", "amg11-d29"], &BUS[..]].concat();
    let with = |more: &[&'static str]| [&encoder, more].concat();
    refused(&with(&["--baud", "1M"]), 2, &["125k, 250k and 500k"]);
    refused(&with(&["--shaft", "trun rpm=60"]), 2, &["trun rpm=60", "turn rpm="]);
    refused(&with(&["--shaft", "turn"]), 2, &["rpm"]);
    refused(&with(&["--shaft", "csv /does/not/exist.csv"]), 2, &["/does/not/exist.csv"]);
    refused(&with(&["--serial", "-3"]), 2, &["--serial"]);
    let bus = ["encoder", "amg11-d29", "--bus", "can0", "--address", "5"];
    refused(&bus, 2, &["can0", "slcan-listen:HOST:PORT"]);
}

#[test]
fn a_port_in_use_is_an_io_error_that_says_what_to_do() {
    let (_encoder, address) = Running::encoder("amg11-d29", &[]);
    let bus = format!("slcan-listen:{address}");
    refused(
        &["encoder", "amg11-d29", "--bus", &bus, "--address", "6"],
        3,
        &[&address, "in use", "another"],
    );
}

#[test]
fn an_adapter_that_is_not_there_is_an_io_error() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound").to_string();
    drop(taken);
    let bus = format!("slcan:{address}");
    refused(&["encoder", "amg11-d29", "--bus", &bus, "--address", "6"], 3, &[&address]);
}

#[test]
fn an_unreadable_memory_is_an_io_error_and_starts_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().display().to_string();
    let arguments = [&["encoder", "amg11-d29"], &BUS[..], &["--memory", &path]].concat();
    refused(&arguments, 3, &[&path, "memory file"]);
}

#[test]
fn a_memory_in_use_is_refused_and_untouched() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("memory");
    let memory = path.display().to_string();
    let (_encoder, _) = Running::encoder("amg11-d29", &["--memory", &memory]);
    let before = std::fs::read(&path).expect("made");
    let arguments = [&["encoder", "amg11-d29"], &BUS[..], &["--memory", &memory]].concat();
    refused(&arguments, 3, &["in use by another encoder", &memory]);
    assert_eq!(std::fs::read(&path).expect("there"), before);
}

#[test]
fn help_and_version_are_no_errors() {
    for arguments in [["--help"], ["--version"]] {
        assert_eq!(codewheel(&arguments).status.code(), Some(0));
    }
    assert_eq!(codewheel(&["nonsense"]).status.code(), Some(2));
}

#[test]
fn models_are_listed_for_people_and_for_programs() {
    let text = String::from_utf8(codewheel(&["models"]).stdout).expect("text");
    assert_eq!(text.lines().count(), 11);
    let json = String::from_utf8(codewheel(&["models", "--json"]).stdout).expect("text");
    let lines: Vec<serde_json::Value> =
        json.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines.len(), 10);
    assert_eq!(lines[1]["model"], "amg11-d29");
    assert_eq!(lines[1]["revolutions"], 65_536);
    for line in lines {
        let model = line["model"].as_str().expect("a name");
        let text = String::from_utf8(codewheel(&["describe", model]).stdout).expect("text");
        assert!(text.contains("steps-per-turn"), "{text}");
    }
}
