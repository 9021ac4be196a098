//! Presets (PROFIBUS manual §7.4).

use codewheel_commission::profibus::SessionSettings;
use codewheel_commission::{Kind, Name, Reading, Session};
use codewheel_device::profibus::configuration;
use codewheel_profibus::State;

use crate::bench::{Bench, alone};

#[test]
fn a_preset_makes_the_position_and_is_found_in_the_offset() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let before = i64::from(session.sample().unwrap().position);
    let sample = session.preset(123_456).unwrap();
    assert_eq!((sample.position, sample.alarm), (123_456, Some(false)));
    let offset = session.value(&Name::Key("offset".to_owned())).unwrap();
    assert_eq!(offset.reading, Reading::Number(123_456 - before));
    assert_eq!(session.preset(0).unwrap().position, 0);
    let total = 1 << 29;
    assert_eq!(session.preset(total - 1).unwrap().position, total - 1);
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn a_preset_is_sent_twice_with_the_top_bit_and_without_it() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    session.preset(5).unwrap();
    assert_eq!(bench.outputs, [[0, 0, 0, 0], [0x80, 0, 0, 5], [0, 0, 0, 5]]);
    let two = configuration::Row::find(0xF0);
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut session = bench.open(7, &SessionSettings { configuration: two, ..alone() }).unwrap();
    session.preset(0x1234).unwrap();
    session.release().unwrap();
    assert_eq!(bench.outputs, [[0, 0], [0x92, 0x34], [0x12, 0x34], [0, 0]]);
}

#[test]
fn a_preset_out_of_range_is_refused_and_never_sent() {
    let mut bench = Bench::new().with(7, "amg11-p13");
    let mut session = bench.open(7, &alone()).unwrap();
    let before = session.sample().unwrap().position;
    for preset in [8_192, 1 << 31, u32::MAX] {
        let trouble = session.preset(preset).unwrap_err();
        assert_eq!(
            (trouble.kind, trouble.came.as_str()),
            (Kind::Refused, "the preset is out of range")
        );
        assert!(trouble.remedy.starts_with("it takes 0 to 8191"), "{trouble}");
    }
    let sample = session.sample().unwrap();
    assert_eq!((sample.position, sample.alarm), (before, Some(false)));
    assert_eq!(session.preset(8_191).unwrap().position, 8_191);
    assert_eq!(bench.device(7).slave().state(), State::DataExchange);
}

#[test]
fn two_octets_carry_presets_of_15_bits() {
    let two = configuration::Row::find(0xF0);
    let mut bench = Bench::new().with(7, "amg11-p29");
    let settings = SessionSettings { configuration: two, ..alone() };
    let mut session = bench.open(7, &settings).unwrap();
    assert_eq!(session.preset(0x7FFF).unwrap().position, 0x7FFF);
    let trouble = session.preset(0x8000).unwrap_err();
    assert!(trouble.remedy.contains("0 to 32767, which is all"), "{trouble}");
}

#[test]
fn a_preset_that_the_encoder_refuses_is_told_with_its_alarm() {
    let mut bench = Bench::new().with_silent_ssi(7, "heag162-p29");
    let mut session = bench.open(7, &alone()).unwrap();
    let trouble = session.preset(5).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused, "{trouble}");
    assert_eq!(
        trouble.came,
        "it did not take it: the position is 0, the offset as before, and its alarm is on"
    );
    assert!(trouble.remedy.contains("SSI line brings no position"), "{trouble}");
}
