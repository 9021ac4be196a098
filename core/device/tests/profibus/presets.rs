//! The preset function and its clock bit (PROFIBUS manual §7.4; profibus clause 3).

use codewheel_device::Event;
use codewheel_station::Duration;

use crate::bench::{Bench, EXAMPLE, FULL_RANGE, octets_of};

fn at_code_1000(octets: &str) -> Bench {
    let mut bench = Bench::power_up("amg11-p29").running(octets);
    bench.turn_to(1_000);
    bench
}

/// The manual's example: step 1 sends 80000000h, step 2 00000000h.
#[test]
fn the_rise_of_the_top_bit_sets_the_position_in_that_very_telegram() {
    let mut bench = at_code_1000(FULL_RANGE);
    assert_eq!(bench.position("00000000"), 1_000);
    assert_eq!(bench.position("80000000"), 0);
    assert_eq!(bench.position("00000000"), 0);
    assert_eq!(bench.position("80001234"), 0x1234);
    let diagnosis = bench.diagnosis();
    assert_eq!(diagnosis[31..35], (0x1234_i32 - 1_000).to_be_bytes());
    assert!(bench.events().contains(&Event::Preset));
}

#[test]
fn a_set_bit_presets_once_and_the_value_may_change_under_it() {
    let mut bench = at_code_1000(FULL_RANGE);
    bench.position("00000000");
    assert_eq!(bench.position("80000005"), 5);
    bench.turn_to(1_010);
    assert_eq!(bench.position("80000005"), 15);
    assert_eq!(bench.position("80000063"), 15, "no rise, no preset");
    assert_eq!(bench.position("00000063"), 15, "the fall is none");
    assert_eq!(bench.position("80000063"), 0x63);
}

/// Decision: a PLC that restarts with a stuck bit must not shift the axis.
#[test]
fn a_bit_that_is_set_when_the_exchange_begins_is_no_rise() {
    let mut bench = at_code_1000(FULL_RANGE);
    assert_eq!(bench.position("80000000"), 1_000);
    assert_eq!(bench.position("80000007"), 1_000);
    bench.position("00000000");
    assert_eq!(bench.position("80000007"), 7);
    bench.position("00000000");
    // Another start, another configuration: the bit must be seen 0 again.
    bench.brings_up(FULL_RANGE, 0xF1);
    assert_eq!(bench.position("80000000"), 7);
    bench.position("00000000");
    bench.configures(0xF0);
    assert_eq!(bench.exchanges("8000").1, "0007");
    bench.exchanges("0000");
    assert_eq!(bench.exchanges("8009").1, "0009");
}

#[test]
fn after_the_watchdog_the_bit_must_be_seen_0_again() {
    let mut bench = at_code_1000(FULL_RANGE);
    bench.position("00000000");
    bench.wait(Duration::from_secs(3));
    bench.brings_up(FULL_RANGE, 0xF1);
    assert_eq!(bench.position("80000000"), 1_000);
}

#[test]
fn clear_counts_as_seen_0() {
    let mut bench = at_code_1000(FULL_RANGE);
    assert_eq!(bench.position("80000000"), 1_000);
    bench.controls(0x02);
    assert_eq!(bench.position("80000003"), 3);
    // An empty Data_Exchange is Clear too.
    assert_eq!(bench.exchanges("").1, "00000003");
    assert_eq!(bench.position("80000009"), 9);
}

#[test]
fn one_word_has_15_bits_of_preset() {
    let mut bench = Bench::power_up("amg11-p13");
    bench.turn_to(100);
    bench.brings_up("0A 00002000 00002000", 0xF0);
    assert_eq!(bench.exchanges("0000").1, "0064");
    assert_eq!(bench.exchanges("9FFF").1, "1FFF");
    bench.turn_to(101);
    assert_eq!(bench.exchanges("1FFF").1, "0000");
}

#[test]
fn presets_of_both_ends_of_the_range_are_exact_in_both_directions() {
    for octets in [EXAMPLE, "0B 00000E10 000E1000"] {
        let mut bench = at_code_1000(octets);
        bench.turn_to(0x1234_5678);
        for preset in [0, 1, 460_800, 921_599] {
            bench.position("00000000");
            assert_eq!(bench.position(&format!("{:08X}", 0x8000_0000_u32 | preset)), preset);
        }
    }
}

#[test]
fn a_preset_takes_the_shaft_where_it_is_and_the_inputs_where_it_has_come_to() {
    let mut bench = at_code_1000(FULL_RANGE);
    bench.position("00000000");
    bench.wait(Duration::from_millis(10));
    // Not looked at before the telegram ends.
    bench.device.sensor_mut().code = 1_003;
    let answer = bench.hears_now(&octets_of("68 07 07 68 07 02 7D 80 00 00 00 06 16"));
    assert_eq!(answer.expect("inputs")[14..22], *"00000000");
    bench.device.sensor_mut().code = 1_005;
    assert_eq!(bench.position("00000000"), 2);
}

#[test]
fn without_class_2_presets_are_ignored_and_no_offset_is_in_force() {
    let mut bench = at_code_1000(FULL_RANGE);
    bench.position("00000000");
    assert_eq!(bench.position("80000000"), 0);
    bench.events();
    bench.brings_up("00", 0xF1);
    let told = bench.told();
    assert!(told.iter().any(|text| text.starts_with("presets are ignored")), "{told:?}");
    assert!(
        told.iter().any(|text| text.starts_with("the kept offset -1000 is not in force")),
        "{told:?}"
    );
    assert_eq!(bench.position("00000000"), 1_000);
    assert_eq!(bench.position("80000000"), 1_000);
    bench.position("00000000");
    // Not even one that is out of range is looked at.
    assert_eq!(bench.exchanges("FFFFFFFF"), (0x08, "000003E8".into()));
    bench.brings_up(FULL_RANGE, 0xF1);
    assert_eq!(bench.position("00000000"), 0);
    assert!(bench.told().iter().any(|text| text.starts_with("the kept offset -1000 is in force")));
}

/// Class 2 without scaling and class 1 measure alike, but only one has an offset.
#[test]
fn an_offset_made_without_scaling_is_not_in_force_in_class_1() {
    let mut bench = at_code_1000("02");
    bench.position("00000000");
    assert_eq!(bench.position("80000010"), 0x10);
    bench.brings_up("00", 0xD1);
    assert_eq!(bench.position(""), 1_000);
    bench.brings_up("02", 0xF1);
    assert_eq!(bench.position("00000000"), 0x10);
}

#[test]
fn identical_parameters_touch_no_offset_and_other_ones_set_it_aside() {
    let mut bench = at_code_1000(EXAMPLE);
    bench.position("00000000");
    assert_eq!(bench.position("80000010"), 0x10);
    bench.brings_up(EXAMPLE, 0xF1);
    assert_eq!(bench.position("00000000"), 0x10);
    for other in ["0B 00000E10 000E1000", "0A 00000E11 000E1000", "0A 00000E10 000E0FFF", "02"] {
        bench.brings_up(other, 0xF1);
        assert_eq!(bench.diagnosis()[31..35], [0; 4], "{other}");
        bench.brings_up(EXAMPLE, 0xF1);
        assert_eq!(bench.position("00000000"), 0x10, "{other}");
    }
    assert_eq!(bench.snapshot().in_force.preset, 0x10);
}

#[test]
fn a_telegram_that_is_repeated_presets_once() {
    let mut bench = at_code_1000(FULL_RANGE);
    bench.position("00000000");
    // FCB 1, as the bench's next request has it or not: both are new once.
    let request = octets_of("68 07 07 68 07 02 7D 80 00 00 00 06 16");
    let other = octets_of("68 07 07 68 07 02 5D 00 00 00 00 66 16");
    bench.hears(&other);
    bench.hears(&request);
    bench.turn_to(1_100);
    let answer = bench.hears(&request).expect("the stored answer");
    assert_eq!(&answer[14..22], "00000000");
    bench.hears(&other);
    assert_eq!(bench.device.encoder().position(), 100);
}

#[test]
fn a_clock_bit_that_is_set_at_entry_is_told() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.events();
    bench.position("80000005");
    let told = bench.told();
    assert!(!told.is_empty(), "a preset was ignored in silence");
}

#[test]
fn a_preset_in_the_telegram_of_a_jump_counts_from_the_new_code() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.position("00000000");
    bench.device.sensor_mut().code = 1_000_000;
    let (reply, inputs) = bench.exchanges("80000007");
    assert_eq!((reply, inputs.as_str()), (0x0A, "00000007"));
}
