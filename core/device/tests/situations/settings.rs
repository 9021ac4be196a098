//! Settings over DeviceNet: steps, total, direction, preset, COS delta (AMG manual §4 and §8).

use codewheel_device::Event;
use codewheel_station::Duration;

use crate::bench::Bench;

const N: u32 = 1 << 29;

#[test]
fn the_manuals_example_3600_steps_and_256_turns() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    assert_eq!(bench.write(7, 3_600), "90");
    assert_eq!(bench.read(8), 3_600 * 65_536);
    assert_eq!(bench.write(8, 921_600), "90");
    bench.asks("0E 2F 01 08", "8E 00 10 0E 00");
    bench.turn_to(8_192 * 300 + 4_096);
    assert_eq!(bench.read(12), (300 % 256) * 3_600 + 1_800);
}

#[test]
fn writing_steps_keeps_the_turns_and_moves_the_total() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(8, 8_192 * 100);
    bench.write(7, 1_000);
    assert_eq!(bench.read(8), 100_000);
    bench.write(8, 7);
    bench.write(7, 500);
    assert_eq!(bench.read(8), 500, "less than a turn counts as one");
}

#[test]
fn what_is_out_of_range_is_refused_and_changes_nothing() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.write(7, 3_600);
    bench.write(8, 921_600);
    bench.write(10, 1_000);
    let state = |bench: &mut Bench| [7, 8, 10, 11, 12, 91].map(|attribute| bench.read(attribute));
    let before = state(&mut bench);
    for (attribute, value) in [
        (7, 0),
        (7, 8_193),
        (7, u32::MAX),
        (8, 0),
        (8, 3_600 * 65_536 + 1),
        (8, u32::MAX),
        (10, 921_600),
        (10, u32::MAX),
        (11, 0),
        (11, 921_601),
        (11, (-1_i32) as u32),
    ] {
        assert_eq!(bench.write(attribute, value), "9409FF", "attribute {attribute} := {value}");
    }
    bench.asks("10 2F 01 03 02", "94 09 FF");
    assert_eq!(state(&mut bench), before);
    bench.asks("10 2F 01 07 10 0E", "94 13 FF");
    bench.asks("10 2F 01 07 10 0E 00 00 00", "94 15 FF");
    bench.asks("10 2F 01 03", "94 13 FF");
    assert_eq!(state(&mut bench), before);
}

#[test]
fn on_a_singleturn_encoder_the_total_is_the_steps() {
    let mut bench = Bench::power_up("hmg10-d13").allocated();
    assert_eq!(bench.read(8), 8_192);
    assert_eq!(bench.write(7, 360), "90");
    assert_eq!(bench.read(8), 360);
    assert_eq!(bench.write(8, 359), "9409FF");
    assert_eq!(bench.write(8, 360), "90");
    bench.turn_to(4_096);
    assert_eq!(bench.read(12), 180);
}

#[test]
fn a_preset_makes_the_position_the_preset_value() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.turn_to(123_456);
    assert_eq!(bench.write(10, 1_000), "90");
    assert_eq!(bench.read(12), 1_000);
    assert_eq!(bench.read(91), 1_000 - 123_456);
    assert_eq!(bench.read(10), 1_000);
    bench.turn_to(123_457);
    assert_eq!(bench.read(12), 1_001);
    bench.says("42D#", &["3C5#E9030000"]);
}

#[test]
fn a_real_change_clears_preset_and_offset_and_the_value_in_force_changes_nothing() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.turn_to(123_456);
    for (attribute, value) in [(7, 8_191), (8, 1_000_000)] {
        bench.write(10, 1_000);
        assert_eq!(bench.write(attribute, value), "90");
        assert_eq!((bench.read(10), bench.read(91)), (0, 0));
        bench.write(10, 1_000);
        assert_eq!(bench.write(attribute, value), "90");
        assert_eq!(bench.read(10), 1_000);
        assert_ne!(bench.read(91), 0);
    }
    bench.asks("10 2F 01 03 01", "90");
    assert_eq!((bench.read(10), bench.read(91)), (0, 0));
}

#[test]
fn counterclockwise_the_position_falls_with_the_code() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("10 2F 01 03 01", "90");
    bench.turn_to(1);
    assert_eq!(bench.read(12), i64::from(N) - 1);
    assert_eq!(bench.read(80), 0b111);
    bench.turn_to(N - 1);
    assert_eq!(bench.read(12), 1);
}

#[test]
fn a_smaller_total_pulls_the_cos_delta_down() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    assert_eq!(bench.write(11, 5_000), "90");
    bench.write(8, 1_000);
    assert_eq!(bench.read(11), 1_000);
}

#[test]
fn read_only_attributes_are_not_settable_and_unknown_ones_not_supported() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    for attribute in [1, 2, 4, 5, 6, 9, 12, 80, 85, 91, 95] {
        assert_eq!(bench.write(attribute, 1), "940EFF");
    }
    for attribute in [0, 13, 79, 90, 92, 93, 94, 96, 255] {
        assert_eq!(bench.write(attribute, 1), "9414FF");
        bench.asks(&format!("0E 2F 01 {attribute:02X}"), "94 14 FF");
    }
    bench.asks("0E 2F 02 07", "94 16 FF");
    bench.asks("10 2F 02 07 00", "94 16 FF");
    bench.asks("0E 2F 00 01", "8E 0100");
    bench.asks("0E 2F 00 03", "94 14 FF");
    bench.asks("10 2F 00 03 00", "94 08 FF");
    bench.asks("0D 2F 01", "94 08 FF");
}

#[test]
fn reset_loads_the_defaults_and_offset_zero() {
    for path in ["2F 01", "2F 00"] {
        let mut bench = Bench::power_up("amg11-d29").allocated();
        bench.turn_to(500);
        bench.write(7, 3_600);
        bench.write(10, 77);
        bench.asks(&format!("05 {path}"), "85");
        let now = [3, 7, 8, 10, 11, 12, 91].map(|attribute| bench.read(attribute));
        assert_eq!(now, [0, 8_192, i64::from(N), 0, 1, 500, 0]);
        bench.asks(&format!("05 {path} 00"), "94 15 FF");
        assert!(bench.events().contains(&Event::Reset));
        assert_eq!(bench.records, 0, "a reset writes no memory");
    }
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("05 2F 02", "94 16 FF");
}

#[test]
fn a_turning_shaft_is_looked_at_every_millisecond_and_a_still_one_never() {
    let mut bench = Bench::power_up("amg11-d29");
    bench.collect();
    bench.wait(Duration::from_secs(10));
    let before = bench.device.sensor_mut().looks;
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_secs(1));
    let looks = bench.device.sensor_mut().looks - before;
    assert!((1_000..=1_002).contains(&looks), "{looks} looks in a second");
    assert!(before < 5, "{before} looks at a shaft at rest");
}
