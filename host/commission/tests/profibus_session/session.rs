//! A session with one encoder.

use codewheel_commission::profibus::{ScanSettings, SessionSettings};
use codewheel_commission::{Kind, Name, Reading, Session};
use codewheel_device::profibus::configuration;
use codewheel_encoder::Direction;
use codewheel_profibus::State;
use codewheel_station::Duration;

use crate::bench::{Bench, PLC, RATE, alone, with_others};
use crate::stranger::Stranger;

fn key(key: &str) -> Name {
    Name::Key(key.to_owned())
}

#[test]
fn a_free_encoder_works_with_what_it_worked_with_before() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let before = bench.device(7).encoder().settings();
    let mut session = bench.open(7, &alone()).unwrap();
    let identity = session.identify().unwrap();
    assert_eq!((identity.product_code, identity.firmware.as_deref()), (0x059B, Some("1.21")));
    let sample = session.sample().unwrap();
    assert_eq!((sample.alarm, sample.warning), (Some(false), Some(false)));
    assert!(sample.cycle.is_some());
    assert_eq!(bench.device(7).slave().state(), State::DataExchange);
    assert_eq!(bench.device(7).slave().master(), Some(4));
    assert_eq!(bench.device(7).encoder().settings(), before);
    assert_eq!(sample.position, bench.device(7).encoder().position());
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn everything_is_told_by_its_name_and_where_it_lies() {
    let mut bench = Bench::new().with(7, "amg81-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let values = session.values().unwrap();
    let names: Vec<&str> = values.iter().map(|value| value.name.as_str()).collect();
    assert_eq!(names[..3], ["direction", "class-2", "commissioning-diagnostics"]);
    for (place, name) in names.iter().enumerate() {
        assert!(!names[place + 1..].contains(name), "{name} is told once");
    }
    let value = session.value(&key("steps-per-turn")).unwrap();
    assert_eq!(value.place, "octets 10–13 of Set_Prm, octets 40–43 of Slave_Diag");
    assert_eq!((value.reading, value.range), (Reading::Number(8_192), Some((1, 8_192))));
    assert!(value.writable && value.setting);
    let value = session.value(&key("direction")).unwrap();
    assert_eq!((value.reading, value.label.as_deref()), (Reading::Number(0), Some("CW")));
    let value = session.value(&key("software-version")).unwrap();
    assert_eq!((value.reading, value.writable), (Reading::Text("01.21".to_owned()), false));
    let value = session.value(&key("supported-warnings")).unwrap();
    assert_eq!(value.label.as_deref(), Some("lithium cell voltage too low"));
    let value = session.value(&key("configuration")).unwrap();
    assert_eq!(value.reading, Reading::Octets(vec![0xF1]));
    assert!(matches!(session.value(&key("position")).unwrap().reading, Reading::Number(_)));
    let octet = session.value(&Name::Octet(6)).unwrap();
    assert_eq!(octet.reading, Reading::Octets(vec![0x9B]));
    for unknown in [key("offsets"), Name::Octet(58), Name::Octet(0), Name::Parameter(3)] {
        assert_eq!(session.value(&unknown).unwrap_err().kind, Kind::Usage, "{unknown:?}");
    }
}

#[test]
fn a_parameter_is_set_and_read_back_from_the_diagnosis() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let total = session.write(&key("total-resolution"), &Reading::Number(921_600)).unwrap();
    assert_eq!(total.reading, Reading::Number(921_600));
    let steps = session.write(&key("steps-per-turn"), &Reading::Number(3_600)).unwrap();
    assert_eq!(steps.reading, Reading::Number(3_600));
    let direction = session.write(&key("direction"), &Reading::Text("ccw".to_owned())).unwrap();
    assert_eq!(direction.label.as_deref(), Some("CCW"));
    session.sample().unwrap();
    let settings = bench.device(7).encoder().settings();
    assert_eq!((settings.steps_per_turn, settings.total_resolution), (3_600, 921_600));
    assert_eq!(settings.direction, Direction::Ccw);
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn a_parameter_can_be_given_with_the_opening() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let parameters = vec![
        ("steps-per-turn".to_owned(), Reading::Number(100)),
        ("total-resolution".to_owned(), Reading::Number(1_000)),
    ];
    let settings = SessionSettings { parameters, ..alone() };
    bench.open(7, &settings).unwrap().sample().unwrap();
    assert_eq!(bench.device(7).encoder().settings().total_resolution, 1_000);
}

#[test]
fn a_refused_parameter_names_its_range_and_its_words_and_changes_nothing() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let before = session.values().unwrap();
    let trouble = session.write(&key("steps-per-turn"), &Reading::Number(70_000)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert_eq!(
        trouble.to_string(),
        "cannot write steps-per-turn 70000 of the encoder at address 7: it refuses that \
         (Prm_Fault); it has its old ones again; steps-per-turn takes 1 to 8192; a GSD file writes 70000 as \
         Measuring units per rev. hi 1, Measuring units per rev. lo 4464"
    );
    assert_eq!(session.values().unwrap(), before);
    session.write(&key("total-resolution"), &Reading::Number(1_000)).unwrap();
    assert_eq!(bench.device(7).slave().state(), State::DataExchange);
}

#[test]
fn steps_that_do_not_fit_the_total_are_refused_with_what_fits() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let trouble = session.write(&key("steps-per-turn"), &Reading::Number(3_600)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert!(
        trouble.remedy.ends_with("536870912 is too much: write that first, at most 235929600"),
        "{trouble}"
    );
}

#[test]
fn what_no_octets_can_say_is_not_sent() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    for (name, reading) in [
        ("direction", Reading::Number(2)),
        ("direction", Reading::Text("left".to_owned())),
        ("steps-per-turn", Reading::Number(-1)),
        ("total-resolution", Reading::Number(1 << 32)),
        ("offset", Reading::Number(0)),
        ("position", Reading::Number(0)),
        ("colour", Reading::Number(0)),
    ] {
        let trouble = session.write(&key(name), &reading).unwrap_err();
        assert_eq!(trouble.kind, Kind::Usage, "{trouble}");
        assert!(!trouble.remedy.is_empty(), "{trouble}");
    }
    let trouble = session.write(&key("direction"), &Reading::Number(2)).unwrap_err();
    assert_eq!(trouble.remedy, "it takes 0 (CW) or 1 (CCW)");
}

#[test]
fn class_1_has_a_short_diagnosis_and_no_scaling() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let class = session.write(&key("class-2"), &Reading::Number(0)).unwrap();
    assert_eq!(class.label.as_deref(), Some("OFF"));
    assert_eq!(session.value(&key("steps-per-turn")).unwrap_err().kind, Kind::Usage);
    assert_eq!(session.preset(5).unwrap_err().remedy, "write class-2 1 first");
    let class = session.write(&key("class-2"), &Reading::Number(1)).unwrap();
    assert_eq!(class.label.as_deref(), Some("ON"));
    assert_eq!(session.value(&key("steps-per-turn")).unwrap().reading, Reading::Number(8_192));
}

#[test]
fn two_octets_give_the_low_word() {
    let two = configuration::Row::find(0xD0);
    let mut bench = Bench::new().with(7, "amg11-p29");
    let settings = SessionSettings { configuration: two, ..alone() };
    let mut session = bench.open(7, &settings).unwrap();
    let sample = session.sample().unwrap();
    let trouble = session.preset(1).unwrap_err();
    assert_eq!(trouble.came, "configuration D0h has no preset");
    assert_eq!(sample.position, bench.device(7).encoder().position() & 0xFFFF);
}

#[test]
fn what_profibus_has_no_service_for_is_refused_with_what_to_do() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    for trouble in
        [session.save().unwrap_err(), session.restore().unwrap_err(), session.reset().unwrap_err()]
    {
        assert_eq!(trouble.kind, Kind::Refused);
        assert!(trouble.remedy.contains("PB29DPV0.GSD"), "{trouble}");
        assert!(trouble.remedy.contains("00 0A 00 00 20 00 20 00 00 00"), "{trouble}");
    }
}

#[test]
fn a_released_encoder_is_free_at_once_and_the_bus_silent() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    session.release().unwrap();
    assert_eq!(session.sample().unwrap_err().kind, Kind::Usage);
    assert_eq!(bench.device(7).slave().state(), State::WaitPrm);
    assert_eq!(bench.device(7).slave().master(), None);
    let said = bench.said;
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.said, said);
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn an_encoder_of_another_master_is_read_and_not_touched() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]);
    bench.run(Duration::from_millis(500));
    let mut session = bench.open(7, &with_others()).unwrap();
    let steps = session.value(&key("steps-per-turn")).unwrap();
    assert_eq!((steps.reading, steps.writable), (Reading::Number(3_600), false));
    let first = session.sample().unwrap();
    assert!(session.sample().unwrap().at > first.at);
    let trouble = session.write(&key("direction"), &Reading::Number(1)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert_eq!(trouble.came, "it belongs to master 2");
    assert!(trouble.remedy.contains("in the project of master 2"), "{trouble}");
    assert_eq!(session.preset(0).unwrap_err().came, "it belongs to master 2");
    session.release().unwrap();
    bench.run(Duration::from_millis(500));
    let slave = bench.plc().slave(7).unwrap();
    assert_eq!(slave.losses, 0);
    assert_eq!(bench.device(7).slave().master(), Some(PLC));
    assert_eq!(bench.device(7).encoder().settings().direction, Direction::Cw);
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn beside_another_master_a_free_encoder_is_served_and_given_back() {
    let mut bench = Bench::new().with(7, "amg11-p29").with(8, "hmg10-p29").with_plc(&[7]);
    bench.run(Duration::from_millis(500));
    let mut session = bench.open(8, &with_others()).unwrap();
    session.write(&key("total-resolution"), &Reading::Number(8_192)).unwrap();
    session.preset(1_000).unwrap();
    session.release().unwrap();
    let before = bench.plc().slave(7).unwrap().answers;
    bench.run(Duration::from_millis(200));
    let slave = bench.plc().slave(7).unwrap();
    assert_eq!(slave.losses, 0);
    assert!(slave.answers > before + 100);
    assert_eq!(bench.device(8).slave().state(), State::WaitPrm);
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn a_slave_of_another_make_tells_its_octets_and_nothing_is_sent_to_it() {
    let diagnosis = [0x02, 0x05, 0x00, 0xFF, 0x80, 0x1D, 0x03, 0xAB, 0xCD];
    let mut bench = Bench::new().with_stranger(Stranger::new(20, RATE, &diagnosis));
    let mut session = bench.open(20, &alone()).unwrap();
    assert_eq!(session.identify().unwrap().product_code, 0x801D);
    let values = session.values().unwrap();
    assert_eq!(values.len(), 9);
    assert_eq!(
        (values[7].name.as_str(), &values[7].reading),
        ("octet/8", &Reading::Octets(vec![0xAB]))
    );
    assert_eq!(session.value(&key("octet/9")).unwrap().reading, Reading::Octets(vec![0xCD]));
    let trouble = session.write(&key("direction"), &Reading::Number(1)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert!(trouble.remedy.contains("GSD"), "{trouble}");
    assert_eq!(session.sample().unwrap_err().kind, Kind::Refused);
    session.release().unwrap();
}

#[test]
fn the_own_address_and_addresses_that_do_not_exist_are_not_opened() {
    let mut bench = Bench::new();
    for address in [4, 126] {
        let trouble = bench.open(address, &alone()).unwrap_err();
        assert_eq!(trouble.kind, Kind::Usage);
    }
    let master = ScanSettings { address: 126, ..ScanSettings::default() };
    let trouble = bench.open(7, &SessionSettings { master, ..alone() }).unwrap_err();
    assert_eq!(trouble.kind, Kind::Usage, "{trouble}");
    assert_eq!(bench.said, 0);
}
