//! `codewheel run` and `codewheel schema`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use crate::prompt::{Client, Running, codewheel, example, stderr};

fn run(file: &Path, more: &[&str]) -> Output {
    codewheel(&[&["run", file.to_str().expect("text")], more].concat())
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The commissioning plant on any free port, in a folder of its own.
fn commissioning() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(example("commissioning.toml")).expect("the example");
    let text = text.replace("slcan-listen:127.0.0.1:4001\"", "slcan-listen:127.0.0.1:0\"");
    let path = folder.path().join("plant.toml");
    std::fs::write(&path, text).expect("written");
    (folder, path)
}

/// Starts it and waits for its address.
fn start_commissioning(path: &Path) -> (Running, String) {
    let mut running = Running::start(&["run", path.to_str().expect("text")]);
    let message = running.message();
    let address = message
        .strip_prefix("codewheel: line-1 on slcan-listen:")
        .and_then(|rest| rest.strip_suffix(": 3 devices, 0 masters"));
    let address = address.unwrap_or_else(|| panic!("not ready: {message:?}")).to_owned();
    (running, address)
}

#[test]
fn the_demo_from_its_file_is_polled_and_ends_after_its_time() {
    let output = run(&example("demo.toml"), &["--for", "3500ms"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(text.lines().count() >= 9, "{text}");
    for (bus, connection) in
        [("bus demo ", "connection polled"), ("bus field ", "connection data-exch")]
    {
        let lines = text.lines().rev().filter(|line| line.contains(bus));
        let last: Vec<_> = lines.take(3).collect();
        assert!(last.len() == 3 && last.iter().all(|line| line.contains(connection)), "{text}");
    }
}

#[test]
fn the_fault_plant_runs_and_says_on_stderr_what_goes_wrong() {
    let output = run(&example("faults.toml"), &["--for", "4500ms"]);
    assert_eq!(output.status.code(), Some(0));
    let messages = stderr(&output);
    assert!(messages.contains("trouble: sensor: position error: the code jumped"), "{messages}");
    assert!(messages.contains("trouble: controller: bus-off: silent"), "{messages}");
    assert!(!messages.contains("allocated"), "that is for --verbose: {messages}");
}

#[test]
fn the_profibus_fault_plant_says_on_stderr_what_goes_wrong() {
    let output = run(&example("profibus-faults.toml"), &["--for", "4s"]);
    assert_eq!(output.status.code(), Some(0));
    let messages = stderr(&output);
    for part in [
        "refuses: parameters refused: Set_Prm octets 14–17: total resolution 536870912 exceeds \
         3600 × 65536 = 235929600",
        "sensor: position error: the code jumped",
        "converter: the SSI data line stays high",
    ] {
        assert!(messages.contains(part), "lacks {part:?}: {messages}");
    }
    assert!(messages.lines().count() < 30, "no flood: {messages}");
}

#[test]
fn a_plant_that_is_only_a_master_shows_the_slaves_it_serves() {
    let bus = ["encoder", "hmg10-p13", "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
    let mut encoder = Running::start(&[&bus[..], &["--shaft", "still angle=4711"]].concat());
    let line = encoder.line();
    let address = line.rsplit_once(" on rs485-listen:").expect("ready").1;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plant.toml");
    let text = format!(
        "[[bus]]\nname = \"b\"\nkind = \"profibus\"\nuri = \"rs485:{address}\"\n\
         [[master]]\naddress = 2\nslave = [{{ address = 7, scaling = false }}]\n"
    );
    std::fs::write(&path, text).expect("written");
    let output = run(&path, &["--for", "3s"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = stdout(&output);
    let line = text.lines().last().unwrap_or_default();
    assert!(line.contains("address 7 position 4711 connection running polls/s "), "{text}");
    let output = run(&path, &["--for", "3s", "--json"]);
    let text = stdout(&output);
    let lines: Vec<Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let last = lines.iter().rfind(|line| line["address"] == 7).expect("the slave");
    assert_eq!((&last["position"], &last["alarm"]), (&4_711.into(), &false.into()));
}

#[test]
fn the_commissioning_plant_serves_a_client_and_keeps_what_was_saved() {
    let (folder, path) = commissioning();
    let (running, address) = start_commissioning(&path);
    let mut client = Client::connect(&address);
    client.allocate();
    assert_eq!(client.ask("0E010106"), "8EE9030000", "serial number 1001");
    assert_eq!(client.set(10, 4_711), "90");
    assert_eq!(client.ask("162F01"), "96");
    drop(client);
    #[cfg(unix)]
    {
        running.signal(rustix::process::Signal::TERM);
        let (status, messages) = running.end();
        assert_eq!(status.code(), Some(0), "{messages}");
    }
    #[cfg(not(unix))]
    drop(running);
    for name in ["spindle.memory", "feed.memory", "table.memory"] {
        assert!(folder.path().join(name).exists(), "{name} is in the folder of the plant file");
    }
    let (_running, address) = start_commissioning(&path);
    let mut client = Client::connect(&address);
    client.allocate();
    assert_eq!(client.ask("0E2F010C"), "8E67120000", "4711 is still there");
}

#[test]
fn the_commissioning_plant_ends_after_its_time_too() {
    let (_folder, path) = commissioning();
    let output = run(&path, &["--for", "3s", "--quiet"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).is_empty(), "{}", stderr(&output));
    let text = stdout(&output);
    for address in ["address 5", "address 6", "address 7"] {
        let polled = text.lines().filter(|line| line.contains(address)).count();
        assert!(polled >= 3, "{text}");
    }
    assert!(text.lines().last().is_some_and(|line| line.ends_with("connection none")), "{text}");
}

#[test]
fn json_is_one_object_a_line_with_what_the_table_shows() {
    let output = run(&example("demo.toml"), &["--for", "3500ms", "--json"]);
    assert_eq!(output.status.code(), Some(0));
    let text = stdout(&output);
    let lines: Vec<Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let last_of = |bus| {
        let of_device = |line: &&Value| line["bus"] == bus && line["device"].is_string();
        lines.iter().rfind(of_device).expect("a line")
    };
    for (key, value) in [
        ("address", Value::from(23)),
        ("product", "HEAG 162 SP 18".into()),
        ("connection", "data-exch".into()),
        ("lamp", "green".into()),
    ] {
        assert_eq!(last_of("field")[key], value, "{key}");
    }
    let last = last_of("demo");
    for (key, value) in [
        ("bus", Value::from("demo")),
        ("address", 12.into()),
        ("product", "AMG 81 D29".into()),
        ("connection", "polled".into()),
        ("lamp", "green".into()),
    ] {
        assert_eq!(last[key], value, "{key} in {last}");
    }
    for key in ["position", "turns", "speed", "polls_per_second", "cycle_ms"] {
        assert!(last[key].is_number(), "{key} in {last}");
    }
    let texts = lines.iter().filter_map(|line| line["events"].as_array()).flatten();
    assert!(texts.clone().any(|event| event["text"] == "on-line"), "{text}");
}

#[test]
fn the_printed_config_is_complete_and_prints_itself() {
    let (folder, path) = commissioning();
    let examples = ["demo.toml", "faults.toml", "profibus.toml", "profibus-faults.toml"];
    for file in examples.map(example).into_iter().chain([path]) {
        let output = run(&file, &["--print-config"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let printed = folder.path().join("printed.toml");
        std::fs::write(&printed, &output.stdout).expect("written");
        let again = run(&printed, &["--print-config"]);
        assert_eq!(stdout(&again), stdout(&output));
        for key in ["kind = ", "baud = ", "termination = ", "shaft = "] {
            assert!(stdout(&output).contains(key), "{}", stdout(&output));
        }
    }
    assert!(!folder.path().join("spindle.memory").exists(), "nothing was started");
}

#[test]
fn a_wrong_file_shows_its_line_and_starts_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plant.toml");
    let device = "[[device]]\nmodel = \"amg11-d29\"\nmemory = \"m\"\n";
    std::fs::write(&path, format!("[[bus]]\nname = \"b\"\n{device}adress = 5\n")).expect("written");
    let output = run(&path, &[]);
    assert_eq!(output.status.code(), Some(2));
    let message = stderr(&output);
    assert!(message.contains("plant.toml:6:1: unknown key `adress`"), "{message}");
    assert!(message.ends_with("6 | adress = 5\n  | ^^^^^^\n"), "{message}");
    assert!(!folder.path().join("m").exists() && output.stdout.is_empty());

    let output = run(&folder.path().join("none.toml"), &[]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("none.toml"));
    let output = run(&path, &["--for", "3"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("as in 10ms or 1.5s"), "{}", stderr(&output));
}

#[test]
fn a_port_that_is_taken_is_an_io_error() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound").to_string();
    let (_folder, path) = commissioning();
    let text = std::fs::read_to_string(&path).expect("written");
    std::fs::write(&path, text.replace("127.0.0.1:0\"", &format!("{address}\""))).expect("written");
    let output = run(&path, &["--for", "3s"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains(&address) && output.stdout.is_empty());
}

#[test]
fn the_schema_is_the_committed_one() {
    let output = codewheel(&["schema"]);
    assert_eq!(output.status.code(), Some(0));
    let committed = std::fs::read_to_string(example("plant.schema.json")).expect("committed");
    assert!(stdout(&output) == committed);
}

#[test]
fn whoever_stops_reading_ends_the_program_quietly() {
    let mut running = Running::start(&["run", example("demo.toml").to_str().expect("text")]);
    running.line();
    running.close_stdout();
    let (status, messages) = running.end();
    assert_eq!(status.code(), Some(0), "{messages}");
    assert_eq!(messages.lines().count(), 3, "two buses and the page: {messages}");

    let encoder = ["encoder", "amg11-d29", "--bus", "slcan-listen:127.0.0.1:0", "--address", "5"];
    let demo = example("demo.toml");
    let print = ["run", demo.to_str().expect("text"), "--print-config"];
    let describe = ["describe", "amg11-d29"];
    let field = ["describe", "amg11-p29"];
    let all: [&[&str]; 7] =
        [&["schema"], &["models"], &["models", "--json"], &describe, &field, &print, &encoder];
    for arguments in all {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = Command::new(env!("CARGO_BIN_EXE_codewheel"))
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(writer)
            .output()
            .expect("the program runs");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).is_empty(), "{arguments:?}: {}", stderr(&output));
    }
}
