//! Settings whose number of turns is not 2ⁿ, over crossings and without power (encoder clause 2).

use codewheel_sim::memory::TornMemory;
use codewheel_station::Duration;

use crate::bench::{Bench, Hand, STANDARD, octets_of, variable};

/// 3600 steps, 100 turns: 65 536 turns are no multiple of that.
const HUNDRED_TURNS: &str = "0A 00000E10 00057E40";
const RANGE: u32 = 8_192 * 65_536;
const TOTAL: u64 = 360_000;

fn position(bench: &mut Bench) -> u64 {
    u64::from(bench.position("00000000"))
}

/// Through the zero of the code: it stands a turn behind it, after 65 537 turns.
fn crossed() -> Bench {
    let mut bench = Bench::power_up("amg11-p29").running(HUNDRED_TURNS);
    for quarter in 1..=4 {
        bench.turn_to((RANGE / 4 * quarter) & (RANGE - 1));
    }
    bench.turn_to(8_192);
    assert_eq!(position(&mut bench), 65_537 * 3_600 % TOTAL);
    bench
}

#[test]
fn the_same_parameters_after_power_off_give_the_same_position() {
    let bench = crossed();
    let mut bench = bench.power_cycled(8_192).running(HUNDRED_TURNS);
    assert_eq!(position(&mut bench), 65_537 * 3_600 % TOTAL);
    // Turned without power, but for less than a quarter of the range: back across the zero.
    let mut bench = bench.power_cycled(RANGE - 8_192).running(HUNDRED_TURNS);
    assert_eq!(position(&mut bench), 65_535 * 3_600 % TOTAL);
}

#[test]
fn the_range_begins_where_the_settings_came_into_force_and_keeps_its_beginning() {
    // Crossed before the settings came: k₀ is not 0.
    let mut bench = Bench::power_up("amg11-p29").running("02");
    for quarter in 1..=4 {
        bench.turn_to((RANGE / 4 * quarter) & (RANGE - 1));
    }
    bench.turn_to(8_192);
    bench.position("00000000");
    assert_eq!(bench.writes(), 0, "what divides the range needs no memory");
    bench.brings_up(HUNDRED_TURNS, 0xF1);
    assert_eq!(position(&mut bench), 3_600);
    assert_eq!(bench.writes(), 1);
    for other in ["02", "00", "0A 00000E10 000E1000"] {
        bench.brings_up(other, 0xF1);
        assert_eq!(bench.writes(), 1, "{other}");
    }
    let mut bench = bench.power_cycled(8_192).running(HUNDRED_TURNS);
    assert_eq!(position(&mut bench), 3_600);
    assert_eq!(bench.writes(), 1, "the same settings again are not written");
}

#[test]
fn the_reference_is_written_only_when_the_shaft_is_far_from_it() {
    let mut bench = Bench::power_up("amg11-p29").running(HUNDRED_TURNS);
    assert_eq!(bench.writes(), 1);
    for _ in 0..8 {
        bench.turn_to(RANGE / 4);
        bench.turn_to(0);
    }
    assert_eq!(bench.writes(), 1, "a quarter of the range is near");
    bench.turn_to(RANGE / 4);
    bench.turn_to(RANGE / 4 + 1);
    bench.exchanges("00000000");
    assert_eq!(bench.writes(), 2);
}

#[test]
fn a_preset_under_such_settings_survives_with_its_turns() {
    let mut bench = crossed();
    assert_eq!(bench.position("80000000"), 0);
    let mut bench = bench.power_cycled(16_384).running(HUNDRED_TURNS);
    assert_eq!(position(&mut bench), 3_600);
    // Settings of which only the turns are kept, beside those with the preset.
    bench.brings_up("0A 00000001 00000003", 0xF1);
    let other = position(&mut bench);
    let mut bench = bench.power_cycled(16_384).running("0A 00000001 00000003");
    assert_eq!(position(&mut bench), other);
    let writes = bench.writes();
    bench.brings_up(HUNDRED_TURNS, 0xF1);
    assert_eq!(position(&mut bench), 3_600);
    bench.brings_up("0A 00000001 00000003", 0xF1);
    assert_eq!(position(&mut bench), other);
    assert_eq!(bench.writes(), writes, "both are known");
}

#[test]
fn settings_count_their_turns_from_where_the_shaft_stands_when_they_come() {
    let hand = Hand { code: RANGE - 10, ..Hand::default() };
    let mut bench = Bench::power_up_with("amg11-p29", TornMemory::new(), hand);
    bench.wait(Duration::from_millis(10));
    // Through the zero, and not looked at before the telegram ends.
    bench.device.sensor_mut().code = 8_192;
    let set_prm = [STANDARD, HUNDRED_TURNS].concat();
    let body = [&[0x87, 0x82, 0x5C, 0x3D, 0x3E][..], &octets_of(&set_prm)].concat();
    assert_eq!(bench.hears_now(&variable(&body)).as_deref(), Some("E5"));
    bench.configures(0xF1);
    assert_eq!(position(&mut bench), 3_600);
}

#[test]
fn a_singleturn_disc_keeps_no_turns() {
    let mut bench = Bench::power_up("amg11-p13").running("0A 00002000 00000BB8");
    bench.turn_to(3_000);
    assert_eq!(bench.position("00000000"), 0);
    bench.turn_to(6_000);
    bench.turn_to(1_000);
    assert_eq!(bench.position("00000000"), (8_192 + 1_000) % 3_000, "it runs on without a jump");
    assert_eq!(bench.writes(), 0);
    let mut bench = bench.power_cycled(1_000).running("0A 00002000 00000BB8");
    assert_eq!(bench.position("00000000"), 1_000);
}

#[test]
fn turns_counted_in_class_1_are_there_when_class_2_comes_back() {
    for octets in [HUNDRED_TURNS, "0B 00000E10 00057E40"] {
        for preset in [false, true] {
            let mut bench = Bench::power_up("amg11-p29").running(octets);
            bench.turn_to(8_192);
            bench.position("00000000");
            if preset {
                bench.position("80000064");
            }
            let before = i64::from(bench.position("00000000"));
            bench.brings_up("00", 0xD1);
            for quarter in 1..=4 {
                bench.turn_to((RANGE / 4 * quarter) & (RANGE - 1));
                bench.exchanges("");
            }
            bench.turn_to(3 * 8_192);
            bench.exchanges("");
            bench.brings_up(octets, 0xF1);
            let sign = if octets.starts_with("0B") { -1 } else { 1 };
            let moved = sign * (65_536 + 2) * 3_600;
            let after = i64::from(bench.position("00000000"));
            assert_eq!(after, (before + moved).rem_euclid(360_000), "{octets} {preset}");
            let mut bench = bench.power_cycled(3 * 8_192).running(octets);
            assert_eq!(i64::from(bench.position("00000000")), after, "{octets} {preset} power");
        }
    }
}

#[test]
fn a_preset_under_settings_with_turns_keeps_their_reference() {
    let mut bench = Bench::power_up("amg11-p29").running(HUNDRED_TURNS);
    bench.turn_to(8_192);
    bench.position("00000000");
    bench.position("80000000");
    for quarter in 1..=4 {
        bench.turn_to((RANGE / 4 * quarter) & (RANGE - 1));
        bench.exchanges("00000000");
    }
    let before = bench.position("00000000");
    let mut bench = bench.power_cycled(0).running(HUNDRED_TURNS);
    assert_eq!(bench.position("00000000"), before);
}
