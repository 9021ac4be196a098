//! `codewheel replay`.

use std::path::PathBuf;

use serde_json::Value;

use crate::prompt::{Running, codewheel, printed, stderr};

/// A poll of an encoder and its answer, a telegram, and one that was disturbed.
const SESSION: &str = "\
(1795334400.000000) can0 42F#00D40105000000
(1795334400.100000) can0 42D#
(1795334400.100250) can0 3C5#45230100
(1795334400.200000) pb0 10 07 02 49 52 16
(1795334400.200500) pb0 10 02 07 00 09 16 T
(1795334400.300000) pb0 68 05 05 !
";

/// A recording of this text, in a folder of its own.
fn recording(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path: PathBuf = folder.path().join("session.log");
    std::fs::write(&path, text).expect("written");
    let file = path.display().to_string();
    (folder, file)
}

#[test]
fn each_frame_and_telegram_is_a_line_that_says_what_it_means() {
    let (_folder, file) = recording(SESSION);
    let text = printed(&["replay", &file]);
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines.len(), 6, "{text}");
    for (line, parts) in lines.iter().zip([
        ["1795334400.000000 can0", "duplicate MAC ID check request", "vendor 468"],
        ["1795334400.100000 can0", "42D#", "poll"],
        ["1795334400.100250 can0", "3C5#45230100", "position 74565"],
        ["1795334400.200000 pb0", "2 → 7", "FDL status"],
        ["1795334400.200500 pb0", "7 → 2", "10 02 07 00 09 16"],
        ["1795334400.300000 pb0", "68 05 05", "disturbed"],
    ]) {
        for part in parts {
            assert!(line.contains(part), "{part:?} in {line:?}");
        }
    }
}

#[test]
fn with_json_each_line_is_an_object_with_the_same_numbers() {
    let (_folder, file) = recording(SESSION);
    let text = printed(&["replay", &file, "--json"]);
    let records: Vec<Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(records.len(), 6);
    assert_eq!(records[2]["bus"], "can0");
    assert_eq!(records[2]["values"]["position"], 74_565);
    assert_eq!(records[3]["direction"], "received");
    assert_eq!(records[4]["direction"], "sent");
    assert_eq!((&records[4]["from"], &records[4]["to"]), (&7.into(), &2.into()));
}

#[test]
fn a_damaged_recording_shows_what_is_whole_names_the_place_and_exits_1() {
    let damaged = SESSION.replace("3C5#45230100", "3C5#4523010");
    let (_folder, file) = recording(&damaged);
    let output = codewheel(&["replay", &file]);
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(text.contains(&format!("{file}: line 3: ")), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    let shown = String::from_utf8(output.stdout).expect("text");
    assert_eq!(shown.lines().count(), 5, "{shown}");
    assert!(shown.contains("42D#") && shown.contains("10 02 07 00 09 16"), "{shown}");
    // Nor does asking for silence hide it.
    assert!(stderr(&codewheel(&["replay", &file, "--quiet"])).contains("line 3"));
}

#[test]
fn of_a_file_of_something_else_ten_lines_are_complained_of_and_the_others_counted() {
    let (_folder, file) = recording(&"no frame at all\n".repeat(500));
    let output = codewheel(&["replay", &file]);
    assert_eq!(output.status.code(), Some(1));
    let messages = stderr(&output);
    assert_eq!(messages.lines().count(), 11, "{messages}");
    assert!(messages.ends_with("and 490 more places like these\n"), "{messages}");
}

#[test]
fn a_recording_that_was_cut_off_shows_what_came_before() {
    let cut = SESSION.strip_suffix(" 05 !\n").expect("the end");
    let (_folder, file) = recording(cut);
    let output = codewheel(&["replay", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("line 6: "), "{}", stderr(&output));
    assert_eq!(output.stdout.iter().filter(|octet| **octet == b'\n').count(), 5);
}

#[test]
fn what_is_no_traffic_is_passed_over_and_counted() {
    let (_folder, file) = recording("(1795334400.000000) can0 20000004#0000000000000000\n");
    let output = codewheel(&["replay", &file]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stdout.is_empty());
    assert!(
        stderr(&output).contains("no traffic of ours, such as error frames: 1"),
        "{}",
        stderr(&output)
    );
    assert_eq!(stderr(&codewheel(&["replay", &file, "--quiet"])), "");
}

#[test]
fn a_file_that_is_no_recording_or_not_there_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let of = |name: &str| folder.path().join(name).display().to_string();
    let output = codewheel(&["replay", &of("session.csv")]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("write .log, .asc, .trc or .pcapng"));
    let output = codewheel(&["replay", &of("session.log")]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("session.log: the file cannot be read: "));
}

#[cfg(unix)]
#[test]
fn what_the_system_stops_giving_is_an_io_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("folder.log");
    std::fs::create_dir(&path).expect("a folder");
    let output = codewheel(&["replay", path.to_str().expect("text")]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("folder.log: the file cannot be read: "));
}

#[test]
fn whoever_has_read_enough_ends_it() {
    let (_folder, file) = recording(&SESSION.repeat(20_000));
    let mut replay = Running::start(&["replay", &file]);
    assert!(replay.line().contains("duplicate MAC ID check"));
    replay.close_stdout();
    let (status, messages) = replay.end();
    assert_eq!((status.code(), messages.as_str()), (Some(0), ""));
}
