use std::path::Path;

use codewheel_plant::{AnyBusPlan, FieldBus, Plant, SlaveState, VirtualBus};

use super::{at, device, example, only_bus, plant};

const EXAMPLES: [&str; 7] = [
    "demo.toml",
    "bench.toml",
    "commissioning.toml",
    "faults.toml",
    "hundred.toml",
    "profibus.toml",
    "profibus-faults.toml",
];

#[test]
fn the_printed_plant_reads_back_to_the_same_plant_and_text() {
    for name in EXAMPLES {
        let plant = Plant::load(&example(name)).unwrap_or_else(|error| panic!("{error}"));
        let text = plant.to_text();
        let again = Plant::parse(&text, "printed", Path::new("/somewhere/else"));
        let again = again.unwrap_or_else(|complaint| panic!("{complaint}\n{text}"));
        assert_eq!(again, plant, "{name}");
        assert_eq!(again.to_text(), text, "{name}");
    }
}

#[test]
fn a_plant_with_every_key_reads_back_too() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("wave form.csv"), "0,0\n1,2\n").unwrap();
    let text = r#"
        [[bus]]
        name = "a"
        baud = "250k"
        loss = 0.25
        corruption = 0.125
        seed = 4294967295
        [[bus]]
        name = "b"
        uri = "slcan-listen:[::1]:0"
        [[device]]
        bus = "b"
        model = "HMG10-D13"
        switches = { rotary = [1, 2], dip = [true, true, true] }
        memory = "one two/memory"
        [[device]]
        bus = "a"
        name = "ü \" \\ '"
        model = "amg11-d29"
        switches = 80
        shaft = "csv wave form.csv angle=5"
        serial = 4294967295
        fault = [
            { at = "1.5s", kind = "jump", steps = -2147483648 },
            { at = "250us", kind = "late-answers", delay = "1h" },
        ]
        [[master]]
        bus = "a"
        address = 63
        interval = "0s"
        interscan_delay = "2ms"
        termination = false
        slave = [{ address = 62, expected_packet_rate = "0s", assembly = 2, vendor = 468,
                   product_code = 10 }]
        [[master]]
        bus = "b"
        address = 12
        duplicate = true
        slave = []
    "#;
    let plant = Plant::parse(text, "p", folder.path()).unwrap_or_else(|error| panic!("{error}"));
    let printed = plant.to_text();
    let again = Plant::parse(&printed, "printed", Path::new(""));
    let again = again.unwrap_or_else(|complaint| panic!("{complaint}\n{printed}"));
    assert_eq!(again, plant);
    assert!(printed.contains("dip = [") && printed.contains("switches = 80"), "{printed}");
}

#[test]
fn a_profibus_with_every_key_reads_back_too() {
    let text = r#"
        [[bus]]
        name = "a"
        kind = "profibus"
        baud = "93.75k"
        cable_m = 1200
        loss = 0.5
        corruption = 0.25
        broken = 0.125
        flipped = 0.0625
        pause = 1.0
        seed = 1
        [[bus]]
        name = "b"
        kind = "profibus"
        uri = "rs485:/dev/ttyUSB0"
        baud = "19200"
        [[device]]
        bus = "a"
        model = "HEAG162-P29"
        switches = { rotary = [9, 9] }
        termination = true
        auto_baud = false
        shaft = "turn rpm=1"
        ssi = { word = 25, code = "binary", clock = "0.25M", monoflop = "30us", double_read = true }
        fault = [
            { at = "1s", kind = "ssi-unplugged" }, { at = "2s", kind = "ssi-short" },
            { at = "3s", kind = "ssi-wrong-word", bits = 29 }, { at = "4s", kind = "ssi-right" },
            { at = "5s", kind = "ssi-no-monoflop" },
            { at = "6s", kind = "ssi-flipped-bits", bits = 4096 },
        ]
        [[device]]
        bus = "b"
        model = "heag162-p13"
        switches = 0
        auto_baud = true
        ssi = { line = "spidev:/dev/spidev0.0" }
        [[master]]
        bus = "a"
        kind = "dp-master"
        address = 125
        slot_bits = 1000
        min_station_delay = 100
        watchdog = "0s"
        highest_station_address = 126
        gap_wait_rotations = 100
        retries = 15
        token_rotation_bits = 256
        termination = false
        [[master.slave]]
        address = 99
        class = 1
        configuration = "D0"
        direction = "ccw"
        groups = [1, 8]
        [[master.slave]]
        address = 98
        configuration = "F0"
        scaling = true
        steps_per_turn = 3600
        [[master.slave.preset]]
        at = "1s"
        value = 32767
        [[master]]
        bus = "b"
        address = 1
    "#;
    let before = plant(text);
    let printed = before.to_text();
    let again = plant(&printed);
    assert_eq!(again, before, "{printed}");
    assert_eq!(again.to_text(), printed);
    for part in ["baud = \"19.2k\"", "clock = \"250k\"", "total_resolution = 235929600"] {
        assert!(printed.contains(part), "{part}\n{printed}");
    }
}

#[test]
fn the_demo_polls_three_encoders_and_sees_what_their_shafts_do() {
    let [AnyBusPlan::DeviceNet(plan), _] =
        <[AnyBusPlan; 2]>::try_from(Plant::load(&example("demo.toml")).unwrap().buses).unwrap()
    else {
        panic!("a DeviceNet first")
    };
    let rate = the_demo_moves(VirtualBus::power_up(plan).unwrap());
    assert!((99.0..=101.0).contains(&rate), "{rate}");
}

#[test]
fn the_profibus_of_the_demo_does_too_as_fast_as_it_can() {
    let [_, AnyBusPlan::Profibus(plan)] =
        <[AnyBusPlan; 2]>::try_from(Plant::load(&example("demo.toml")).unwrap().buses).unwrap()
    else {
        panic!("a PROFIBUS second")
    };
    let rate = the_demo_moves(VirtualBus::power_up(plan).unwrap());
    assert!(rate > 500.0, "{rate}");
}

/// Sees three encoders polled whose shafts turn; answers a second of the first.
fn the_demo_moves<B: FieldBus>(mut bus: VirtualBus<B>) -> f64 {
    let first = at(&mut bus, 3_000);
    let trouble = first.reports.iter().any(|report| report.what.is_trouble());
    assert!(!trouble, "it is wired well: {:?}", first.reports);
    let second = at(&mut bus, 4_000);
    assert_eq!(second.devices.len(), 3);
    for (before, after) in first.devices.iter().zip(&second.devices) {
        let (master, device) = (after.master.as_ref().unwrap(), after.device.as_ref().unwrap());
        assert_eq!(master.state, SlaveState::Running);
        assert_ne!(before.master.as_ref().unwrap().position, master.position, "the shaft turns");
        assert_ne!(device.velocity, 0);
        let off = i64::from(device.position) - i64::from(master.position.unwrap());
        assert!(off.unsigned_abs() < 2_000, "{off} steps in the 10 ms since the last poll");
    }
    assert!(second.load.is_some_and(|load| load > 0.01 && load < 0.9));
    assert!(second.masters[0].on_line && second.masters[0].cycle.count > 90);
    second.devices[0].master.unwrap().answers_per_second
}

#[test]
fn the_fault_plant_shows_every_fault_and_is_sound_again_at_the_end() {
    let plan = only_bus(Plant::load(&example("faults.toml")).unwrap());
    let mut bus = VirtualBus::power_up(plan).unwrap();
    let snapshot = at(&mut bus, 20_000);
    for name in ["sensor", "device", "controller"] {
        let master = device(&snapshot, name).master.as_ref().unwrap();
        assert_eq!(master.state, SlaveState::Running, "{name}");
    }
    for name in ["twin", "misread"] {
        let lamp = device(&snapshot, name).device.as_ref().unwrap().lamp;
        assert_eq!(lamp.to_string(), "red", "{name}");
    }
}

#[test]
fn the_committed_schema_is_the_one_the_program_prints() {
    let path = example("plant.schema.json");
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == codewheel_plant::schema(),
        "examples/plant.schema.json is out of date: \
         cargo run -- schema > examples/plant.schema.json"
    );
}

/// Every key of every table, with the properties of its schema.
fn keys(schema: &serde_json::Value) -> Vec<String> {
    let definitions = schema["$defs"].as_object().into_iter().flatten();
    let tables = definitions.filter_map(|(_, table)| table["properties"].as_object());
    tables.flat_map(|table| table.keys().cloned()).collect()
}

#[test]
fn the_schema_knows_every_key_that_is_printed_and_forbids_others() {
    let schema: serde_json::Value = serde_json::from_str(&codewheel_plant::schema()).unwrap();
    let known = keys(&schema);
    let text = |name| Plant::load(&example(name)).unwrap().to_text();
    let text = text("faults.toml") + &text("profibus-faults.toml");
    for line in text.lines().filter_map(|line| line.split_once(" = ")) {
        assert!(known.iter().any(|key| key == line.0), "{}", line.0);
    }
    let tables = [
        "BusTable",
        "DeviceTable",
        "SsiTable",
        "FaultTable",
        "MasterTable",
        "SlaveTable",
        "PresetTable",
    ];
    for table in tables {
        assert_eq!(schema["$defs"][table]["additionalProperties"], false, "{table}");
    }
    let models = schema["$defs"]["DeviceTable"]["properties"]["model"]["enum"].as_array();
    assert_eq!(models.map(Vec::len), Some(23));
}
