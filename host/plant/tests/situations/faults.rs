use codewheel_plant::{Plant, SlaveState, VirtualBus};
use codewheel_sim::can::{Event, candump_line};

use super::{at, device, example, millis, only_bus, plant, told};

/// A scanner at 0 that polls one encoder at 5 every 10 ms; the encoder has `faults`.
fn bus(model: &str, faults: &str) -> VirtualBus {
    let text = format!(
        "[[bus]]\nname = \"b\"\nbaud = \"500k\"\n\
         [[master]]\naddress = 0\nslave = [{{ address = 5, expected_packet_rate = \"100ms\" }}]\n\
         [[device]]\nname = \"encoder\"\nmodel = \"{model}\"\naddress = 5\ntermination = true\n\
         shaft = \"turn rpm=1\"\nfault = [{faults}]\n"
    );
    VirtualBus::power_up(only_bus(plant(&text))).unwrap()
}

/// Answers that the scanner got in the 100 ms from `from` on.
fn answers(bus: &mut VirtualBus, from: u64) -> u64 {
    at(bus, from);
    let rate = device(&at(bus, from + 100), "encoder").master.as_ref().unwrap().answers_per_second;
    (rate / 10.0).round() as u64
}

/// The frames of the fault plant and what its devices told, in the order they came.
fn log(seed: u32) -> Vec<String> {
    let mut plan = only_bus(Plant::load(&example("faults.toml")).unwrap());
    plan.seed = seed;
    let mut bus = VirtualBus::power_up(plan).unwrap();
    let mut log = Vec::new();
    for moment in 1..=40 {
        bus.run_until(millis(moment * 500), &mut |event| {
            log.push(match event {
                Event::Frame { at, frame, .. } => candump_line(*at, "vcan0", frame),
                event => event.to_string(),
            });
        });
        let snapshot = bus.snapshot();
        for device in &snapshot.devices {
            let told = device.reports.iter();
            log.extend(told.map(|report| format!("{} {} {}", report.at, device.name, report.what)));
        }
    }
    log
}

#[test]
fn the_whole_fault_plant_takes_the_same_course_again_and_another_with_another_seed() {
    let first = log(7);
    assert!(first.len() > 10_000, "{}", first.len());
    assert!(log(7) == first);
    assert!(log(8) != first);
}

#[test]
fn how_often_somebody_looks_changes_nothing() {
    let run = |step: u64| {
        let plan = only_bus(Plant::load(&example("faults.toml")).unwrap());
        let mut bus = VirtualBus::power_up(plan).unwrap();
        let mut frames = Vec::new();
        let mut now = 0;
        while now < 13_000 {
            now = (now + step).min(13_000);
            bus.run_until(millis(now), &mut |event| frames.push(event.to_string()));
            bus.snapshot();
        }
        frames
    };
    let once = run(13_000);
    assert!(run(5) == once);
    assert!(run(7) == once);
}

#[test]
fn a_jump_is_a_position_error_that_ends_by_itself() {
    let mut bus = bus("amg11-d29", r#"{ at = "3s", kind = "jump", steps = 500000 }"#);
    let before = at(&mut bus, 2_999);
    let position = device(&before, "encoder").device.as_ref().unwrap().position;
    let after = at(&mut bus, 3_100);
    let encoder = device(&after, "encoder");
    let there = position + 500_000..position + 500_020;
    assert!(there.contains(&encoder.device.as_ref().unwrap().position));
    assert!(encoder.device.as_ref().unwrap().alarm);
    assert!(there.contains(&encoder.master.as_ref().unwrap().position.unwrap()));
    assert_eq!(
        told(&after, "encoder"),
        ["fault: the code jumps by 500000 steps", "position error: the code jumped"]
    );
    assert!(!device(&at(&mut bus, 10_000), "encoder").device.as_ref().unwrap().alarm);
}

#[test]
fn a_cell_runs_low_and_is_replaced() {
    let faults = r#"{ at = "1s", kind = "cell-low" }, { at = "2s", kind = "cell-right" }"#;
    let mut bus = bus("amg81-d29", faults);
    let mut warning =
        |moment| device(&at(&mut bus, moment), "encoder").device.as_ref().unwrap().warning;
    assert_eq!([warning(900), warning(1_500), warning(2_500)], [false, true, false]);
}

#[test]
fn a_stuck_sensor_holds_its_code_while_the_shaft_turns() {
    let text = r#"
        [[bus]]
        name = "b"
        [[device]]
        name = "encoder"
        model = "amg11-d29"
        address = 5
        shaft = "turn rpm=60"
        fault = [{ at = "1s", kind = "stuck" }, { at = "2s", kind = "free" }]
    "#;
    let mut bus = VirtualBus::power_up(only_bus(plant(text))).unwrap();
    let mut code = |moment| device(&at(&mut bus, moment), "encoder").device.as_ref().unwrap().code;
    assert!((8_000..8_200).contains(&code(1_001)));
    let held = code(1_200);
    assert_eq!(code(1_900), held);
    assert!((17_000..18_000).contains(&code(2_150)));
}

#[test]
fn counted_answers_are_missing_and_no_more() {
    let mut bus = bus("amg11-d29", r#"{ at = "4s", kind = "drop-answers", count = 1 }"#);
    assert_eq!(answers(&mut bus, 3_800), 10);
    // The scanner waits 50 ms for the one that does not come.
    assert_eq!(answers(&mut bus, 4_000), 5);
    assert_eq!(answers(&mut bus, 4_200), 10);
}

#[test]
fn dropped_answers_end_with_their_time_and_the_connection_comes_back() {
    let faults = r#"{ at = "4s", kind = "drop-answers", for = "1s" }"#;
    let mut bus = bus("amg11-d29", faults);
    assert_eq!(answers(&mut bus, 4_100), 0);
    let state = device(&at(&mut bus, 4_900), "encoder").master.as_ref().unwrap().state;
    assert_ne!(state, SlaveState::Running);
    assert_eq!(answers(&mut bus, 9_000), 10);
}

#[test]
fn late_answers_are_answers_all_the_same_and_old_news() {
    let faults = r#"{ at = "4s", kind = "late-answers", delay = "15ms", for = "1s" }"#;
    let mut bus = bus("amg11-d29", faults);
    assert_eq!(answers(&mut bus, 3_800), 10);
    let late = answers(&mut bus, 4_100);
    assert!((5..=7).contains(&late), "a cycle takes 15 ms and a little: {late}");
    assert_eq!(answers(&mut bus, 5_100), 10);
}

#[test]
fn a_power_cut_darkens_the_lamp_and_the_scanner_finds_the_device_anew() {
    let mut bus = bus("amg11-d29", r#"{ at = "4s", kind = "power-cut" }"#);
    at(&mut bus, 3_999);
    let cut = at(&mut bus, 4_500);
    assert!(device(&cut, "encoder").device.is_none());
    assert_eq!(told(&cut, "encoder"), ["fault: the power is cut for 1s"]);
    let back = at(&mut bus, 5_001);
    assert_eq!(told(&back, "encoder")[..2], ["power up", "fault over: the power is cut for 1s"]);
    assert_eq!(answers(&mut bus, 8_000), 10);
}

#[test]
fn bus_off_is_for_good_until_the_power_is_cut() {
    let faults = r#"{ at = "4s", kind = "bus-off" }, { at = "6s", kind = "power-cut" }"#;
    let mut bus = bus("amg11-d29", faults);
    let mut lamp = |moment| {
        let snapshot = at(&mut bus, moment);
        device(&snapshot, "encoder").device.as_ref().map(|device| device.lamp.to_string())
    };
    assert_eq!(lamp(3_900).as_deref(), Some("green"));
    assert_eq!(lamp(5_900).as_deref(), Some("red"));
    assert_eq!(lamp(6_500), None);
    assert_eq!(lamp(10_000).as_deref(), Some("green"));
    assert_eq!(bus.statistics().bus_offs, 1);
}

#[test]
fn a_bad_transceiver_counts_up_to_bus_off() {
    let faults = r#"{ at = "4s", kind = "bad-transceiver", for = "500ms" }"#;
    let mut bus = bus("amg11-d29", faults);
    assert!(bus.statistics().bus_offs == 0 && answers(&mut bus, 3_800) == 10);
    let snapshot = at(&mut bus, 5_000);
    assert_eq!(bus.statistics().bus_offs, 1);
    let lamp = device(&snapshot, "encoder").device.as_ref().unwrap().lamp;
    assert_eq!(lamp.to_string(), "red");
}

#[test]
fn of_two_stations_at_one_address_the_second_one_stays_silent() {
    let text = r#"
        [[bus]]
        name = "b"
        [[master]]
        address = 0
        [[device]]
        name = "first"
        model = "amg11-d29"
        address = 5
        [[device]]
        name = "second"
        model = "hmg10-d13"
        address = 5
        duplicate = true
        fault = [{ at = "0s", kind = "power-cut", for = "4s" }]
    "#;
    let mut bus = VirtualBus::power_up(only_bus(plant(text))).unwrap();
    let snapshot = at(&mut bus, 8_000);
    let lamp = |name| device(&snapshot, name).device.as_ref().unwrap().lamp.to_string();
    assert_eq!([lamp("first"), lamp("second")], ["green", "red"]);
}

#[test]
fn a_wire_without_its_two_resistors_is_reported_once() {
    let text = "[[bus]]\nname = \"b\"\n[[device]]\nmodel = \"amg11-d29\"\naddress = 5\n";
    let mut bus = VirtualBus::power_up(only_bus(plant(text))).unwrap();
    let reports = at(&mut bus, 10).reports;
    assert!(reports[0].what.to_string().contains("no terminating resistor"), "{reports:?}");
    assert!(at(&mut bus, 20).reports.is_empty());
}
