//! Passports from recorded traffic.

use codewheel_capture::{Format, Reader};
use codewheel_commission::passport::{self, Passport, Source, Verdict, from_capture};
use codewheel_commission::{Kind, Reading, Session, Trouble};
use codewheel_station::Duration;

use crate::buses::{Bench, DeviceNetBench, ProfibusBench};
use crate::toy::{self, circumstances, key};

fn captured(log: &str) -> Result<Vec<Passport>, Trouble> {
    let mut reader = Reader::new(log.as_bytes(), Format::Log);
    from_capture(&mut reader, "codewheel test", &mut |error| panic!("{error}"))
}

fn write(session: &mut dyn Session, settings: &[(&str, i64)]) {
    for (name, value) in settings {
        session.write(&key(name), &Reading::Number(*value)).expect("a legal setting");
    }
}

fn watch(session: &mut dyn Session) {
    let begin = session.now();
    while session.now().since(begin) < Duration::from_millis(600) {
        session.sample().expect("a sample");
    }
}

/// Reads what a dead encoder said, mounts a new one in its place, and compares the positions.
fn replace<B: Bench>(bench: &mut B, old: u8, model: &str) -> Passport {
    let dead = captured(bench.log()).expect("a passport");
    let dead = dead.into_iter().find(|passport| passport.address == old).expect("its passport");
    let dead = Passport::parse(&dead.to_toml()).expect("our own file");
    let stood = dead.position.steps.expect("a position");
    bench.detach(old);
    bench.attach(old, model, 5_555);
    bench.run(Duration::from_secs(4));
    let (report, position) = bench.with_session(old, |session| {
        let plan = passport::plan(&dead, session, &circumstances(), None).expect("a plan");
        let report = plan.carry_out(session, &circumstances(), &mut |_| ());
        (report, session.sample().expect("a sample").position)
    });
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    assert!(position.abs_diff(stood) <= 1, "{position} {stood}");
    dead
}

#[test]
fn a_dead_devicenet_encoder_is_replaced_from_a_capture_of_its_bus() {
    let mut bench = DeviceNetBench::new();
    bench.attach(5, "amg11-d29", 123_456);
    bench.run(Duration::from_secs(3));
    bench.with_session(5, |session| {
        write(session, &[("direction", 1), ("steps-per-turn", 3_600)]);
        write(session, &[("total-resolution", 921_600), ("heartbeat-interval", 0)]);
        session.preset(400).expect("a preset");
        watch(session);
    });
    let dead = replace(&mut bench, 5, "amg11-d29");
    assert_eq!(dead.source, Source::Capture);
    assert_eq!(dead.nameplate.serial, Some(1_000));
    assert_eq!(dead.nameplate.product_name.as_deref(), Some("AMG 11 - Multiturn"));
    assert_eq!(dead.nameplate.firmware.as_deref(), Some("1.01"));
    assert_eq!(dead.number("direction"), Some(1));
    assert_eq!(dead.number("total-resolution"), Some(921_600));
    assert_eq!(dead.number("heartbeat-interval"), Some(0));
    assert_eq!(dead.number("cos-delta"), None);
    assert_eq!(dead.position.preset, Some(400));
    assert_eq!(dead.position.at_rest, Some(true));
    assert!(dead.project.allocation.contains(&"explicit".to_owned()));
    assert!(dead.absent.contains(&"settings.cos-delta".to_owned()), "{:?}", dead.absent);
    assert!(dead.absent.contains(&"position.offset".to_owned()), "{:?}", dead.absent);
}

#[test]
fn a_dead_profibus_encoder_is_replaced_from_a_capture_of_its_bus() {
    let mut bench = ProfibusBench::new();
    bench.attach(7, "amg11-p29", 123_456);
    bench.run(Duration::from_secs(1));
    bench.with_session(7, |session| {
        write(session, &[("direction", 1), ("total-resolution", 921_600)]);
        write(session, &[("steps-per-turn", 3_600)]);
        session.preset(400).expect("a preset");
        watch(session);
    });
    let dead = replace(&mut bench, 7, "hmg11-p29");
    assert_eq!(dead.nameplate.product_code, Some(0x059B));
    assert_eq!(dead.nameplate.singleturn_resolution, Some(8_192));
    assert_eq!(dead.nameplate.firmware.as_deref(), Some("1.21"));
    assert_eq!(dead.number("steps-per-turn"), Some(3_600));
    assert_eq!(dead.number("class-2"), Some(1));
    assert_eq!(dead.position.preset, Some(400));
    assert!(dead.position.offset.is_some());
    assert_eq!(dead.project.configuration, Some(vec![0xF1]));
    assert_eq!(dead.project.data_sheet.as_deref(), Some("PB29DPV0.GSD"));
    assert_eq!(dead.absent, Vec::<String>::new());
}

#[test]
fn what_a_reset_or_new_steps_overthrow_is_not_in_the_passport() {
    let mut bench = DeviceNetBench::new();
    bench.attach(5, "amg11-d29", 0);
    bench.run(Duration::from_secs(3));
    bench.with_session(5, |session| {
        write(session, &[("total-resolution", 921_600), ("steps-per-turn", 3_600)]);
    });
    let passport = captured(bench.log()).unwrap().remove(0);
    assert_eq!(passport.number("steps-per-turn"), Some(3_600));
    assert_eq!(passport.number("total-resolution"), None);
    bench.with_session(5, |session| session.reset().expect("it resets"));
    let passport = captured(bench.log()).unwrap().remove(0);
    assert_eq!(passport.settings, []);
    assert!(passport.absent.contains(&"settings.steps-per-turn".to_owned()));
}

#[test]
fn a_start_up_that_a_scanner_made_gives_what_it_shows_and_names_the_rest() {
    // Node 5 comes on line; a scanner at 10 allocates explicit and poll, asks for the product code,
    // writes steps per turn and total, is refused a preset, and polls twice.
    let log = "\
(1.000000) can0 42F#00D40101000000
(3.100000) can0 42E#0A4B0301030A
(3.101000) can0 42B#0ACB00
(3.110000) can0 42C#0A0E010103
(3.111000) can0 42B#0A8E0A00
(3.120000) can0 42C#8A0010 2F0107
(3.130000) can0 42C#0A1005020914
(3.130500) can0 42B#0A94 09FF
(3.140000) can0 42C#0A100502096400
(3.141000) can0 42B#0A906400
(3.200000) can0 42D#
(3.201000) can0 3C5#10000000
(3.700000) can0 42D#
(3.701000) can0 3C5#10000000
"
    .replace(' ', "")
    .replace(")can0", ") can0 ");
    let passports = captured(&log).unwrap();
    assert_eq!(passports.len(), 1);
    let passport = &passports[0];
    assert_eq!((passport.address, passport.nameplate.serial), (5, Some(1)));
    assert_eq!(passport.nameplate.product_code, Some(0x0A));
    assert_eq!(passport.nameplate.models.len(), 5);
    assert_eq!(passport.nameplate.revolutions, Some(65_536));
    assert_eq!(passport.settings, []);
    assert_eq!(passport.position.steps, Some(16));
    assert_eq!(passport.position.at_rest, Some(true));
    assert_eq!(passport.project.allocation, ["explicit", "poll"]);
    assert_eq!(passport.project.expected_packet_rates.poll, Some(100));
    assert_eq!(passport.to_toml().matches("settings.direction").count(), 1);
    // It is taken all the same, and says what it leaves alone.
    let mut new = toy::new("amg11-d29", 2, 900);
    let plan = new.plan(passport, None).unwrap();
    let told = plan.to_string();
    for words in ["not in the capture, so they stay as they are: direction", "end of the capture"] {
        assert!(told.contains(words), "{words} in\n{told}");
    }
    assert_eq!(new.apply(passport, None).verdict, Verdict::Done);
    assert_eq!(new.position(), 16);
}

#[test]
fn refused_parameters_are_not_taken_for_settings() {
    // Slave 7 refuses its Set_Prm (the diagnosis says Prm_Fault), and never exchanges data.
    let log = "\
(1.000000) pb0 68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 40 00 20 00 00 00 C2 16
(1.000100) pb0 E5
(1.001000) pb0 68 05 05 68 87 82 5C 3C 3E DF 16
(1.001200) pb0 68 0B 0B 68 82 87 08 3E 3C 42 05 00 FF 05 9B 71 16
";
    let passport = captured(log).unwrap().remove(0);
    assert_eq!(passport.settings, []);
    assert_eq!(passport.project.user_parameters, None);
    assert!(passport.absent.contains(&"settings.steps-per-turn".to_owned()));
}

#[test]
fn a_capture_without_an_encoder_says_what_to_record() {
    let trouble = captured("(1.000000) can0 42F#00010001000000\n").unwrap_err();
    assert_eq!(trouble.kind, Kind::Usage);
    assert!(trouble.remedy.contains("start-up"), "{trouble}");
}

#[test]
fn a_damaged_line_is_complained_of_and_the_rest_is_read() {
    let log = "(1.0) can0 42F#00D40101000000\nnonsense\n(2.000000) can0 3C5#10000000\n";
    let mut complaints = 0;
    let mut reader = Reader::new(log.as_bytes(), Format::Log);
    let passports = from_capture(&mut reader, "test", &mut |_| complaints += 1).unwrap();
    assert_eq!(complaints, 1);
    assert_eq!(passports[0].position.steps, Some(16));
}
