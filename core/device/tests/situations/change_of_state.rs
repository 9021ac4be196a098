//! What an encoder takes for a change of state (AMG manual §3.2; devicenet clause 6).

use codewheel_encoder::Start;
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, hex};

/// N, the number of codes of the disc.
const N: u32 = 1 << 29;

/// An unacknowledged change of state connection that never produces by time, with assembly
/// `assembly`; its first production is out.
fn producing(model: &str, assembly: u8) -> Bench {
    let mut bench = Bench::power_up(model).allocated();
    bench.asks("4B 03 01 50 0A", "CB 00");
    bench.asks(&format!("10 05 04 0E 20 04 24 {assembly:02X}"), "90");
    let first = bench.produces_when_asked("10 05 04 09 00 00");
    assert_eq!(first.len(), 1);
    bench
}

fn production(position: u32) -> Vec<String> {
    vec![format!("345#{}", hex(&position.to_le_bytes()))]
}

fn nothing() -> Vec<String> {
    Vec::new()
}

#[test]
fn becoming_established_produces_the_position_at_once() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("4B 03 01 50 0A", "CB 00");
    assert_eq!(bench.turned_to(4_711), nothing());
    assert_eq!(bench.produces_when_asked("0D 05 04"), production(4_711));
}

#[test]
fn the_delta_counts_from_the_value_last_sent_either_way() {
    let mut bench = producing("amg11-d29", 1);
    assert_eq!(bench.write(11, 100), "90");
    bench.turned_to(1_000);
    let start = bench.read(12) as u32;
    assert_eq!(start, 1_000);
    assert_eq!(bench.turned_to(1_099), nothing());
    assert_eq!(bench.turned_to(901), nothing());
    assert_eq!(bench.turned_to(1_100), production(1_100));
    assert_eq!(bench.turned_to(1_199), nothing());
    assert_eq!(bench.turned_to(1_001), nothing());
    assert_eq!(bench.turned_to(1_000), production(1_000));
    // Small steps add up.
    for code in 1_001..1_100 {
        assert_eq!(bench.turned_to(code), nothing());
    }
    assert_eq!(bench.turned_to(1_100), production(1_100));
}

#[test]
fn with_the_default_delta_of_one_every_step_is_produced() {
    let mut bench = producing("amg11-d29", 1);
    for code in [1, 2, 3, 2, 3] {
        assert_eq!(bench.turned_to(code), production(code));
    }
    assert_eq!(bench.turned_to(3), nothing());
    assert_eq!(bench.wait(Duration::from_secs(1_000)), nothing());
}

#[test]
fn a_poll_response_is_no_production_of_the_connection() {
    let mut bench = producing("amg11-d29", 1);
    bench.write(11, 100);
    bench.turned_to(5_000);
    bench.turned_to(5_060);
    bench.says("42D#", &["3C5#C4130000"]);
    assert_eq!(bench.turned_to(5_099), nothing());
    assert_eq!(bench.turned_to(5_100), production(5_100));
}

#[test]
fn the_raw_zero_and_the_end_of_the_range_are_no_jumps() {
    let mut bench = producing("amg11-d29", 1);
    bench.write(11, 10);
    assert_eq!(bench.turned_to(N - 9), nothing());
    assert_eq!(bench.turned_to(N - 10), production(N - 10));
    assert_eq!(bench.turned_to(N - 1), nothing());
    assert_eq!(bench.turned_to(0), production(0));
    // The end of a range that lies elsewhere than the raw zero.
    bench.write(8, 3_000);
    bench.write(11, 10);
    bench.turned_to(2_995);
    assert_eq!(bench.turned_to(3_004), nothing());
    assert_eq!(bench.turned_to(3_005), production(5));
    assert_eq!(bench.turned_to(2_996), nothing());
    assert_eq!(bench.turned_to(2_995), production(2_995));
}

#[test]
fn a_delta_above_half_the_range_and_the_whole_range_work_too() {
    let mut bench = producing("amg11-d29", 1);
    bench.write(8, 1_000);
    bench.write(11, 600);
    bench.turned_to(600); // position 600, sent
    assert_eq!(bench.turned_to(1_199), nothing());
    assert_eq!(bench.turned_to(1_200), production(200));
    assert_eq!(bench.turned_to(601), nothing());
    assert_eq!(bench.turned_to(600), production(600));
    // Once round: the position is where it was, and it was sent all the same.
    assert_eq!(bench.write(11, 1_000), "90");
    bench.collect();
    assert_eq!(bench.turned_to(1_599), nothing());
    assert_eq!(bench.turned_to(1_600), production(600));
}

#[test]
fn counterclockwise_the_delta_counts_alike() {
    let mut bench = producing("amg11-d29", 1);
    bench.asks("10 2F 01 03 01", "90");
    bench.write(11, 10);
    bench.collect();
    assert_eq!(bench.turned_to(9), nothing());
    assert_eq!(bench.turned_to(10), production(N - 10));
    assert_eq!(bench.turned_to(1), nothing());
    assert_eq!(bench.turned_to(0), production(0));
}

#[test]
fn a_preset_is_produced_at_once_and_a_refused_one_is_not() {
    let mut bench = producing("amg11-d29", 1);
    bench.write(11, 1_000);
    bench.collect();
    bench.turned_to(500);
    let preset = |value: u32| format!("10 2F 01 0A {}", hex(&value.to_le_bytes()));
    assert_eq!(bench.produces_when_asked(&preset(700)), production(700));
    assert_eq!(bench.produces_when_asked(&preset(700)), production(700), "executed once more");
    // Changes count from there.
    assert_eq!(bench.turned_to(1_499), nothing());
    assert_eq!(bench.turned_to(1_500), production(1_700));
    bench.productions.clear();
    bench.asks(&preset(N), "94 09 FF");
    assert_eq!(bench.productions, nothing());
}

#[test]
fn a_real_change_of_settings_is_produced_at_once_and_the_same_again_is_not() {
    let mut bench = producing("amg11-d29", 1);
    bench.turned_to(8_192);
    for (request, position) in [
        ("10 2F 01 07 E8 03 00 00", 1_000), // steps per turn 1000
        ("10 2F 01 08 58 02 00 00", 400),   // total resolution 600
        ("10 2F 01 03 01", 200),            // counterclockwise: −1000 mod 600
    ] {
        assert_eq!(bench.produces_when_asked(request), production(position), "{request}");
        assert_eq!(bench.produces_when_asked(request), nothing(), "{request}, the same again");
    }
    bench.productions.clear();
    bench.asks("10 2F 01 07 00 00 00 00", "94 09 FF");
    bench.asks("10 2F 01 03 02", "94 09 FF");
    assert_eq!(bench.productions, nothing());
    // Through the Parameter object it is the same.
    assert_eq!(bench.produces_when_asked("10 0F 01 01 00"), production(400));
    assert_eq!(bench.produces_when_asked("10 0F 01 01 00"), nothing());
}

#[test]
fn restore_and_reset_are_produced_at_once() {
    for class_and_instance in ["2F 01", "2F 00", "0F 00"] {
        let mut bench = producing("amg11-d29", 1);
        bench.turned_to(8_192);
        bench.write(7, 1_000);
        bench.productions.clear();
        let restored = bench.produces_when_asked(&format!("15 {class_and_instance}"));
        assert_eq!(restored, production(8_192));
        bench.write(7, 1_000);
        let reset = bench.produces_when_asked(&format!("05 {class_and_instance}"));
        assert_eq!(reset, production(8_192));
        assert_eq!(bench.wait(Duration::from_secs(60)), nothing());
        // Also where the settings change and the position does not.
        bench.turned_to(0);
        for service in ["15", "05"] {
            bench.write(7, 1_000);
            let request = format!("{service} {class_and_instance}");
            assert_eq!(bench.produces_when_asked(&request), production(0));
        }
    }
}

#[test]
fn what_changes_nothing_the_position_is_measured_by_is_not_produced() {
    let mut bench = producing("amg11-d29", 1);
    for request in ["05 2F 01", "15 2F 01", "05 0F 00", "10 2F 01 0B 05 00 00 00", "16 2F 01"] {
        assert_eq!(bench.produces_when_asked(request), nothing(), "{request}");
    }
    assert_eq!(bench.wait(Duration::from_secs(60)), nothing());
    // A preset is, every time.
    for _ in 0..2 {
        assert_eq!(bench.produces_when_asked("10 2F 01 0A E8 03 00 00"), production(1_000));
    }
}

#[test]
fn flags_are_produced_with_assembly_2_only() {
    let mut bench = producing("amg81-d29", 2);
    bench.device.sensor_mut().cell_low = true;
    assert_eq!(bench.turned_to(0), ["345#0000000002"]);
    assert_eq!(bench.turned_to(0), nothing());
    bench.device.sensor_mut().cell_low = false;
    assert_eq!(bench.turned_to(0), ["345#0000000000"]);
    let mut bench = producing("amg81-d29", 1);
    bench.device.sensor_mut().cell_low = true;
    assert_eq!(bench.turned_to(0), nothing());
}

#[test]
fn an_alarm_is_produced_when_it_comes_and_when_it_ends_by_itself() {
    let mut bench = producing("amg11-d29", 2);
    bench.asks("10 2F 01 0B 00 00 00 20", "90"); // a delta of the whole range
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().code = 100_000;
    assert_eq!(bench.wait(Duration::from_millis(1)), ["345#A086010001"]);
    bench.device.sensor_mut().turning = false;
    // The shaft was looked at, and the jump seen, when the hand turned it: a millisecond ago.
    assert_eq!(bench.wait(Duration::from_nanos(2_498_999_999)), nothing());
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#A086010000"]);
}

#[test]
fn an_alarm_that_a_poll_finds_is_produced_as_well() {
    let mut bench = producing("amg11-d29", 2);
    bench.asks("10 2F 01 0B 00 00 00 20", "90");
    bench.turned_to(0);
    bench.now += Duration::from_millis(1);
    // Nothing tells the device to look but the poll.
    let mut jumped = bench.device.clone();
    jumped.sensor_mut().code = 100_000;
    bench.device = jumped;
    bench.says("42D#", &["3C5#A0860100", "345#A086010001"]);
}

#[test]
fn a_turning_shaft_is_produced_every_millisecond_and_a_host_that_is_late_gets_the_newest() {
    let mut bench = producing("amg11-d29", 1);
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(5));
    for code in 1..=50 {
        bench.device.sensor_mut().code = code;
        assert_eq!(bench.wait(Duration::from_millis(1)), production(code));
    }
    bench.device.sensor_mut().code = 60;
    bench.device.advance(bench.now);
    // The frame waits for the wire while the shaft turns on; it carries the position of its moment.
    bench.device.sensor_mut().code = 75;
    assert_eq!(bench.collect(), production(75));
    bench.device.sensor_mut().turning = false;
    assert_eq!(bench.turned_to(75), nothing());
}

#[test]
fn the_inhibit_time_gathers_changes_and_presets_into_one_production() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("4B 03 01 50 0A", "CB 00");
    bench.asks("10 05 04 11 64 00", "90 6400");
    assert_eq!(bench.produces_when_asked("10 05 04 09 00 00"), production(0));
    assert_eq!(bench.turned_to(10), nothing());
    assert_eq!(bench.produces_when_asked("10 2F 01 0A E8 03 00 00"), nothing());
    bench.wait(Duration::from_millis(50));
    assert_eq!(bench.turned_to(15), nothing());
    assert_eq!(bench.wait(Duration::from_millis(49)), nothing());
    assert_eq!(bench.wait(Duration::from_millis(1)), production(1_005));
    assert_eq!(bench.wait(Duration::from_secs(10)), nothing());
}

#[test]
fn the_cyclic_beat_carries_the_position_of_its_moment_and_no_change_between() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("4B 03 01 60 0A", "CB 00");
    bench.asks("10 05 04 09 0A 00", "90 0A00");
    bench.productions.clear();
    assert_eq!(bench.turned_to(700), nothing());
    assert_eq!(bench.produces_when_asked("10 2F 01 0A 01 00 00 00"), nothing(), "a preset");
    assert_eq!(bench.wait(Duration::from_millis(9)), nothing());
    assert_eq!(bench.wait(Duration::from_millis(1)), production(1));
    assert_eq!(bench.wait(Duration::from_millis(30)).len(), 3);
}

#[test]
fn the_chosen_assembly_of_the_connection_survives_the_power_without_save() {
    let mut bench = producing("amg11-d29", 2);
    bench.write(7, 1_000);
    let memory = bench.memory.clone();
    let start = codewheel_encoder::choose(
        memory.read(codewheel_encoder::Slot::A),
        memory.read(codewheel_encoder::Slot::B),
    );
    let Start::Kept { kept, .. } = start else { panic!("nothing was kept") };
    assert_eq!(kept.saved.settings.steps_per_turn, 8_192, "no unsaved setting is kept with it");
    let mut bench = bench.power_cycled();
    bench.asks("4B 03 01 10 0A", "CB 00");
    bench.asks("0E 05 04 0E", "8E 20042402");
    bench.asks("0E 05 02 0E", "8E 20042401");
}
