//! The alarm: position errors and presets out of range (PROFIBUS manual §7.1; encoder clause 3).

use codewheel_device::profibus::{Factory, Switches};
use codewheel_device::{Event, Product, ProfibusEncoder};
use codewheel_encoder::Start;
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::shaft::Shaft;
use codewheel_station::rs485::BaudRate;
use codewheel_station::{Duration, Instant, Station};

use crate::bench::{Bench, EXAMPLE, FULL_RANGE};

const QUIET: (u8, &str) = (0x08, "0000");
const PENDING: (u8, &str) = (0x0A, "0000");

/// The response function of a Data_Exchange, and what octets 1 and 8 of the diagnosis say.
fn seen(bench: &mut Bench) -> (u8, String) {
    let (response, _) = bench.exchanges("00000000");
    let diagnosis = bench.diagnosis();
    (response, format!("{:02X}{:02X}", diagnosis[0], diagnosis[7]))
}

#[test]
fn a_jump_of_the_code_is_an_alarm_for_two_and_a_half_seconds() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    assert_eq!(seen(&mut bench), (QUIET.0, QUIET.1.into()));
    bench.device.sensor_mut().code = 100_000;
    assert_eq!(bench.exchanges("00000000"), (0x0A, "000186A0".into()), "the newest sample counts");
    assert_eq!(bench.exchanges("00000000").0, 0x0A, "until it has been read");
    assert_eq!(bench.diagnosis()[..8], [0x08, 0x0C, 0, 2, 0x05, 0x9B, 0x33, 1]);
    assert_eq!(bench.exchanges("00000000").0, 0x08);
    bench.wait(Duration::from_millis(1_000));
    assert_eq!(seen(&mut bench), (0x08, "0801".into()), "it stands and was read");
    bench.wait(Duration::from_millis(1_490));
    assert_eq!(seen(&mut bench), (0x08, "0801".into()));
    bench.wait(Duration::from_millis(10));
    assert_eq!(seen(&mut bench), (0x0A, "0000".into()), "its end is to be read");
    assert_eq!(bench.exchanges("00000000").0, 0x08);
    let events = bench.events();
    assert!(events.contains(&Event::PositionError) && events.contains(&Event::PositionErrorEnded));
}

#[test]
fn another_jump_begins_the_two_and_a_half_seconds_anew() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    for code in [100_000, 200_000] {
        bench.device.sensor_mut().code = code;
        for _ in 0..2 {
            bench.wait(Duration::from_millis(1_000));
            bench.exchanges("00000000");
        }
        assert!(bench.snapshot().alarm);
    }
    bench.wait(Duration::from_millis(510));
    assert!(!bench.snapshot().alarm);
}

#[test]
fn alarms_are_told_in_class_1_too() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.brings_up("00", 0xD1);
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().code = 100_000;
    assert_eq!(bench.exchanges("").0, 0x0A);
    let diagnosis = bench.diagnosis();
    assert_eq!((diagnosis.len(), diagnosis[0], diagnosis[7]), (16, 0x08, 1));
}

#[test]
fn a_preset_out_of_range_is_an_alarm_until_one_in_range_comes() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.turn_to(8_192);
    bench.position("00000000");
    assert_eq!(
        bench.exchanges("800E1000"),
        (PENDING.0, "00000E10".into()),
        "921600 is not executed"
    );
    assert_eq!(bench.diagnosis()[..8], [0x08, 0x0C, 0, 2, 0x05, 0x9B, 0x33, 1]);
    assert!(bench.state().preset_refused && bench.snapshot().alarm);
    bench.wait(Duration::from_millis(1_500));
    assert_eq!(seen(&mut bench), (0x08, "0801".into()), "no time ends it");
    bench.wait(Duration::from_millis(1_500));
    assert_eq!(seen(&mut bench), (0x08, "0801".into()));
    let told = bench.told();
    assert!(told.contains(&"preset refused: 921600 is not 0 to 921599".into()), "{told:?}");
    assert_eq!(bench.exchanges("800E0FFF"), (PENDING.0, "000E0FFF".into()));
    assert_eq!(bench.diagnosis()[0], 0x00);
    assert_eq!(seen(&mut bench), (0x08, "0000".into()));
    assert!(!bench.state().preset_refused);
}

#[test]
fn identical_parameters_do_not_end_the_alarm_of_a_preset_and_class_1_does() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.position("00000000");
    bench.position("FFFFFFFF");
    bench.brings_up(EXAMPLE, 0xF1);
    assert!(bench.state().preset_refused);
    assert_eq!(seen(&mut bench), (0x08, "0801".into()), "it was read during the bring-up");
    bench.brings_up("00", 0xF1);
    assert!(!bench.state().preset_refused);
    assert_eq!(bench.diagnosis()[7], 0);
    bench.brings_up(EXAMPLE, 0xF1);
    assert_eq!(bench.diagnosis()[7], 0);
}

#[test]
fn an_alarm_before_the_exchange_is_to_be_read_in_it() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.parameterizes(FULL_RANGE);
    bench.device.sensor_mut().code = 100_000;
    bench.wait(Duration::from_millis(2));
    bench.configures(0xF1);
    assert_eq!(bench.exchanges("00000000").0, 0x0A);
    bench.diagnosis();
    assert_eq!(bench.exchanges("00000000").0, 0x08);
}

#[test]
fn a_power_cycle_ends_every_alarm() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.position("00000000");
    bench.position("FFFFFFFF");
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().code = 1 << 20;
    bench.wait(Duration::from_millis(1));
    assert!(bench.device.encoder().alarm());
    bench.events();
    bench.device.power_cycle(bench.now);
    assert_eq!(bench.events(), [Event::PowerUp]);
    assert!(!bench.snapshot().alarm && !bench.state().preset_refused);
    bench.brings_up(EXAMPLE, 0xF1);
    assert_eq!(seen(&mut bench), (0x08, "0000".into()));
}

#[test]
fn a_jump_that_only_the_diagnosis_has_seen_is_an_alarm() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().code = 1_000_000;
    let diagnosis = bench.diagnosis();
    assert_eq!((diagnosis[0], diagnosis[7]), (0x08, 1));
}

/// The shaft turns at 120 rpm; the alarm is raised between two looks a millisecond apart.
#[test]
fn the_speed_limit_can_be_set_and_outlasts_the_power() {
    let product = Product::find("amg11-p29").expect("in the catalogue");
    let factory = Factory {
        model: product.encoder,
        serial: 1,
        baud: Baud::Fixed(BaudRate::Mbit1_5),
        timing: Timing::Exact,
    };
    let shaft = Shaft::parse("turn rpm=120", 8_192, 65_536).expect("a shaft");
    let start = Start::Fresh { interrupted: false };
    let switches = Switches::set_to(7);
    let mut now = Instant::ZERO;
    let mut device = ProfibusEncoder::power_up(now, product, factory, switches, &start, shaft);
    let alarm_after_a_while = |device: &mut ProfibusEncoder<Shaft>, now: &mut Instant| {
        for _ in 0..20 {
            *now += Duration::from_millis(1);
            device.advance(*now);
        }
        device.snapshot(*now).alarm
    };
    assert!(!alarm_after_a_while(&mut device, &mut now), "12 000 rpm are far away");
    device.set_speed_limit(60);
    assert!(alarm_after_a_while(&mut device, &mut now));
    device.power_cycle(now);
    assert!(alarm_after_a_while(&mut device, &mut now));
}
