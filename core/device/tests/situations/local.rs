//! The services of class 2Fh without a network, beside a master that goes on.

use codewheel_device::devicenet::NotWritten;
use codewheel_device::devicenet::rows::{Range, Row, Value};
use codewheel_device::{DeviceNetEncoder, Event};
use codewheel_encoder::Refusal;

use crate::bench::{Bench, Hand};

fn row(key: &str) -> &'static Row {
    Row::with_key(key).expect("a key")
}

fn number(device: &DeviceNetEncoder<Hand>, key: &str) -> Value {
    device.read(row(key))
}

#[test]
fn a_local_write_is_what_the_master_reads_and_is_told_like_its_own() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.events();
    bench.device.write(bench.now, row("steps-per-turn"), 3_600).unwrap();
    assert_eq!(bench.read(7), 3_600);
    assert_eq!(bench.events(), [Event::SettingChanged { attribute: 7 }]);
    bench.device.write(bench.now, row("preset"), 42).unwrap();
    assert_eq!(bench.read(12), 42);
    assert_eq!(bench.events(), [Event::Preset]);
}

#[test]
fn a_local_write_that_is_refused_says_what_is_allowed_and_changes_nothing() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.events();
    let before = bench.device.encoder().block();
    let now = bench.now;
    let mut refused = |key, value| bench.device.write(now, row(key), value).unwrap_err();
    let too_many = NotWritten::Refused(Refusal::StepsPerTurn { max: 8_192 });
    assert_eq!(refused("steps-per-turn", 8_193), too_many);
    assert_eq!(too_many.to_string(), "the steps per turn are 1 to 8192");
    assert_eq!(refused("position", 1), NotWritten::ReadOnly);
    let octets = Range { minimum: 0, maximum: 1 };
    assert_eq!(refused("direction", 2), NotWritten::DataType(octets));
    assert!(matches!(refused("preset", -1), NotWritten::DataType(_)));
    assert!(matches!(refused("preset", 1 << 32), NotWritten::DataType(_)));
    assert!(matches!(refused("cos-delta", -1), NotWritten::Refused(_)));
    assert_eq!(bench.device.encoder().block(), before);
    assert!(bench.events().is_empty());
}

#[test]
fn a_local_save_ends_when_its_record_is_written_and_answers_nobody() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.serves_memory = false;
    bench.device.write(bench.now, row("cos-delta"), 7).unwrap();
    bench.device.save(bench.now).unwrap();
    assert!(bench.device.is_saving());
    let kept = bench.device.keep(bench.now).expect("a record");
    assert_eq!(kept.saved.cos_delta, 7);
    assert!(bench.device.save(bench.now).is_err(), "one record is on its way");
    bench.device.kept(bench.now, Ok::<(), ()>(()));
    assert!(!bench.device.is_saving());
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.device.read_saved(row("cos-delta")), Some(Value::Number(7)));
}

#[test]
fn local_restore_and_reset_bring_back_what_is_kept_and_what_is_new() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.device.write(bench.now, row("cos-delta"), 7).unwrap();
    bench.device.save(bench.now).unwrap();
    bench.serve_memory();
    bench.device.write(bench.now, row("cos-delta"), 9).unwrap();
    bench.device.restore(bench.now).unwrap();
    assert_eq!(number(&bench.device, "cos-delta"), Value::Number(7));
    bench.device.reset(bench.now).unwrap();
    assert_eq!(number(&bench.device, "cos-delta"), Value::Number(1));
    assert_eq!(bench.device.read_saved(row("cos-delta")), Some(Value::Number(7)));
}

/// A preset far from the last production is one of the changes that change of state produces.
#[test]
fn a_local_preset_is_produced_like_any_other_change() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("4B 03 01 50 0A", "CB 00");
    bench.asks("10 05 04 09 00 00", "90 0000");
    bench.collect();
    bench.device.write(bench.now, row("preset"), 0x12).unwrap();
    codewheel_station::Station::advance(&mut bench.device, bench.now);
    assert!(bench.collect().iter().any(|frame| frame.ends_with("#12000000")));
}
