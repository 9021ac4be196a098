//! `codewheel doctor`: what this machine can hold, and what is missing.

use serde_json::Value;

use crate::prompt::{codewheel, stderr};

/// The exit code, and what was found.
fn findings(arguments: &[&str]) -> (Option<i32>, Vec<Value>) {
    let output = codewheel(&[&["doctor", "--json"], arguments].concat());
    let text = String::from_utf8(output.stdout).expect("text");
    let found = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    (output.status.code(), found)
}

fn about<'a>(found: &'a [Value], what: &str) -> &'a Value {
    let finding = found.iter().find(|finding| finding["about"] == what);
    finding.unwrap_or_else(|| panic!("nothing about {what} in {found:?}"))
}

/// The exit code is that of the worst finding, and each one that is not fine has a remedy.
fn agree(code: Option<i32>, found: &[Value]) {
    let has = |state: &str| found.iter().any(|finding| finding["state"] == state);
    let worst = if has("cannot") {
        3
    } else if has("finding") {
        1
    } else {
        0
    };
    assert_eq!(code, Some(worst), "{found:?}");
    for finding in found.iter().filter(|finding| finding["state"] == "finding") {
        assert!(finding["remedy"].is_string(), "{finding}");
    }
}

#[test]
fn it_measures_its_own_answers_and_judges_every_rate() {
    let (code, found) = findings(&[]);
    agree(code, &found);
    let times = &about(&found, "answers, TCP")["values"];
    assert_eq!(times["count"], 1_000);
    let number = |key: &str| times[key].as_f64().expect("a number");
    assert!(0.0 < number("median_us") && number("median_us") <= number("p99_us"));
    assert!(number("p99_us") <= number("max_us"));
    if cfg!(unix) {
        assert_eq!(about(&found, "answers, pty")["values"]["count"], 1_000);
    }
    let values = &about(&found, "PROFIBUS rates")["values"];
    let rates = values["rates"].as_array().expect("rates");
    assert_eq!(rates.len(), 10);
    let answer = values["answer_us"].as_f64().expect("a number");
    for rate in rates {
        let bits = rate["rate"].as_f64().expect("a rate") * answer / 1e6;
        assert_eq!(rate["answer_bits"].as_f64(), Some(bits.ceil()), "{rate}");
        let limit = rate["max_station_delay_bits"].as_f64().expect("a number");
        assert_eq!(rate["max_station_delay_held"], bits.ceil() <= limit, "{rate}");
    }
}

#[test]
fn people_get_a_line_for_each_finding_and_a_table_of_rates() {
    let output = codewheel(&["doctor"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["timer           waits of 1 ms", "answers, TCP    median", "SLOT TIME TO SET"] {
        assert!(text.contains(part), "lacks {part:?}: {text}");
    }
    assert!(text.lines().any(|line| line.trim_start().starts_with("12M ")), "{text}");
}

#[test]
fn an_adapter_that_is_not_there_cannot_be_used_and_nothing_is_measured() {
    for (bus, topic) in [
        ("rs485:/dev/no-such-adapter", "serial port"),
        ("slcan:/dev/no-such-adapter", "serial port"),
        #[cfg(target_os = "linux")]
        ("socketcan:no-such-can", "CAN interface"),
    ] {
        let (code, found) = findings(&["--bus", bus]);
        agree(code, &found);
        assert_eq!(code, Some(3));
        let finding = about(&found, topic);
        assert_eq!(finding["state"], "cannot");
        assert!(finding["says"].as_str().expect("a sentence").contains("no-such-"), "{finding}");
        assert!(found.iter().all(|finding| finding["about"] != "answers, TCP"));
    }
}

#[cfg(unix)]
#[test]
fn a_pty_has_neither_rate_nor_parity_and_a_file_is_no_serial_port() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("line");
    let bus = format!("rs485-listen:pty:{}", path.display());
    let mut encoder =
        crate::prompt::Running::start(&["encoder", "amg11-p29", "--bus", &bus, "--address", "7"]);
    assert!(encoder.line().starts_with("ready"));
    let (code, found) = findings(&["--bus", &format!("rs485:{}", path.display())]);
    agree(code, &found);
    let finding = about(&found, "serial port");
    assert!(finding["says"].as_str().expect("a sentence").contains("is a pty"), "{finding}");
    assert_eq!(finding["state"], "fine");

    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("written");
    let (code, found) = findings(&["--bus", &format!("rs485:{}", file.display())]);
    assert_eq!((code, &about(&found, "serial port")["state"]), (Some(3), &Value::from("cannot")));
}

#[test]
fn somebody_elses_port_is_connected_to_and_timed_or_found_missing() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound").to_string();
    let (code, found) = findings(&["--bus", &format!("slcan:{address}")]);
    agree(code, &found);
    assert_eq!(about(&found, "bus")["state"], "fine");
    drop(listener);
    let (code, found) = findings(&["--bus", &format!("rs485:{address}")]);
    assert_eq!(code, Some(3));
    let finding = about(&found, "bus");
    assert!(finding["says"].as_str().expect("a sentence").contains(&address), "{finding}");
    assert!(finding["remedy"].is_string());
}

#[test]
fn a_port_of_ours_that_is_taken_cannot_be_had() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("bound");
    let (code, found) = findings(&["--bus", &format!("slcan-listen:{address}")]);
    assert_eq!(code, Some(3));
    assert!(about(&found, "bus")["says"].as_str().expect("a sentence").contains("in use"));
}

#[test]
fn what_names_no_bus_is_refused() {
    let output = codewheel(&["doctor", "--bus", "can0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("names no bus"), "{}", stderr(&output));
}
