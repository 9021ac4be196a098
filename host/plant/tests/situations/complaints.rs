use std::path::Path;

use codewheel_plant::{Plant, PlantError};

const BUS: &str = "[[bus]]\nname = \"b\"\n";
const DEVICE: &str = "[[device]]\nmodel = \"amg11-d29\"\naddress = 5\n";

/// Refuses `text`, showing `line`, with a caret under the first `marked` in it, and saying `parts`.
#[track_caller]
fn refused(text: &str, line: usize, marked: &str, parts: &[&str]) {
    let error = Plant::parse(text, "plant.toml", Path::new("")).expect_err(text).to_string();
    for part in parts {
        assert!(error.contains(part), "lacks {part:?}:\n{error}");
    }
    assert!(error.starts_with(&format!("plant.toml:{line}:")), "not line {line}:\n{error}");
    let shown = text.lines().nth(line - 1).expect("the line");
    let mut lines = error.lines().rev();
    let caret = lines.next().expect("a caret");
    let said = lines.next().expect("the line");
    assert!(said.ends_with(shown), "{error}");
    let place = caret.find('^').expect("a caret");
    assert!(said[place..].starts_with(marked), "the caret is not under {marked:?}:\n{error}");
}

#[test]
fn a_syntax_error_shows_its_line() {
    refused("[[bus]]\nname = b\n", 2, "b", &[]);
    refused("[[bus]\nname = \"b\"\n", 1, "", &[]);
    refused("[[bus]]\nname = \"b\nbaud = \"500k\"\n", 2, "", &[]);
}

#[test]
fn an_unknown_key_shows_its_line_and_the_keys_there_are() {
    refused("[[buss]]\n", 1, "buss", &["unknown key `buss`", "`bus`", "`device`", "`master`"]);
    refused(&format!("{BUS}speed = 1\n"), 3, "speed", &["unknown key `speed`", "`baud`"]);
    let text = format!("{BUS}{DEVICE}adress = 6\n");
    refused(&text, 6, "adress", &["unknown key `adress`", "`address`"]);
    let text = format!("{BUS}{DEVICE}[[device.fault]]\nat = \"1s\"\nkind = \"jump\"\nstep = 1\n");
    refused(&text, 9, "step", &["unknown key `step`", "`steps`"]);
    let text = format!("{BUS}[[master]]\naddress = 0\n[[master.slave]]\naddress = 5\nepr = 1\n");
    refused(&text, 7, "epr", &["unknown key `epr`", "`expected_packet_rate`"]);
}

#[test]
fn a_missing_key_shows_its_table() {
    refused("[[bus]]\nbaud = \"500k\"\n", 1, "[[bus]]", &["missing key `name`"]);
    let text = format!("{BUS}[[device]]\naddress = 5\n");
    refused(&text, 3, "[[device]]", &["missing key `model`"]);
    let text = format!("{BUS}[[device]]\nmodel = \"amg11-d29\"\n");
    refused(&text, 4, "\"amg11", &["missing key `address` (or `switches`)"]);
}

#[test]
fn a_value_that_is_none_shows_what_is_allowed() {
    refused(&format!("{BUS}baud = \"1M\"\n"), 3, "\"1M\"", &["`125k`, `250k`, `500k`"]);
    refused(&format!("{BUS}kind = \"profibus\"\n"), 3, "\"prof", &["devicenet"]);
    refused(&format!("{BUS}uri = \"can0\"\n"), 3, "\"can0\"", &["slcan-listen:HOST:PORT"]);
    refused(&format!("{BUS}loss = 1.5\n"), 3, "1.5", &["0 to 1"]);
    refused(&format!("{BUS}loss = nan\n"), 3, "nan", &["0 to 1"]);
    refused(&format!("{BUS}seed = -1\n"), 3, "-1", &["-1"]);
    refused(&format!("{BUS}seed = \"x\"\n"), 3, "\"x\"", &["a whole number from 0 to 4294967295"]);
    refused(&format!("{BUS}{DEVICE}termination = 1\n"), 6, "1", &["true or false"]);
    refused("device = 5\n", 1, "5", &["integer `5`", "array"]);
    refused("[[bus]]\nname = \"a b\"\n", 2, "\"a b\"", &["one word"]);
    let text = format!("{BUS}[[device]]\nmodel = \"amg12-d29\"\naddress = 5\n");
    refused(&text, 4, "\"amg12", &["no model \"amg12-d29\"", "amg11-d29", "hmg10-d13"]);
    let text = format!("{BUS}[[master]]\naddress = 0\ninterval = \"soon\"\n");
    refused(&text, 5, "\"soon\"", &["'soon'", "as in 10ms"]);
}

#[test]
fn an_address_is_0_to_63_and_switches_tell_the_way_out() {
    for address in ["64", "99", "300", "-1"] {
        let text = format!("{BUS}[[device]]\nmodel = \"amg11-d29\"\naddress = {address}\n");
        refused(&text, 5, address, &["DeviceNet has 0–63", "switches = 99"]);
    }
    for switches in ["100", "-1", "\"5\"", "{ rotary = [0, 10] }", "{ rotary = [5] }", "{}"] {
        let text = format!("{BUS}[[device]]\nmodel = \"amg11-d29\"\nswitches = {switches}\n");
        refused(&text, 5, "", &[]);
    }
    let text = format!("{BUS}{DEVICE}switches = 5\n");
    refused(&text, 6, "5", &["one of the two"]);
    let dips = "switches = { rotary = [0, 5], dip = [false, true, false] }";
    let text = format!("{BUS}[[device]]\nmodel = \"amg11-d29\"\n{dips}\n");
    refused(&text, 5, "{ rotary", &["DIP switches say 500k", "runs at 125k"]);
    refused(&format!("{BUS}[[master]]\naddress = 64\n"), 4, "64", &["DeviceNet has 0–63"]);
}

#[test]
fn a_shaft_is_refused_in_its_own_words() {
    let shaft = |text: &str| format!("{BUS}{DEVICE}shaft = \"{text}\"\n");
    refused(&shaft("trun rpm=60"), 6, "\"trun", &["'trun rpm=60' makes no sense", "turn rpm=R"]);
    refused(&shaft("turn"), 6, "\"turn", &["lacks rpm=R"]);
    refused(&shaft("csv nowhere.csv"), 6, "\"csv", &["cannot read the shaft file", "nowhere.csv"]);
}

#[test]
fn two_stations_at_one_address_need_to_be_meant() {
    let twins = format!("{BUS}{DEVICE}{DEVICE}");
    refused(&twins, 8, "5", &["line 5 has address 5", "duplicate = true"]);
    assert!(Plant::parse(&format!("{twins}duplicate = true\n"), "p", Path::new("")).is_ok());
    let text = format!("{BUS}{DEVICE}duplicate = true\n");
    refused(&text, 6, "true", &["means nothing here", "no station before"]);
    let text = format!("{BUS}{DEVICE}[[master]]\naddress = 5\n");
    refused(&text, 7, "5", &["line 5 has address 5"]);
    let text = format!("{BUS}{}duplicate = true\n", DEVICE.replace("address = 5", "switches = 99"));
    refused(&text, 6, "true", &["the switches give no address"]);
    // Another bus is another matter, and so are two devices with illegal switches.
    let other = "[[bus]]\nname = \"c\"\n";
    let on = |bus: &str| format!("{DEVICE}bus = \"{bus}\"\n");
    let text = format!("{BUS}{other}{}{}", on("b"), on("c"));
    assert!(Plant::parse(&text, "p", Path::new("")).is_ok());
    let off = DEVICE.replace("address = 5", "switches = 77");
    assert!(Plant::parse(&format!("{BUS}{off}{off}"), "p", Path::new("")).is_ok());
}

#[test]
fn a_bus_is_defined_once_and_named_where_there_are_several() {
    refused(DEVICE, 2, "\"amg11", &["missing key `bus`", "no [[bus]]"]);
    refused(&format!("{BUS}{DEVICE}bus = \"c\"\n"), 6, "\"c\"", &["no bus \"c\"", "defines b"]);
    refused(&format!("{BUS}{BUS}"), 4, "\"b\"", &["already"]);
    let two = format!("{BUS}[[bus]]\nname = \"c\"\n");
    refused(&format!("{two}{DEVICE}"), 6, "\"amg11", &["missing key `bus`", "defines b, c"]);
    let listen = "uri = \"slcan-listen:127.0.0.1:4001\"\n";
    let text = format!("{BUS}{listen}[[bus]]\nname = \"c\"\n{listen}");
    refused(&text, 6, "\"slcan", &["another bus is at slcan-listen:127.0.0.1:4001"]);
    let any = listen.replace("4001", "0");
    let text = format!("{BUS}{any}[[bus]]\nname = \"c\"\n{any}");
    assert!(Plant::parse(&text, "p", Path::new("")).is_ok(), "any free port, twice");
}

#[test]
fn a_real_bus_fails_by_itself() {
    let bus = format!("{BUS}uri = \"slcan-listen:127.0.0.1:0\"\n");
    refused(&format!("{bus}loss = 0.1\n"), 4, "0.1", &["loss is for virtual buses"]);
    refused(&format!("{bus}corruption = 0.0\n"), 4, "0.0", &["corruption is for virtual"]);
    let fault = "[[device.fault]]\nat = \"1s\"\nkind = \"bad-transceiver\"\n";
    refused(&format!("{bus}{DEVICE}{fault}"), 9, "\"bad", &["for virtual buses"]);
}

#[test]
fn a_memory_file_belongs_to_one_device() {
    let keeping = |address: u8, path: &str| {
        let device = DEVICE.replace("address = 5", &format!("address = {address}"));
        format!("{device}memory = \"{path}\"\n")
    };
    let text = format!("{BUS}{}{}", keeping(5, "a/m"), keeping(6, "./a/./m"));
    refused(&text, 10, "\"./a", &["the device of line 6 has this memory file"]);
    let text = format!("{BUS}{}{}", keeping(5, "a/m"), keeping(6, "b/m"));
    assert!(Plant::parse(&text, "p", Path::new("")).is_ok());
}

#[test]
fn a_fault_takes_the_keys_of_its_kind() {
    let fault = |keys: &str| format!("{BUS}{DEVICE}[[device.fault]]\nat = \"1s\"\n{keys}\n");
    refused(&fault("kind = \"explosion\""), 8, "\"expl", &["`power-cut`", "`late-answers`"]);
    refused(&fault("kind = \"jump\""), 8, "\"jump", &["missing key `steps`"]);
    refused(&fault("kind = \"late-answers\""), 8, "\"late", &["missing key `delay`"]);
    refused(&fault("kind = \"stuck\"\nfor = \"1s\""), 9, "\"1s\"", &["`for` means nothing"]);
    let text = fault("kind = \"power-cut\"\ncount = 3");
    refused(&text, 9, "3", &["`count` means nothing to this kind, which takes at and for"]);
    refused(&fault("kind = \"power-cut\"\nfor = \"0s\""), 9, "\"0s\"", &["longer than nothing"]);
    refused(&fault("kind = \"drop-answers\"\nprobability = 2.0"), 9, "2.0", &["0 to 1"]);
    refused(&fault("kind = \"cell-low\""), 8, "\"cell", &["amg11-d29 has no lithium cell"]);
    refused(&fault("kind = \"jump\"\nsteps = 1.5"), 9, "1.5", &["1.5"]);
    refused(&format!("{BUS}{DEVICE}[[device.fault]]\nkind = \"stuck\"\n"), 6, "", &["`at`"]);
}

#[test]
fn faults_of_one_kind_come_one_after_the_other() {
    let cut =
        |at: &str| format!("[[device.fault]]\nat = \"{at}\"\nkind = \"power-cut\"\nfor = \"2s\"\n");
    let text = format!("{BUS}{DEVICE}{}{}", cut("5s"), cut("4s"));
    refused(&text, 12, "\"power", &["line 8"]);
    let text = format!("{BUS}{DEVICE}{}{}", cut("2s"), cut("4s"));
    assert!(Plant::parse(&text, "p", Path::new("")).is_ok(), "one ends when the other begins");
}

#[test]
fn a_scan_list_has_each_address_once_and_sensible_rates() {
    let slave = |keys: &str| {
        format!("{BUS}[[master]]\naddress = 0\n[[master.slave]]\naddress = 5\n{keys}\n")
    };
    let text = slave("[[master.slave]]\naddress = 5");
    refused(&text, 8, "5", &["in the scan list already"]);
    refused(&slave("[[master.slave]]\naddress = 0"), 8, "0", &["the master's own address"]);
    for rate in ["70s", "1.5ms", "65536ms"] {
        let text = slave(&format!("expected_packet_rate = \"{rate}\""));
        refused(&text, 7, "\"", &["0 to 65535ms, in whole milliseconds"]);
    }
    refused(&slave("vendor = 468"), 7, "468", &["given together"]);
    refused(&slave("connection = \"strobe\""), 7, "\"strobe", &["poll"]);
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let error = Plant::load(Path::new("/does/not/exist.toml")).unwrap_err();
    assert!(matches!(error, PlantError::Read { .. }));
    assert!(error.to_string().contains("/does/not/exist.toml"), "{error}");
}

#[test]
fn no_text_panics() {
    let whole = std::fs::read_to_string(super::example("faults.toml")).unwrap();
    let mut random = fastrand::Rng::with_seed(5);
    for _ in 0..2_000 {
        let mut octets = whole.clone().into_bytes();
        for _ in 0..random.usize(1..4) {
            let at = random.usize(..octets.len());
            match random.u8(..4) {
                0 => octets.truncate(at.max(1)),
                1 => octets[at] = random.u8(..),
                2 => drop(octets.remove(at)),
                _ => octets.insert(at, b"\"[]=.{}5-\n\t"[random.usize(..11)]),
            }
        }
        if let Err(complaint) = Plant::parse(&String::from_utf8_lossy(&octets), "p", Path::new(""))
        {
            assert!(complaint.line() > 0 && !complaint.to_string().is_empty());
        }
    }
}

#[test]
fn a_connection_takes_only_what_belongs_to_it() {
    let slave = |line: &str| {
        format!("{BUS}[[master]]\naddress = 0\n[[master.slave]]\naddress = 5\n{line}\n")
    };
    refused(&slave("connection = \"bit-strobe\""), 7, "\"bit-strobe\"", &["change-of-state"]);
    refused(&slave("acknowledged = true"), 7, "true", &["only a change-of-state or cyclic"]);
    let cyclic = "connection = \"cyclic\"\nexpected_packet_rate = \"0s\"";
    refused(&slave(cyclic), 8, "\"0s\"", &["at least 1ms"]);
    let inhibited = "connection = \"change-of-state\"\nexpected_packet_rate = \"10ms\"\n\
                     production_inhibit = \"11ms\"";
    refused(&slave(inhibited), 9, "\"11ms\"", &["longer than the expected packet rate, 10ms"]);
}
