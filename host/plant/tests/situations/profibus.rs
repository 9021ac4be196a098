//! PROFIBUS segments in virtual time.

use codewheel_plant::{Plant, Profibus, SlaveState, VirtualBus};
use codewheel_sim::rs485::Event;

use super::{at, device, example, millis, only_profibus, plant, told};

/// A master at 2 with `slave`, and one encoder at 7 with `keys`.
fn bus(baud: &str, model: &str, keys: &str, slave: &str) -> VirtualBus<Profibus> {
    let text = format!(
        "[[bus]]\nname = \"b\"\nkind = \"profibus\"\nbaud = \"{baud}\"\n\
         [[device]]\nname = \"encoder\"\nmodel = \"{model}\"\naddress = 7\ntermination = true\n\
         {keys}\n[[master]]\naddress = 2\nslave = [{{ address = 7, {slave} }}]\n"
    );
    VirtualBus::power_up(only_profibus(plant(&text))).unwrap()
}

/// What the master knows of the encoder's position, and the encoder itself.
fn positions(bus: &mut VirtualBus<Profibus>, moment: u64) -> (Option<u32>, u32) {
    let snapshot = at(bus, moment);
    let device = device(&snapshot, "encoder");
    let master = device.master.as_ref().expect("a master");
    (master.position, device.device.as_ref().expect("power").position)
}

#[test]
fn at_every_rate_the_encoder_finds_it_and_the_master_polls_the_position_of_its_shaft() {
    let rates = ["9.6k", "19.2k", "45.45k", "93.75k", "187.5k", "500k", "1.5M", "3M", "6M", "12M"];
    for baud in rates {
        let shaft = "shaft = \"turn rpm=6\"";
        let mut bus = bus(baud, "amg11-p29", shaft, "configuration = \"F1\"");
        let snapshot = at(&mut bus, 4_000);
        let seen = device(&snapshot, "encoder").master.as_ref().unwrap();
        assert_eq!(seen.state, SlaveState::Running, "{baud}");
        assert_eq!(bus.statistics().violations, 0, "{baud}");
        // A tenth of a turn in the time of a bus cycle, which is 50 ms at 9.6k.
        let (master, device) = positions(&mut bus, 4_100);
        let late = device - master.expect("a position");
        assert!(late < 60, "{late} steps behind at {baud}");
        assert!((3_300..3_400).contains(&device), "{device} at {baud}");
    }
}

#[test]
fn an_encoder_that_is_told_its_rate_is_not_heard_at_another_one() {
    let text = r#"
        [[bus]]
        name = "b"
        kind = "profibus"
        baud = "500k"
        [[device]]
        name = "encoder"
        model = "amg11-p13"
        address = 7
        auto_baud = false
        [[master]]
        address = 2
    "#;
    let mut plan = only_profibus(plant(text));
    plan.masters[0].settings.baud_rate = codewheel_plant::Profibus::rate("1500000").unwrap();
    plan.masters[0].settings.slot_bits = None;
    let mut bus = VirtualBus::power_up(plan).unwrap();
    let snapshot = at(&mut bus, 1_000);
    let seen = device(&snapshot, "encoder").master.as_ref().unwrap();
    assert_eq!(seen.state, SlaveState::Absent);
}

#[test]
fn a_preset_of_the_plan_is_executed_once_and_outlives_a_power_cut() {
    let cut = "fault = [{ at = \"3s\", kind = \"power-cut\" }]\nshaft = \"still angle=1000\"";
    let presets = "preset = [{ at = \"1s\", value = 42 }, { at = \"2s\", value = 43 }]";
    let mut bus = bus("500k", "amg11-p29", cut, presets);
    assert_eq!(positions(&mut bus, 999), (Some(1_000), 1_000));
    assert_eq!(positions(&mut bus, 1_100), (Some(42), 42));
    assert_eq!(positions(&mut bus, 2_100), (Some(43), 43));
    let snapshot = at(&mut bus, 2_200);
    assert_eq!(device(&snapshot, "encoder").device.as_ref().unwrap().writes, 2);
    assert!(device(&at(&mut bus, 3_500), "encoder").device.is_none());
    assert_eq!(positions(&mut bus, 6_000), (Some(43), 43), "with the parameters it was made under");
}

/// PROFIBUS manual §7.4: once with the top bit and then again without it.
#[test]
fn a_preset_is_sent_twice_with_the_top_bit_and_without_it() {
    let mut bus = bus("500k", "amg11-p29", "", "preset = [{ at = \"1s\", value = 42 }]");
    let mut outputs: Vec<[u8; 4]> = Vec::new();
    bus.run_until(millis(2_000), &mut |event| {
        if let Event::Telegram { octets, .. } = event
            && let [0x68, 7, 7, 0x68, 7, 2, _, first, second, third, last, _, 0x16] =
                *octets.octets()
        {
            outputs.push([first, second, third, last]);
        }
    });
    outputs.dedup();
    assert_eq!(outputs, [[0; 4], [0x80, 0, 0, 42], [0, 0, 0, 42]]);
}

#[test]
fn a_power_cut_while_a_preset_is_written_leaves_the_old_or_the_new_one() {
    let (mut kept, mut lost) = (0, 0);
    for cut in 0..16 {
        let faults = format!(
            "shaft = \"still angle=1000\"\nfault = [{{ at = \"{}us\", kind = \"power-cut\", \
             for = \"100ms\" }}]",
            1_000_000 + cut * 1_500
        );
        let presets = "preset = [{ at = \"500ms\", value = 7 }, { at = \"1s\", value = 42 }]";
        let mut bus = bus("187.5k", "amg11-p29", &faults, presets);
        at(&mut bus, 999);
        let snapshot = at(&mut bus, 1_105 + cut * 3 / 2);
        let encoder = device(&snapshot, "encoder").device.as_ref().expect("power again");
        assert_ne!(encoder.memory, codewheel_device::MemoryState::Damaged);
        match encoder.saved.offset {
            offset if offset == 42 - 1_000 => kept += 1,
            offset if offset == 7 - 1_000 => lost += 1,
            other => panic!("offset {other} after a cut at {cut}"),
        }
        // The master gives a preset again whose fate it cannot know.
        assert!([Some(7), Some(42)].contains(&positions(&mut bus, 5_000).0));
    }
    assert!(kept >= 3 && lost >= 3, "{kept} {lost}");
}

#[test]
fn a_jump_is_an_alarm_in_the_diagnosis_and_over_after_two_and_a_half_seconds() {
    let jump = "fault = [{ at = \"2s\", kind = \"jump\", steps = 4000 }]";
    let mut bus = bus("500k", "amg11-p29", jump, "class = 2");
    let mut seen = |moment| {
        let snapshot = at(&mut bus, moment);
        let encoder = device(&snapshot, "encoder");
        let alarm = encoder.master.as_ref().unwrap().diagnosis.map(|diagnosis| diagnosis.alarm);
        (alarm, encoder.device.as_ref().unwrap().lamp.to_string())
    };
    assert_eq!(seen(1_990), (Some(false), "green".into()));
    assert_eq!(seen(2_020), (Some(true), "red".into()));
    assert_eq!(seen(4_490), (Some(true), "red".into()));
    assert_eq!(seen(4_520), (Some(false), "green".into()));
}

#[test]
fn a_low_cell_is_a_warning_in_the_diagnosis_and_the_position_goes_on() {
    let cell = "fault = [{ at = \"2s\", kind = \"cell-low\" }, { at = \"3s\", kind = \
                \"cell-right\" }]\nshaft = \"turn rpm=60\"";
    let mut bus = bus("500k", "amg81-p29", cell, "class = 2");
    let mut warning = |moment| {
        let snapshot = at(&mut bus, moment);
        let master = device(&snapshot, "encoder").master.unwrap();
        assert_eq!(master.state, SlaveState::Running);
        master.diagnosis.map(|diagnosis| (diagnosis.alarm, diagnosis.warning))
    };
    assert_eq!(warning(1_990), Some((false, false)));
    assert_eq!(warning(2_500), Some((false, true)));
    assert_eq!(warning(3_500), Some((false, false)));
}

#[test]
fn refused_parameters_are_told_in_full_a_few_times_and_then_counted() {
    let scaling = "steps_per_turn = 3600, total_resolution = 536870912";
    let mut bus = bus("500k", "amg11-p29", "", scaling);
    let mut refused: Vec<String> = told(&at(&mut bus, 12_000), "encoder");
    refused.retain(|text| text.contains("refused"));
    let sentence = "parameters refused: Set_Prm octets 14–17: total resolution 536870912 exceeds \
                    3600 × 65536 = 235929600";
    assert_eq!(refused[0], sentence);
    assert!(refused.len() < 20, "{refused:#?}");
    assert!(refused.iter().any(|text| text.ends_with(" times)")), "{refused:#?}");
    let snapshot = at(&mut bus, 12_010);
    assert_eq!(
        device(&snapshot, "encoder").device.as_ref().unwrap().lamp.to_string(),
        "red flashing"
    );
    assert_eq!(device(&snapshot, "encoder").master.as_ref().unwrap().state, SlaveState::Refused);
}

#[test]
fn a_converter_reads_the_word_of_the_encoder_at_its_line_and_holds_its_position_without_it() {
    let keys = "shaft = \"turn rpm=600\"\nssi = { word = 25, code = \"binary\" }\nfault = [\
                { at = \"2s\", kind = \"ssi-unplugged\" }, { at = \"3s\", kind = \"ssi-right\" }]";
    let mut bus = bus("500k", "heag162-p29", keys, "direction = \"ccw\"");
    let range = 1 << 25;
    let (before, _) = positions(&mut bus, 1_999);
    let expected = range - 8_192 * 20;
    assert!(before.unwrap().abs_diff(expected) < 200, "{before:?}");
    let snapshot = at(&mut bus, 2_500);
    let held = device(&snapshot, "encoder").master.unwrap().position;
    assert!(told(&snapshot, "encoder").iter().any(|text| text.contains("stays high")));
    let snapshot = at(&mut bus, 2_900);
    let encoder = device(&snapshot, "encoder");
    assert_eq!(encoder.master.unwrap().position, held, "held");
    assert!(encoder.master.unwrap().diagnosis.unwrap().alarm);
    let (after, _) = positions(&mut bus, 6_000);
    assert!(after.unwrap().abs_diff(range - 8_192 * 60) < 200, "{after:?}");
    let snapshot = at(&mut bus, 6_010);
    assert!(!device(&snapshot, "encoder").master.unwrap().diagnosis.unwrap().alarm);
}

#[test]
fn dropped_late_and_destroyed_answers_end_the_exchange_and_it_comes_back() {
    for fault in [
        r#"{ at = "2s", kind = "drop-answers", for = "500ms" }"#,
        r#"{ at = "2s", kind = "late-answers", delay = "2ms", for = "500ms" }"#,
        r#"{ at = "2s", kind = "bad-transceiver", for = "500ms" }"#,
        r#"{ at = "2s", kind = "power-cut", for = "500ms" }"#,
    ] {
        let mut bus = bus("500k", "hmg10-p13", &format!("fault = [{fault}]"), "class = 1");
        let mut rate = |moment| {
            at(&mut bus, moment - 200);
            device(&at(&mut bus, moment), "encoder").master.unwrap().answers_per_second
        };
        assert!(rate(1_990) > 500.0, "{fault}");
        assert!(rate(2_480) < 1.0, "{fault}");
        assert!(rate(4_000) > 500.0, "{fault}");
    }
}

#[test]
fn three_answers_that_do_not_come_are_asked_for_again_and_nobody_is_lost() {
    let keys = "fault = [{ at = \"2s\", kind = \"drop-answers\", count = 1 }]";
    let mut bus = bus("500k", "hmg10-p13", keys, "class = 1");
    at(&mut bus, 1_990);
    let snapshot = at(&mut bus, 3_000);
    assert_eq!(device(&snapshot, "encoder").master.unwrap().state, SlaveState::Running);
    assert!(snapshot.reports.is_empty(), "{:?}", snapshot.reports);
}

/// What went over the line of the fault plant, and what was told.
fn log(seed: u32, step: u64) -> Vec<String> {
    let mut plan = only_profibus(Plant::load(&example("profibus-faults.toml")).unwrap());
    plan.seed = seed;
    let mut bus = VirtualBus::power_up(plan).unwrap();
    let mut log = Vec::new();
    let mut now = 0;
    while now < 6_000 {
        now += step;
        bus.run_until(millis(now), &mut |event: &Event| log.push(event.to_string()));
        let snapshot = bus.snapshot();
        if step == 500 {
            let devices = snapshot.devices.iter().flat_map(|device| &device.reports);
            log.extend(devices.map(|report| format!("{} {}", report.at, report.what)));
        }
    }
    log
}

#[test]
fn the_whole_fault_plant_takes_the_same_course_again_and_another_with_another_seed() {
    let first = log(7, 500);
    assert!(first.len() > 10_000, "{}", first.len());
    assert!(log(7, 500) == first);
    assert!(log(8, 500) != first);
}

#[test]
fn how_often_somebody_looks_changes_nothing() {
    let once = log(7, 6_000);
    assert!(log(7, 5) == once);
}

#[test]
fn the_fault_plant_shows_every_fault_and_is_sound_again_at_the_end() {
    let plan = only_profibus(Plant::load(&example("profibus-faults.toml")).unwrap());
    let mut bus = VirtualBus::power_up(plan).unwrap();
    let snapshot = at(&mut bus, 21_000);
    for name in ["sensor", "device", "driver", "converter"] {
        let device = device(&snapshot, name);
        assert_eq!(device.master.unwrap().state, SlaveState::Running, "{name}");
        assert_eq!(device.device.as_ref().unwrap().lamp.to_string(), "green", "{name}");
    }
    let refuses = device(&snapshot, "refuses");
    assert_eq!(refuses.device.as_ref().unwrap().lamp.to_string(), "red flashing");
    let refused = told(&snapshot, "device");
    assert!(refused.iter().any(|text| text == "preset refused: 1000000 is not 0 to 921599"));
    let converter = told(&snapshot, "converter");
    for part in ["stays high", "low before", "not low after", "another one"] {
        assert!(converter.iter().any(|text| text.contains(part)), "{part}: {converter:#?}");
    }
}
