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
    refused(&format!("{BUS}kind = \"modbus\"\n"), 3, "\"mod", &["devicenet", "profibus"]);
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
    let read = |name| std::fs::read_to_string(super::example(name)).unwrap();
    let wholes = [read("faults.toml"), read("profibus-faults.toml")];
    let mut random = fastrand::Rng::with_seed(5);
    for round in 0..2_000 {
        let whole = &wholes[round % 2];
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

const FIELD: &str = "[[bus]]\nname = \"f\"\nkind = \"profibus\"\n";
const SLAVE: &str = "[[device]]\nmodel = \"amg11-p29\"\naddress = 7\n";

#[test]
fn a_rate_of_the_other_bus_is_refused_with_those_of_this_one() {
    let text = format!("{FIELD}baud = \"125k\"\n");
    refused(&text, 4, "\"125k\"", &["no rate of a PROFIBUS", "`9.6k`", "`12M`"]);
    let text = format!("{BUS}baud = \"1.5M\"\n");
    refused(&text, 3, "\"1.5M\"", &["no rate of a DeviceNet", "`125k`"]);
}

#[test]
fn a_cable_is_no_longer_than_its_rate_allows() {
    let cable = |baud: &str, metres: u32| format!("{FIELD}baud = \"{baud}\"\ncable_m = {metres}\n");
    refused(&cable("1.5M", 250), 5, "250", &["at 1.5M it is at most 200 m", "or take 500k"]);
    refused(&cable("9.6k", 1_300), 5, "1300", &["at most 1200 m", "repeater"]);
    for (baud, longest) in
        [("9.6k", 1_200), ("187.5k", 1_000), ("500k", 400), ("1.5M", 200), ("12M", 100)]
    {
        assert!(Plant::parse(&cable(baud, longest), "p", Path::new("")).is_ok(), "{baud}");
        refused(&cable(baud, longest + 1), 5, "", &[&format!("at most {longest} m")]);
    }
    refused(&format!("{BUS}cable_m = 10\n"), 3, "10", &["`cable_m` means nothing", "PROFIBUS"]);
}

#[test]
fn a_bus_is_where_its_medium_is() {
    let text = format!("{FIELD}uri = \"slcan:127.0.0.1:4001\"\n");
    refused(&text, 4, "\"slcan", &["carries CAN", "PROFIBUS runs on RS-485", "rs485-listen:"]);
    let text = format!("{BUS}uri = \"rs485:/dev/ttyUSB0\"\n");
    refused(&text, 3, "\"rs485", &["carries RS-485", "DeviceNet runs on CAN", "slcan-listen:"]);
}

#[test]
fn a_device_and_a_master_belong_to_their_bus() {
    let text = format!("{FIELD}{DEVICE}");
    refused(&text, 5, "\"amg11-d29\"", &["speaks DeviceNet", "f is a PROFIBUS", "heag162-p18"]);
    refused(&format!("{BUS}{SLAVE}"), 4, "\"amg11-p29\"", &["speaks PROFIBUS", "amg11-d29"]);
    let text = format!("{FIELD}[[master]]\nkind = \"scanner\"\naddress = 2\n");
    refused(&text, 5, "\"scanner\"", &["its masters are of kind \"dp-master\""]);
    let text = format!("{FIELD}[[master]]\naddress = 2\ninterval = \"10ms\"\n");
    refused(&text, 6, "\"10ms\"", &["`interval` means nothing", "scanner"]);
    let text = format!("{BUS}[[master]]\naddress = 2\nslot_bits = 300\n");
    refused(&text, 5, "300", &["`slot_bits` means nothing", "DP master"]);
    let text = format!("{BUS}{DEVICE}auto_baud = true\n");
    refused(&text, 6, "true", &["`auto_baud` means nothing"]);
}

#[test]
fn a_profibus_address_is_what_two_rotary_switches_say() {
    for address in ["100", "-1", "300"] {
        let text = format!("{FIELD}[[device]]\nmodel = \"amg11-p29\"\naddress = {address}\n");
        refused(&text, 6, address, &["0–99"]);
    }
    let text = format!(
        "{FIELD}[[device]]\nmodel = \"amg11-p29\"\nswitches = {{ rotary = [0, 7], dip = [true, true, true] }}\n"
    );
    refused(&text, 6, "{ rotary", &["no DIP switches", "termination = true"]);
    refused(&format!("{FIELD}[[master]]\naddress = 126\n"), 5, "126", &["0–125"]);
    let text = format!("{FIELD}{SLAVE}{SLAVE}");
    refused(&text, 9, "7", &["line 6 has address 7", "duplicate = true"]);
}

#[test]
fn a_rate_is_searched_only_where_there_is_one() {
    for uri in ["rs485-listen:127.0.0.1:0", "rs485-listen:pty:./pb", "rs485:127.0.0.1:4002"] {
        let text = format!("{FIELD}uri = \"{uri}\"\n{SLAVE}auto_baud = true\n");
        refused(&text, 8, "true", &["no rate to search for"]);
    }
    let text = format!("{FIELD}uri = \"rs485:/dev/ttyUSB0\"\n{SLAVE}auto_baud = true\n");
    assert!(Plant::parse(&text, "p", Path::new("")).is_ok());
}

#[test]
fn an_ssi_line_is_for_a_converter_and_read_as_it_can_be() {
    let text = format!("{FIELD}{SLAVE}ssi = {{ word = 29 }}\n");
    refused(&text, 7, "{ word", &["`ssi` means nothing", "amg11-p29 has a shaft"]);
    let ssi = |keys: &str| {
        format!("{FIELD}[[device]]\nmodel = \"heag162-p29\"\naddress = 7\nssi = {{ {keys} }}\n")
    };
    refused(&ssi("word = 13"), 7, "13", &["no words of 13 bits", "29 or 25"]);
    refused(&ssi("clock = \"2M\""), 7, "\"2M\"", &["100000 to 1000000"]);
    refused(&ssi("clock = \"fast\""), 7, "\"fast\"", &["as 500k"]);
    refused(&ssi("monoflop = \"1us\""), 7, "\"1us\"", &["longer than a period"]);
    refused(&ssi("code = \"grey\""), 7, "\"grey\"", &["`gray`", "`binary`"]);
    refused(&ssi("line = \"/dev/spidev0.0\""), 7, "\"/dev", &["spidev:FILE"]);
    let fault = |kind: &str, line: usize, parts: &[&str]| {
        let text = format!("{FIELD}{SLAVE}[[device.fault]]\nat = \"1s\"\nkind = \"{kind}\"\n");
        refused(&text, line, &format!("\"{kind}"), parts);
    };
    fault("ssi-short", 9, &["amg11-p29 has no SSI line"]);
    fault("bus-off", 9, &["for CAN"]);
    fault("cell-low", 9, &["no lithium cell"]);
    let fault = "\n[[device.fault]]\nat = \"1s\"\nkind = ";
    let real = ssi("line = \"spidev:/dev/spidev0.0\"");
    refused(&format!("{real}{fault}\"jump\"\nsteps = 1\n"), 11, "\"jump", &["fails by itself"]);
    let text = format!("{}{fault}\"ssi-wrong-word\"\nbits = 33\n", ssi(""));
    refused(&text, 12, "33", &["1 to 32"]);
}

#[test]
fn a_dp_master_takes_settings_that_there_are() {
    let master = |keys: &str| format!("{FIELD}[[master]]\naddress = 2\n{keys}\n");
    refused(&master("slot_bits = 20"), 6, "20", &["300 to 16383"]);
    refused(&master("min_station_delay = 5"), 6, "5", &["11 to 255"]);
    refused(&master("retries = 0"), 6, "0", &["1 to 15"]);
    refused(&master("watchdog = \"1ms\""), 6, "\"1ms\"", &["10 ms to 650 s"]);
    refused(&master("highest_station_address = 2"), 6, "2", &["above"]);
    refused(&master("gap_wait_rotations = 101"), 6, "101", &["1 to 100"]);
    refused(&master("token_rotation_bits = 1"), 6, "1", &["256"]);
}

#[test]
fn a_slave_of_a_dp_master_takes_what_its_class_and_configuration_have() {
    let slave = |keys: &str| {
        format!("{FIELD}[[master]]\naddress = 2\n[[master.slave]]\naddress = 7\n{keys}\n")
    };
    refused(&slave("class = 3"), 8, "3", &["1 or 2"]);
    refused(&slave("configuration = \"E0\""), 8, "\"E0\"", &["`F1`", "`D0`"]);
    refused(&slave("class = 1\nscaling = true"), 9, "true", &["class 1 has no scaling"]);
    refused(&slave("class = 1\nsteps_per_turn = 9"), 9, "9", &["without scaling"]);
    refused(&slave("groups = [0]"), 8, "[0]", &["1 to 8"]);
    refused(&slave("assembly = 2"), 8, "2", &["`assembly` means nothing"]);
    let preset = "[[master.slave.preset]]\nat = \"1s\"\nvalue = ";
    let with = |keys: &str, value: &str| slave(&format!("{keys}\n{preset}{value}"));
    refused(&with("configuration = \"D1\"", "1"), 10, "\"1s\"", &["D1 carries no preset"]);
    refused(&with("class = 1", "1"), 10, "\"1s\"", &["class 1 has no preset"]);
    refused(&with("configuration = \"F0\"", "32768"), 11, "32768", &["15 bits"]);
    refused(&with("", "2147483648"), 11, "2147483648", &["31 bits"]);
    let text = with("", &format!("1\n{}2", preset.replace("1s", "500ms")));
    refused(&text, 13, "\"500ms\"", &["in the order of their time"]);
    let text = slave("[[master.slave]]\naddress = 7");
    refused(&text, 9, "7", &["in the scan list already"]);
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
