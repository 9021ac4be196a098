//! What people do to a running plant, in virtual time.

use codewheel_plant::{
    Cause, Command, DeviceNet, Done, FieldBus, Object, Profibus, Refusal, SlaveState, Switch,
    Value, VirtualBus,
};

use super::{at, device, millis, only_bus, only_profibus, plant, told};

/// A scanner at 0 that polls an encoder at 5 each 10 ms, with `keys`.
fn devicenet(keys: &str) -> VirtualBus<DeviceNet> {
    let text = format!(
        "[[bus]]\nname = \"b\"\nbaud = \"500k\"\n\
         [[device]]\nname = \"drive\"\nmodel = \"amg11-d29\"\naddress = 5\n{keys}\n\
         [[master]]\naddress = 0\ninterval = \"10ms\"\nslave = [{{ address = 5 }}]\n"
    );
    VirtualBus::power_up(only_bus(plant(&text))).unwrap()
}

/// A master at 2 that serves 7 with `slave`, and an encoder at `address` with `keys`.
fn profibus(address: u8, keys: &str, slave: &str) -> VirtualBus<Profibus> {
    let text = format!(
        "[[bus]]\nname = \"b\"\nkind = \"profibus\"\nbaud = \"500k\"\n\
         [[device]]\nname = \"drive\"\nmodel = \"amg11-p29\"\naddress = {address}\n{keys}\n\
         [[master]]\nname = \"plc\"\naddress = 2\nslave = [{{ address = 7{slave} }}]\n"
    );
    VirtualBus::power_up(only_profibus(plant(&text))).unwrap()
}

/// Gives a command at a moment and runs until it is answered.
#[track_caller]
fn order<B: FieldBus>(
    bus: &mut VirtualBus<B>,
    moment: &mut u64,
    command: &Command,
) -> Result<Done, Refusal> {
    bus.run_until(millis(*moment), &mut |_| {});
    let ticket = bus.command("drive", command);
    for _ in 0..10_000 {
        if let Some(answer) = bus.take_answer(ticket) {
            assert_eq!(bus.take_answer(ticket), None, "it is answered once");
            return answer;
        }
        *moment += 1;
        bus.run_until(millis(*moment), &mut |_| {});
    }
    panic!("{command:?} is never answered");
}

fn object<B: FieldBus>(bus: &VirtualBus<B>, key: &str) -> Object {
    let groups = bus.objects("drive").unwrap();
    let mut objects = groups.into_iter().flat_map(|group| group.objects);
    objects.find(|object| object.key == key).expect("the object")
}

fn number<B: FieldBus>(bus: &VirtualBus<B>, key: &str) -> i64 {
    match object(bus, key).value {
        Some(Value::Number(number)) => number,
        other => panic!("{key} is {other:?}"),
    }
}

fn write(key: &str, value: i64) -> Command {
    Command::Write { key: key.to_owned(), value: Value::Number(value) }
}

fn code<B: FieldBus>(bus: &mut VirtualBus<B>, moment: u64) -> u32 {
    device(&at(bus, moment), "drive").state.measured.expect("power").code
}

#[test]
fn a_shaft_that_is_turned_by_hand_moves_quickly_and_raises_no_alarm() {
    for far in [1, 100, -100, 4_096, 8_192 * 30, -8_192 * 30] {
        let mut bus = devicenet("shaft = \"still angle=100turns\"");
        let mut moment = 3_000;
        let answer = order(&mut bus, &mut moment, &Command::TurnBy(far)).unwrap();
        assert!(answer.to_string().contains("the shaft turns by"), "{answer}");
        assert!(device(&at(&mut bus, moment + 1), "drive").state.shaft.turning);
        // 30 turns at 9000 rpm take 0.2 s.
        let snapshot = at(&mut bus, moment + 260);
        let drive = device(&snapshot, "drive");
        assert_eq!(i64::from(drive.state.measured.unwrap().code), 819_200 + far);
        assert_eq!(drive.state.shaft.code, Some((819_200 + far) as u32));
        assert_eq!(drive.master.unwrap().position, Some((819_200 + far) as u32));
        assert!(!drive.state.shaft.turning && &*drive.state.shaft.motion == "by hand");
        assert!(!told(&snapshot, "drive").iter().any(|text| text.contains("position error")));
    }
}

#[test]
fn turns_in_a_row_add_up_and_to_a_code_the_shaft_goes_the_shorter_way() {
    let mut bus = devicenet("shaft = \"still angle=10\"");
    let mut moment = 3_000;
    for _ in 0..20 {
        order(&mut bus, &mut moment, &Command::TurnBy(7)).unwrap();
        moment += 3;
    }
    assert_eq!(code(&mut bus, 3_200), 10 + 140);
    moment = 3_200;
    let last = (1_u32 << 29) - 1;
    order(&mut bus, &mut moment, &Command::TurnTo(last)).unwrap();
    assert_eq!(code(&mut bus, 3_300), last, "151 steps back, not half a million turns");
    let refusal = order(&mut bus, &mut moment, &Command::TurnTo(last + 1)).unwrap_err();
    assert_eq!(refusal.cause, Cause::Value);
    assert!(refusal.text.contains(&format!("0 to {last}")), "{refusal}");
    for (far, way) in [(1_000_000, i64::MAX), (-1_000_000, i64::MIN)] {
        order(&mut bus, &mut moment, &Command::TurnBy(far)).unwrap();
        // What is left of the turn before adds to it.
        let refusal = order(&mut bus, &mut moment, &Command::TurnBy(way)).unwrap_err();
        assert!(refusal.text.contains("65536 turns at most"), "{refusal}");
    }
}

#[test]
fn a_motion_goes_on_from_where_the_shaft_is_until_it_is_stopped_or_turned() {
    let mut bus = devicenet("shaft = \"still angle=500\"");
    let mut moment = 3_000;
    order(&mut bus, &mut moment, &Command::Motion("turn  rpm=60".into())).unwrap();
    let snapshot = at(&mut bus, 4_000);
    let state = &device(&snapshot, "drive").state;
    assert_eq!(state.shaft.code, Some(500 + 8_192));
    assert!(state.shaft.turning && &*state.shaft.motion == "turn rpm=60");
    moment = 4_000;
    order(&mut bus, &mut moment, &Command::Stop).unwrap();
    assert_eq!(code(&mut bus, 5_000), 500 + 8_192);
    for (text, says) in [
        ("turn rpm=60 angle=7", "leave out angle="),
        ("csv /etc/passwd", "name it in the plan"),
        ("turn", "lacks rpm=R"),
        ("", "still, turn rpm=R"),
    ] {
        let refusal = order(&mut bus, &mut moment, &Command::Motion(text.into())).unwrap_err();
        assert!(refusal.text.contains(says), "{refusal}");
    }
    assert_eq!(code(&mut bus, 6_000), 500 + 8_192, "it does what it did");
}

#[test]
fn the_virtual_encoder_of_a_converter_is_turned_too_and_a_jump_counts() {
    let text = "[[bus]]\nname = \"b\"\nkind = \"profibus\"\nbaud = \"500k\"\n\
                [[device]]\nname = \"drive\"\nmodel = \"heag162-p29\"\naddress = 7\n\
                ssi = { word = 25 }\n[[master]]\naddress = 2\nslave = [{ address = 7 }]\n";
    let mut bus: VirtualBus<Profibus> = VirtualBus::power_up(only_profibus(plant(text))).unwrap();
    let mut moment = 2_000;
    order(&mut bus, &mut moment, &Command::Begin("jump steps=1000".into())).unwrap();
    order(&mut bus, &mut moment, &Command::TurnTo(1_400)).unwrap();
    let snapshot = at(&mut bus, 2_200);
    let state = &device(&snapshot, "drive").state;
    assert_eq!((state.shaft.code, state.measured.unwrap().code), (Some(1_400), 1_400));
}

#[test]
fn a_write_is_what_the_master_would_have_written_and_a_refused_one_changes_nothing() {
    let mut bus = devicenet("shaft = \"still angle=8192\"");
    let mut moment = 3_000;
    order(&mut bus, &mut moment, &write("steps-per-turn", 1_000)).unwrap();
    assert_eq!(number(&bus, "total-resolution"), 65_536_000);
    assert!(told(&at(&mut bus, 3_100), "drive").contains(&"2f/1/7 changed".to_owned()));
    let ccw = Command::Write { key: "direction".into(), value: Value::Text("ccw".into()) };
    order(&mut bus, &mut moment, &ccw).unwrap();
    assert_eq!(number(&bus, "direction"), 1);
    let before = bus.objects("drive").unwrap();
    for (command, cause, says) in [
        (write("steps-per-turn", 8_193), Cause::Value, "the steps per turn are 1 to 8192"),
        (write("position", 1), Cause::Value, "it can only be read"),
        (write("preset", 65_536_000), Cause::Value, "the preset is 0 to 65535999"),
        (Command::Preset(65_536_000), Cause::Value, "the preset is 0 to 65535999"),
        (write("colour", 1), Cause::Unknown, "no object \"colour\""),
        (
            Command::Write { key: "direction".into(), value: Value::Text("up".into()) },
            Cause::Value,
            "it is CW or CCW",
        ),
    ] {
        let refusal = order(&mut bus, &mut moment, &command).unwrap_err();
        assert_eq!(refusal.cause, cause, "{refusal}");
        assert!(refusal.text.contains(says), "{refusal}");
    }
    assert_eq!(bus.objects("drive").unwrap(), before);
}

#[test]
fn a_preset_is_unsaved_until_it_is_saved_and_then_outlives_the_power() {
    let mut bus = devicenet("shaft = \"still angle=8192\"");
    let mut moment = 3_000;
    order(&mut bus, &mut moment, &Command::Preset(42)).unwrap();
    let snapshot = at(&mut bus, 3_050);
    let drive = device(&snapshot, "drive");
    assert_eq!(drive.master.unwrap().position, Some(42), "its master sees it");
    assert_eq!(drive.state.memory.as_ref().unwrap().unsaved, ["preset", "offset"]);
    assert_eq!(object(&bus, "preset").saved, Some(Value::Number(0)));
    moment = 3_050;
    order(&mut bus, &mut moment, &Command::Save).unwrap();
    assert!((3_055..3_080).contains(&moment), "the memory takes 10 ms: {moment}");
    let snapshot = at(&mut bus, moment);
    let memory = device(&snapshot, "drive").state.memory.clone().unwrap();
    assert_eq!((memory.writes, memory.state, memory.unsaved), (1, "good", vec![]));
    order(&mut bus, &mut moment, &Command::Preset(7)).unwrap();
    order(&mut bus, &mut moment, &Command::Restore).unwrap();
    assert_eq!(number(&bus, "position"), 42);
    order(&mut bus, &mut moment, &Command::Reset).unwrap();
    assert_eq!(number(&bus, "position"), 8_192);
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    assert_eq!(number(&bus, "position"), 42);
}

#[test]
fn a_power_cut_in_the_middle_of_a_save_is_the_answer_to_it() {
    let (mut kept, mut lost) = (0, 0);
    for seed in 0..40 {
        let text = format!(
            "[[bus]]\nname = \"b\"\nbaud = \"500k\"\nseed = {seed}\n[[device]]\nname = \"drive\"\n\
             model = \"amg11-d29\"\naddress = 5\n"
        );
        let mut bus = VirtualBus::power_up(only_bus(plant(&text))).unwrap();
        let mut moment = 100;
        order(&mut bus, &mut moment, &Command::Preset(42)).unwrap();
        order(&mut bus, &mut moment, &Command::Save).unwrap();
        order(&mut bus, &mut moment, &Command::Preset(77)).unwrap();
        let save = bus.command("drive", &Command::Save);
        bus.run_until(millis(moment + 3), &mut |_| {});
        assert_eq!(bus.take_answer(save), None);
        moment += 3;
        order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
        let refusal = bus.take_answer(save).expect("an answer").unwrap_err();
        assert_eq!(refusal.cause, Cause::Failed);
        assert!(refusal.text.contains("the power was cut"), "{refusal}");
        order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
        match number(&bus, "position") {
            42 => lost += 1,
            77 => kept += 1,
            other => panic!("position {other}"),
        }
    }
    assert!(lost > 30 && kept + lost == 40, "{kept} {lost}");
}

#[test]
fn without_power_settings_are_refused_and_the_shaft_turns_all_the_same() {
    let mut bus = devicenet("shaft = \"still\"");
    let mut moment = 3_000;
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    let snapshot = at(&mut bus, 5_500);
    let drive = device(&snapshot, "drive");
    assert!(!drive.state.power && drive.state.measured.is_none() && drive.device.is_none());
    assert_eq!((drive.state.lamp.text, drive.master.unwrap().state), ("off", SlaveState::Absent));
    moment = 5_500;
    let refusal = order(&mut bus, &mut moment, &write("cos-delta", 2)).unwrap_err();
    assert_eq!(refusal.cause, Cause::State);
    assert_eq!(object(&bus, "cos-delta").value, None);
    assert!(object(&bus, "cos-delta").why_not.unwrap().contains("no power"));
    order(&mut bus, &mut moment, &Command::TurnBy(123)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    assert_eq!(code(&mut bus, 5_700), 123);
    assert_eq!(device(&at(&mut bus, 10_000), "drive").master.unwrap().state, SlaveState::Running);
}

#[test]
fn somebody_who_switches_off_is_not_overruled_by_the_plan() {
    let cut = "fault = [{ at = \"3s\", kind = \"power-cut\", for = \"1s\" }]";
    let mut bus = devicenet(cut);
    let power =
        |bus: &mut VirtualBus<DeviceNet>, moment| device(&at(bus, moment), "drive").state.power;
    let mut moment = 2_500;
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    assert!(!power(&mut bus, 5_000), "the cut of the plan is over, and it is off");
    moment = 5_000;
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    assert!(power(&mut bus, 5_001));
    let mut bus = devicenet(cut);
    assert!(!power(&mut bus, 3_100));
    moment = 3_100;
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    assert!(power(&mut bus, 3_101));
    let later = at(&mut bus, 6_000);
    assert!(device(&later, "drive").state.power);
    let told = told(&later, "drive");
    assert!(!told.iter().any(|text| text.contains("fault over")), "it was over before: {told:?}");
}

#[test]
fn switches_act_at_the_next_power_up_and_the_master_loses_the_device() {
    let mut bus = devicenet("");
    let mut moment = 3_000;
    let switch = Switch { rotary: Some([0, 9]), ..Switch::default() };
    order(&mut bus, &mut moment, &Command::Switch(switch)).unwrap();
    let snapshot = at(&mut bus, 3_500);
    let drive = device(&snapshot, "drive");
    assert_eq!((drive.address, drive.state.connection), (5, "polled"));
    assert_eq!(drive.state.switches.rotary, [0, 9]);
    assert_eq!(drive.state.switches_at_power_up.rotary, [0, 5]);
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    let snapshot = at(&mut bus, 8_000);
    let drive = device(&snapshot, "drive");
    assert_eq!((drive.address, drive.served_by.as_deref(), drive.state.master), (9, None, None));
    assert_eq!(drive.state.lamp.text, "green flashing", "it is on-line at its new address");
    assert_eq!(snapshot.masters[0].slaves[0].1.state, SlaveState::Absent);
    let switch = Switch { rotary: Some([0, 10]), ..Switch::default() };
    let refusal = order(&mut bus, &mut moment, &Command::Switch(switch)).unwrap_err();
    assert!(refusal.text.contains("0 to 9"), "{refusal}");
}

#[test]
fn a_device_whose_switches_say_another_rate_is_alone() {
    let mut bus = devicenet("");
    let mut moment = 3_000;
    let slow = Switch { dip: Some(vec![true, false, true]), ..Switch::default() };
    order(&mut bus, &mut moment, &Command::Switch(slow)).unwrap();
    assert_eq!(device(&at(&mut bus, 3_500), "drive").state.connection, "polled");
    moment = 3_500;
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    let snapshot = at(&mut bus, 8_000);
    let said = told(&snapshot, "drive");
    assert!(said.iter().any(|text| text.contains("say 250k and the bus runs at 500k")), "{said:?}");
    let drive = device(&snapshot, "drive");
    assert_eq!((drive.state.lamp.text, drive.master.unwrap().state), ("off", SlaveState::Absent));
    assert_eq!(drive.state.switches.dip, [true, false, true], "DIP 1 is where it was put");
    let back = Switch { dip: Some(vec![false, true, false]), ..Switch::default() };
    moment = 8_000;
    order(&mut bus, &mut moment, &Command::Switch(back)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    assert_eq!(device(&at(&mut bus, 14_000), "drive").state.connection, "polled");
    let refusal = Switch { dip: Some(vec![true]), ..Switch::default() };
    let refusal = order(&mut bus, &mut moment, &Command::Switch(refusal)).unwrap_err();
    assert!(refusal.text.contains("3 DIP switches"), "{refusal}");
}

#[test]
fn a_terminating_resistor_acts_at_once() {
    let mut bus = devicenet("");
    at(&mut bus, 100);
    let mut warnings = |termination, mut moment| {
        let switch = Switch { termination: Some(termination), ..Switch::default() };
        let answer = order(&mut bus, &mut moment, &Command::Switch(switch)).unwrap();
        assert!(!answer.to_string().contains("next power-up"), "{answer}");
        let reports = at(&mut bus, moment).reports;
        reports.iter().map(|report| report.what.to_string()).collect::<Vec<_>>()
    };
    assert!(warnings(true, 110).is_empty(), "the master has the other one");
    let [warning] = &warnings(false, 120)[..] else { panic!("one warning") };
    assert!(warning.contains("only one terminating resistor, at scanner"), "{warning}");
}

#[test]
fn faults_begin_and_end_when_people_say_so() {
    let mut bus = devicenet("shaft = \"turn rpm=60\"");
    let mut moment = 3_000;
    let begin = |words: &str| Command::Begin(words.to_owned());
    let end = |kind: &str| Command::End(kind.to_owned());
    let faults = |bus: &mut VirtualBus<DeviceNet>, moment| {
        device(&at(bus, moment), "drive").state.faults.clone()
    };
    order(&mut bus, &mut moment, &begin("stuck")).unwrap();
    order(&mut bus, &mut moment, &begin("late-answers delay=5ms")).unwrap();
    order(&mut bus, &mut moment, &begin("bad-transceiver probability=0.1 for=200ms")).unwrap();
    order(&mut bus, &mut moment, &begin("drop-answers count=3")).unwrap();
    assert_eq!(
        faults(&mut bus, 3_001),
        ["stuck", "drop-answers", "late-answers", "bad-transceiver"]
    );
    assert_eq!(faults(&mut bus, 3_300), ["stuck", "late-answers"], "these are over by themselves");
    moment = 3_300;
    order(&mut bus, &mut moment, &end("stuck")).unwrap();
    order(&mut bus, &mut moment, &end("late-answers")).unwrap();
    assert!(faults(&mut bus, 3_400).is_empty());
    moment = 3_400;
    for (command, cause, says) in [
        (end("stuck"), Cause::State, "nothing to end"),
        (end("jump"), Cause::Impossible, "over at once"),
        (end("hail"), Cause::Unknown, "there is jump, stuck"),
        (begin("jump"), Cause::Value, "missing key `steps`"),
        (begin("jump steps=1 at=5s"), Cause::Value, "leave out at="),
        (begin("cell-low"), Cause::Value, "no lithium cell"),
        (begin(""), Cause::Value, ""),
    ] {
        let refusal = order(&mut bus, &mut moment, &command).unwrap_err();
        assert_eq!(refusal.cause, cause, "{refusal}");
        assert!(refusal.text.contains(says), "{refusal}");
    }
}

#[test]
fn the_end_of_an_earlier_fault_is_not_that_of_a_later_one() {
    let mut bus = devicenet("");
    let mut moment = 3_000;
    let cut = |time: &str| Command::Begin(format!("power-cut for={time}"));
    order(&mut bus, &mut moment, &cut("500ms")).unwrap();
    assert!(order(&mut bus, &mut moment, &cut("1s")).is_err(), "it has none");
    order(&mut bus, &mut moment, &Command::End("power-cut".into())).unwrap();
    moment += 100;
    order(&mut bus, &mut moment, &cut("2s")).unwrap();
    let snapshot = at(&mut bus, 4_500);
    assert!(!device(&snapshot, "drive").state.power);
    assert_eq!(device(&snapshot, "drive").state.faults, ["power-cut"]);
    assert!(device(&at(&mut bus, 5_200), "drive").state.power);
}

#[test]
fn on_profibus_parameters_are_changed_at_the_master_and_a_preset_goes_through_it() {
    let mut bus = profibus(7, "shaft = \"still angle=1000\"", "");
    let mut moment = 2_000;
    let answer = order(&mut bus, &mut moment, &Command::Preset(42)).unwrap();
    assert_eq!(answer.to_string(), "the master has given the preset 42");
    assert!(moment < 2_100, "some cycles: {moment}");
    let snapshot = at(&mut bus, moment + 50);
    assert_eq!(device(&snapshot, "drive").master.unwrap().position, Some(42));
    moment += 50;
    order(&mut bus, &mut moment, &write("total-resolution", 8_192 * 100)).unwrap();
    order(&mut bus, &mut moment, &write("total-resolution", 10_000)).unwrap();
    order(&mut bus, &mut moment, &write("steps-per-turn", 100)).unwrap();
    let ccw = Command::Write { key: "direction".into(), value: Value::Text("CCW".into()) };
    order(&mut bus, &mut moment, &ccw).unwrap();
    assert_eq!(number(&bus, "diagnosis-steps-per-turn"), 100);
    assert_eq!(number(&bus, "steps-per-turn"), 100);
    assert_eq!(number(&bus, "direction"), 1);
    let snapshot = at(&mut bus, moment);
    let drive = device(&snapshot, "drive");
    assert_eq!((drive.state.connection, drive.served_by.as_deref()), ("data-exch", Some("plc")));
    assert_eq!(drive.state.measured.unwrap().total_resolution, 10_000);
    let off = Command::Write { key: "class-2".into(), value: Value::Text("OFF".into()) };
    order(&mut bus, &mut moment, &off).unwrap();
    assert_eq!(number(&bus, "class-2"), 0);
    let refusal = order(&mut bus, &mut moment, &Command::Preset(1)).unwrap_err();
    assert!(refusal.text.contains("class 2 is off"), "{refusal}");
    order(&mut bus, &mut moment, &Command::Restore).unwrap();
    assert_eq!((number(&bus, "class-2"), number(&bus, "steps-per-turn")), (1, 8_192));
    order(&mut bus, &mut moment, &write("total-resolution", 8_192)).unwrap();
    order(&mut bus, &mut moment, &Command::Reset).unwrap();
    assert_eq!(number(&bus, "total-resolution"), 1 << 29);
}

#[test]
fn a_refused_parameter_leaves_master_and_device_as_they_were() {
    let mut bus = profibus(7, "", "");
    let mut moment = 2_000;
    bus.run_until(millis(moment), &mut |_| {});
    let before = bus.objects("drive").unwrap();
    for (command, cause, says) in [
        (write("steps-per-turn", 8_193), Cause::Value, "it is 1 to 8192"),
        (write("steps-per-turn", -1), Cause::Value, "it is 1 to 8192"),
        (write("steps-per-turn", 100), Cause::Value, "exceeds 100 × 65536 = 6553600"),
        (write("diagnosis-offset", 1), Cause::Impossible, "the device tells it"),
        (write("hue", 1), Cause::Unknown, "no object"),
        (Command::Preset(1 << 29), Cause::Value, "it is 0 to 536870911"),
        (Command::Save, Cause::Impossible, "keeps each preset at once"),
    ] {
        let refusal = order(&mut bus, &mut moment, &command).unwrap_err();
        assert_eq!(refusal.cause, cause, "{refusal}");
        assert!(refusal.text.contains(says), "{refusal}");
    }
    assert_eq!(bus.objects("drive").unwrap(), before);
    let snapshot = at(&mut bus, moment + 10);
    assert_eq!(device(&snapshot, "drive").state.connection, "data-exch");
}

#[test]
fn a_slave_of_class_1_gets_longer_parameters_when_it_needs_them() {
    let mut bus = profibus(7, "", ", class = 1, scaling = false");
    let mut moment = 2_000;
    let on = |key: &str| Command::Write { key: key.into(), value: Value::Text("ON".into()) };
    bus.run_until(millis(moment), &mut |_| {});
    assert_eq!(number(&bus, "class-2"), 0);
    order(&mut bus, &mut moment, &on("class-2")).unwrap();
    order(&mut bus, &mut moment, &on("scaling")).unwrap();
    order(&mut bus, &mut moment, &write("total-resolution", 4_096)).unwrap();
    assert_eq!(number(&bus, "diagnosis-total-resolution"), 4_096);
}

#[test]
fn where_the_master_is_not_ours_the_refusal_says_so() {
    let mut bus = profibus(8, "", "");
    let mut moment = 2_000;
    for command in [write("direction", 1), Command::Preset(1), Command::Restore] {
        let refusal = order(&mut bus, &mut moment, &command).unwrap_err();
        assert_eq!(refusal.cause, Cause::Impossible);
        assert!(refusal.text.contains("no master of this plant"), "{refusal}");
    }
    assert!(object(&bus, "direction").why_not.is_some());
}

#[test]
fn a_preset_for_a_slave_that_is_gone_is_refused_and_not_given_later() {
    let mut bus = profibus(7, "", "");
    let mut moment = 2_000;
    order(&mut bus, &mut moment, &Command::Begin("drop-answers".into())).unwrap();
    let ticket = bus.command("drive", &Command::Preset(42));
    bus.run_until(millis(moment + 7_000), &mut |_| {});
    let refusal = bus.take_answer(ticket).expect("an answer").unwrap_err();
    assert_eq!(refusal.cause, Cause::Late);
    moment += 7_000;
    let refusal = order(&mut bus, &mut moment, &Command::Preset(43)).unwrap_err();
    assert_eq!(refusal.cause, Cause::State);
    let later = order(&mut bus, &mut moment, &write("direction", 1)).unwrap();
    assert!(later.to_string().contains("gets them when it does"), "{later}");
    order(&mut bus, &mut moment, &Command::End("drop-answers".into())).unwrap();
    let snapshot = at(&mut bus, moment + 3_000);
    assert_eq!(device(&snapshot, "drive").master.unwrap().state, SlaveState::Running);
    assert_eq!(number(&bus, "direction"), 1, "the parameters came with it");
    let state = &device(&snapshot, "drive").state;
    assert_eq!(state.measured.unwrap().offset, 0, "the preset did not");
}

#[test]
fn keys_are_unique_and_every_setting_names_its_place() {
    let on_devicenet = devicenet("").objects("drive").unwrap();
    let on_profibus = profibus(7, "", "").objects("drive").unwrap();
    for groups in [on_devicenet, on_profibus] {
        let mut keys: Vec<_> = groups.iter().flat_map(|group| &group.objects).collect();
        keys.sort_by_key(|object| object.key.clone());
        assert!(keys.windows(2).all(|two| two[0].key != two[1].key));
        assert!(keys.iter().all(|object| !object.place.is_empty() && !object.title.is_empty()));
        assert!(keys.iter().any(|object| object.is_editable() && object.setting));
    }
    let steps = object(&devicenet(""), "steps-per-turn");
    assert_eq!((steps.place.as_str(), steps.range), ("2Fh/1/7", Some((1, 8_192))));
    let steps = object(&profibus(7, "", ""), "steps-per-turn");
    assert_eq!(steps.place, "octets 10–13 of Set_Prm");
}

#[test]
fn an_unknown_device_is_named_with_those_that_there_are() {
    let mut bus = devicenet("");
    let ticket = bus.command("crane", &Command::Save);
    let refusal = bus.take_answer(ticket).unwrap().unwrap_err();
    assert_eq!(refusal.cause, Cause::Unknown);
    assert!(refusal.text.contains("there is drive"), "{refusal}");
}

#[test]
fn a_master_finds_a_device_at_the_address_that_it_was_moved_to() {
    let text = "[[bus]]\nname = \"b\"\nuri = \"virtual:b\"\nbaud = \"500k\"\n\
                [[device]]\nname = \"drive\"\nmodel = \"amg11-d29\"\naddress = 5\n\
                [[master]]\naddress = 0\ninterval = \"10ms\"\nslave = [{ address = 9 }]\n";
    let mut bus = VirtualBus::power_up(only_bus(plant(text))).unwrap();
    let mut moment = 3_000;
    let switch = Switch { rotary: Some([0, 9]), ..Switch::default() };
    order(&mut bus, &mut moment, &Command::Switch(switch)).unwrap();
    assert_eq!(device(&at(&mut bus, 4_000), "drive").address, 5);
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    order(&mut bus, &mut moment, &Command::Power(true)).unwrap();
    let snapshot = at(&mut bus, 9_000);
    let drive = device(&snapshot, "drive");
    assert_eq!((drive.address, drive.state.connection, drive.state.master), (9, "polled", Some(0)));
    assert_eq!(drive.served_by.as_deref(), Some("scanner at 0"));
}

#[test]
fn the_identity_tells_its_revision_and_status_while_there_is_power() {
    let mut bus = devicenet("");
    let mut moment = 3_000;
    at(&mut bus, moment);
    assert_eq!(object(&bus, "revision").value, Some(Value::Text("1.1".into())));
    assert_eq!(number(&bus, "status"), 0b001, "owned");
    order(&mut bus, &mut moment, &write("cos-delta", 5)).unwrap();
    order(&mut bus, &mut moment, &Command::Save).unwrap();
    assert_eq!(number(&bus, "status"), 0b101, "owned and configured");
    order(&mut bus, &mut moment, &Command::Power(false)).unwrap();
    assert_eq!(object(&bus, "status").value, None);
    assert_eq!(number(&bus, "vendor"), 468);
}
