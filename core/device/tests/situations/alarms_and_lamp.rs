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

fn colours(bench: &mut Bench, quarters: usize) -> Vec<Colour> {
    let mut seen = Vec::new();
    for _ in 0..quarters {
        seen.push(bench.device.snapshot(bench.now).colour);
        bench.wait(Duration::from_millis(250));
    }
    seen
}

#[test]
fn the_self_test_is_green_then_red_at_each_power_on() {
    use Colour::{Dark, Green, Red};
    let mut bench = Bench::power_up("amg11-d29");
    bench.collect();
    assert_eq!(colours(&mut bench, 8), [Green, Red, Dark, Dark, Dark, Dark, Dark, Dark]);
    assert_eq!(colours(&mut bench, 4), [Green, Green, Dark, Dark], "on-line, no connection");
    bench.device.power_cycle(bench.now);
    bench.collect();
    assert_eq!(colours(&mut bench, 3), [Green, Red, Dark]);
}

#[test]
fn a_change_of_state_connection_that_timed_out_flashes_red_until_it_is_none() {
    use Colour::{Dark, Green, Red};
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("4B 03 01 10 0A", "CB 00");
    assert_eq!(lamp(&bench), Lamp::Green);
    bench.asks("10 05 04 09 64 00", "90 6400");
    // The first interval: ten seconds, although the poll connection is well.
    bench.wait(Duration::from_nanos(9_999_999_999));
    assert_eq!(lamp(&bench), Lamp::Green);
    bench.wait(Duration::from_nanos(1));
    assert_eq!(lamp(&bench), Lamp::RedFlashing);
    let since_power_up = bench.now.as_nanos() % 500_000_000;
    bench.wait(Duration::from_nanos(1_000_000_000 - since_power_up));
    let seen = colours(&mut bench, 8);
    assert_eq!(seen.iter().filter(|colour| **colour == Red).count(), 4, "half the time: {seen:?}");
    assert_eq!(seen.iter().filter(|colour| **colour == Dark).count(), 4);
    assert_eq!(seen[0], seen[1]);
    // Revived by a Reset, and acknowledged from then on.
    bench.asks("05 05 04", "85");
    bench.says("42A#", &[]);
    assert_eq!((lamp(&bench), colours(&mut bench, 1)), (Lamp::Green, vec![Green]));
    bench.wait(Duration::from_millis(400));
    assert_eq!(lamp(&bench), Lamp::RedFlashing);
    bench.asks("4C 03 01 10", "CC");
    assert_eq!(lamp(&bench), Lamp::Green);
}

#[test]
fn an_unacknowledged_connection_leaves_the_lamp_green_for_ever() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("4B 03 01 50 0A", "CB 00");
    bench.asks("10 05 04 09 E8 03", "90 E803");
    bench.wait(Duration::from_secs(1_000));
    assert_eq!(lamp(&bench), Lamp::Green);
}

#[test]
fn a_bus_off_is_red_and_with_interrupt_1_dark_until_the_check_is_passed() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.device.handle(bench.now, Input::BusOff);
    bench.device.handle(bench.now, Input::Recovered);
    assert_eq!(lamp(&bench), Lamp::Red);
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("10 03 01 03 01", "90");
    bench.device.handle(bench.now, Input::BusOff);
    assert_eq!(lamp(&bench), Lamp::Red);
    bench.device.handle(bench.now, Input::Recovered);
    assert_eq!(lamp(&bench), Lamp::Off);
    bench.collect();
    bench.wait(Duration::from_secs(2));
    assert_eq!(lamp(&bench), Lamp::GreenFlashing);
}
