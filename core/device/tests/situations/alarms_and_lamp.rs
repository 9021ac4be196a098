//! Position error, lithium cell and lamp (AMG manual §8 and §9.2).

use codewheel_device::{Colour, DeviceNetEncoder, Event, Factory, Lamp, Product, Switches};
use codewheel_encoder::Start;
use codewheel_station::can::{BitRate, Frame, Input};
use codewheel_station::{Duration, Instant, Station};

use crate::bench::{Bench, Hand};

fn lamp(bench: &Bench) -> Lamp {
    bench.device.snapshot(bench.now).lamp
}

#[test]
fn a_jump_of_the_code_is_a_position_error_for_two_and_a_half_seconds() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().code = 100_000;
    bench.wait(Duration::from_millis(1));
    assert_eq!((bench.read(83), bench.read(85)), (1, 1));
    assert_eq!(bench.read(12), 100_000, "the position follows the newest sample");
    bench.wait(Duration::from_millis(2_498));
    assert_eq!(bench.read(85), 1);
    bench.wait(Duration::from_millis(2));
    assert_eq!((bench.read(83), bench.read(85)), (0, 0));
    let events = bench.events();
    assert!(events.contains(&Event::PositionError));
    assert!(events.contains(&Event::PositionErrorEnded));
}

#[test]
fn assembly_2_carries_alarm_in_bit_0_and_warning_in_bit_1() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    bench.asks("4C 03 01 02", "CC");
    bench.asks("4B 03 01 02 0A", "CB 00");
    bench.asks("10 05 02 0E 20 04 24 02", "90");
    bench.asks("10 05 02 09 00 00", "90 0000");
    bench.says("42D#", &["3C5#0000000000"]);
    bench.device.sensor_mut().cell_low = true;
    bench.says("42D#", &["3C5#0000000002"]);
    assert_eq!((bench.read(86), bench.read(87), bench.read(88)), (0x10, 0x10, 1));
    bench.device.sensor_mut().turning = true;
    bench.wait(Duration::from_millis(2));
    bench.device.sensor_mut().code = 1 << 20;
    bench.says("42D#", &["3C5#0000100003"]);
    bench.device.sensor_mut().cell_low = false;
    bench.says("42D#", &["3C5#0000100001"]);
}

#[test]
fn a_product_without_a_cell_knows_no_warning() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.device.sensor_mut().cell_low = true;
    assert_eq!((bench.read(86), bench.read(87), bench.read(88)), (0, 0, 0));
}

#[test]
fn the_lamp_follows_the_connection() {
    let mut bench = Bench::power_up("amg11-d29");
    assert_eq!(lamp(&bench), Lamp::SelfTest);
    bench.collect();
    bench.wait(Duration::from_millis(500));
    assert_eq!(lamp(&bench), Lamp::Off);
    bench.wait(Duration::from_millis(1_500));
    assert_eq!(lamp(&bench), Lamp::GreenFlashing);
    bench.says("42E#0A4B0301030A", &["42B#0ACB00"]);
    assert_eq!(lamp(&bench), Lamp::Green);
    bench.asks("10 05 02 09 64 00", "90 6400");
    bench.asks("10 05 01 09 00 00", "90 0000");
    bench.says("42D#", &["3C5#00000000"]);
    bench.wait(Duration::from_millis(400));
    assert_eq!(lamp(&bench), Lamp::RedFlashing);
    bench.says("42F#80341200000000", &[]);
    assert_eq!(lamp(&bench), Lamp::Red);
    assert_eq!(bench.device.snapshot(bench.now).colour, Colour::Red);
}

#[test]
fn with_switches_above_63_the_device_stays_off_the_bus_and_says_why() {
    for address in [64, 99] {
        let mut device = DeviceNetEncoder::power_up(
            Instant::ZERO,
            Product::find("amg11-d29").expect("in the catalogue"),
            Factory::with_serial(1),
            Switches::set_to(address, BitRate::Kbit125),
            &Start::Fresh { interrupted: false },
            Hand::default(),
        );
        let late = Instant::ZERO + Duration::from_secs(60);
        device.advance(late);
        device.handle(late, Input::Frame(&Frame::standard(0x5FF, &[0, 1, 0, 1, 0, 0, 0])));
        assert_eq!(device.transmit(late), None);
        assert_eq!(device.snapshot(late).lamp, Lamp::Red);
        assert_eq!(device.mac(), None);
        let events: Vec<_> = std::iter::from_fn(|| device.take_event()).collect();
        assert!(
            events.iter().any(|(_, event)| *event == Event::IllegalAddress { switches: address })
        );
    }
}

#[test]
fn switches_turned_while_running_act_at_the_next_power_up() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.device.set_switches(Switches::set_to(23, BitRate::Kbit250));
    for (attribute, value) in
        [("01", "05"), ("02", "02"), ("06", "01"), ("07", "01"), ("08", "17"), ("09", "01")]
    {
        bench.asks(&format!("0E 03 01 {attribute}"), &format!("8E {value}"));
    }
    bench.device.power_cycle(bench.now);
    assert_eq!(bench.device.mac().map(|mac| mac.value()), Some(23));
    assert_eq!(bench.collect(), ["4BF#00D401D2040000"]);
}
