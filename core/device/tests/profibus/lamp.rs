//! The bicolour lamp (PROFIBUS manual §9.5; encoder clause 5).

use codewheel_device::{Colour, Lamp};
use codewheel_station::Duration;

use crate::bench::{Bench, EXAMPLE, FULL_RANGE, STANDARD, octets_of};

fn jump(bench: &mut Bench) {
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().code ^= 1 << 20;
    bench.wait(Duration::from_millis(1));
}

#[test]
fn yellow_until_data_is_exchanged_and_then_green() {
    let mut bench = Bench::power_up("amg11-p29");
    assert_eq!(bench.snapshot().colour, Colour::Yellow);
    bench.parameterizes(FULL_RANGE);
    assert_eq!(bench.lamp(), Lamp::Yellow);
    bench.configures(0xF1);
    assert_eq!(bench.snapshot().colour, Colour::Green);
    bench.wait(Duration::from_secs(3));
    assert_eq!(bench.lamp(), Lamp::Yellow, "the watchdog has expired");
}

#[test]
fn a_parameterization_error_flashes_once_a_second_until_parameters_and_configuration_are_good() {
    let refused = |octets: &str| {
        let mut bench = Bench::power_up("amg11-p29");
        bench.asks(0x3D, &octets_of(octets));
        bench
    };
    let mut no_configuration = Bench::power_up("amg11-p29");
    no_configuration.parameterizes(FULL_RANGE);
    no_configuration.asks(0x3E, &[0x55]);
    for mut bench in [
        refused(&[STANDARD, "0A"].concat()),
        refused("88 01 C8 0B 05 9B 00 80 00"),
        refused("88 01 C8 0B 12 34 00 00 00"),
        no_configuration,
    ] {
        assert_eq!(bench.lamp(), Lamp::RedFlashing);
        bench.parameterizes(FULL_RANGE);
        assert_eq!(bench.lamp(), Lamp::RedFlashing);
        bench.configures(0xF1);
        assert_eq!(bench.lamp(), Lamp::Green);
    }
}

#[test]
fn a_position_error_is_red_for_its_time() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    jump(&mut bench);
    assert_eq!(bench.lamp(), Lamp::Red);
    for _ in 0..2 {
        bench.wait(Duration::from_millis(1_200));
        bench.exchanges("00000000");
        assert_eq!(bench.snapshot().colour, Colour::Red);
    }
    bench.wait(Duration::from_millis(100));
    assert_eq!(bench.lamp(), Lamp::Green);
}

#[test]
fn a_preset_out_of_range_comes_before_a_position_error_and_that_before_a_parameterization_error() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.position("00000000");
    bench.exchanges("FFFFFFFF");
    assert_eq!(bench.lamp(), Lamp::RedFlashingFast);
    jump(&mut bench);
    assert!(bench.device.encoder().alarm());
    assert_eq!(bench.lamp(), Lamp::RedFlashingFast);
    bench.asks(0x3D, &octets_of(&[STANDARD, "0A"].concat()));
    assert_eq!(bench.lamp(), Lamp::RedFlashingFast);
    bench.parameterizes("00");
    assert_eq!(bench.lamp(), Lamp::Red, "class 1 ends the alarm of the preset");
    bench.wait(Duration::from_millis(2_600));
    assert_eq!(bench.lamp(), Lamp::RedFlashing, "the configuration has not come");
}
