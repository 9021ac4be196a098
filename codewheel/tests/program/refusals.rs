//! Bad input: one clear sentence, the right exit status, nothing half started.

use crate::prompt::{Running, codewheel, printed, stderr};

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
    refused(&["describe", "amg11-p18"], 2, &["amg11-p18", "the models are", "heag162-p18"]);
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
fn a_model_is_refused_on_the_wrong_kind_of_bus_with_what_to_write() {
    let on = |model, bus| ["encoder", model, "--bus", bus, "--address", "7"];
    refused(
        &on("amg11-p29", "slcan-listen:127.0.0.1:0"),
        2,
        &["amg11-p29 speaks PROFIBUS", "carries CAN", "write rs485-listen:HOST:PORT"],
    );
    refused(
        &on("amg11-d29", "rs485-listen:127.0.0.1:0"),
        2,
        &["amg11-d29 speaks DeviceNet", "carries RS-485", "slcan-listen:HOST:PORT"],
    );
    refused(&on("amg11-p29", "virtual:x"), 2, &["virtual PROFIBUS", "rs485-listen:HOST:PORT"]);
}

#[test]
fn a_profibus_encoder_takes_its_own_addresses_and_rates() {
    let with = |more: &[&'static str]| {
        let bus = ["encoder", "amg11-p29", "--bus", "rs485-listen:127.0.0.1:0"];
        [&bus, more].concat()
    };
    for address in ["100", "-1", "seven", ""] {
        refused(&with(&["--address", address]), 2, &["PROFIBUS encoder have 0–99"]);
    }
    refused(&with(&["--address", "7", "--baud", "125k"]), 2, &["9.6k", "45.45k", "12M"]);
}

#[test]
fn a_fault_and_an_ssi_line_that_make_no_sense_are_refused() {
    let with = |model, more: &[&'static str]| {
        let bus = ["encoder", model, "--bus", "rs485-listen:127.0.0.1:0", "--address", "7"];
        [&bus, more].concat()
    };
    for (fault, parts) in [
        ("jump at=5s", ["--fault 'jump at=5s'", "missing key `steps`"]),
        ("jump steps=5", ["--fault 'jump steps=5'", "missing key `at`"]),
        ("jmup steps=5 at=5s", ["unknown value `jmup`", "`power-cut`"]),
        ("jump 4000", ["\"4000\" is no key=value", "steps=4000"]),
        ("stuck at=5", ["5", "as in 10ms or 1.5s"]),
        ("cell-low at=1s", ["amg11-p29 has no lithium cell", "--fault"]),
        ("bad-transceiver at=1s", ["for virtual buses", "--fault"]),
        ("ssi-short at=1s", ["no SSI line", "HEAG 162"]),
        ("", ["say what goes wrong", "--fault"]),
    ] {
        refused(&with("amg11-p29", &["--fault", fault]), 2, &parts);
    }
    refused(&with("amg11-p29", &["--ssi-word", "29"]), 2, &["amg11-p29 has a shaft"]);
    refused(&with("heag162-p29", &["--ssi-word", "13"]), 2, &["29 or 25"]);
    refused(&with("heag162-p29", &["--ssi-clock", "9M"]), 2, &["100000 to 1000000"]);
    refused(&with("heag162-p29", &["--ssi", "/dev/spidev0.0"]), 2, &["spidev:FILE"]);
    #[cfg(target_os = "linux")]
    refused(&with("heag162-p29", &["--ssi", "spidev:/does/not/exist"]), 3, &["/does/not/exist"]);
}

#[test]
fn a_profibus_model_is_described_from_its_switches_to_its_diagnosis() {
    let text = String::from_utf8(codewheel(&["describe", "heag162-p29"]).stdout).expect("text");
    for part in [
        "059Bh",
        "9.6k, 19.2k, 45.45k",
        "none (SSI)",
        "29 (default) or 25 bits",
        "station address 0–99",
        "390 Ω A to GND, 390 Ω B to +5 V, 220 Ω A to B",
        "UB, GND",
        "yellow",
        "200 m           at 1.5M",
        "F1h",
        "14–17",
        "total-resolution",
        "32–35",
        "PB29DPV0.GSD",
    ] {
        assert!(text.contains(part), "lacks {part:?}:\n{text}");
    }
    let text = String::from_utf8(codewheel(&["describe", "amg81-p29"]).stdout).expect("text");
    assert!(
        text.contains("solid")
            && text.contains("yes, with a low-voltage")
            && !text.contains("SSI input")
    );
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
fn the_help_of_every_verb_with_choices_has_examples() {
    let verbs = [
        "run",
        "encoder",
        "describe",
        "eds",
        "gsd",
        "hilo",
        "doctor",
        "replay",
        "scan",
        "identify",
        "get",
        "set",
        "preset",
        "save",
        "restore",
        "reset",
        "watch",
        "backup",
        "diff",
        "apply",
        "passport",
        "completions",
        "man",
    ];
    for verb in verbs {
        let help = printed(&[verb, "--help"]);
        let example = format!("\n  codewheel {verb} ");
        assert!(help.contains("Examples:") && help.contains(&example), "{help}");
    }
}

#[test]
fn models_are_listed_for_people_and_for_programs() {
    let text = String::from_utf8(codewheel(&["models"]).stdout).expect("text");
    assert_eq!(text.lines().count(), 24);
    let json = String::from_utf8(codewheel(&["models", "--json"]).stdout).expect("text");
    let lines: Vec<serde_json::Value> =
        json.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines.len(), 23);
    assert_eq!(lines[1]["model"], "amg11-d29");
    assert_eq!(lines[1]["revolutions"], 65_536);
    assert_eq!(lines[1]["product_code"], 10);
    assert_eq!(lines[1]["eds_file"], "AMG11D29.eds");
    assert_eq!(lines[21]["model"], "heag162-p18");
    assert_eq!(lines[21]["ident_number"], 0x059B);
    assert_eq!(lines[21]["gsd_file"], "PB18DPV0.GSD");
    assert_eq!(lines[21]["shaft"], "none (SSI)");
    assert!(lines[21]["product_code"].is_null() && lines[1]["ident_number"].is_null());
    for line in lines {
        let model = line["model"].as_str().expect("a name");
        let text = String::from_utf8(codewheel(&["describe", model]).stdout).expect("text");
        assert!(text.contains("steps-per-turn"), "{text}");
    }
}
