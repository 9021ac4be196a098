//! The HEAG 162 converter: the geometry of the word at its SSI line, and line faults (encoder
//! clause 7).

use codewheel_device::profibus::Factory;
use codewheel_device::{Event, Lamp, MemoryState, Product};
use codewheel_encoder::ssi::LineFault;
use codewheel_encoder::{Geometry, Model, Reading};
use codewheel_profibus::{Baud, Timing};
use codewheel_sim::memory::TornMemory;
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::{Bench, FULL_RANGE, Hand, STANDARD, octets_of};

/// A SP 29 whose encoder has 25 bits.
fn with_25_bits() -> Bench {
    let product = Product::find("heag162-p29").expect("in the catalogue");
    let factory = Factory {
        model: Model { geometry: Geometry::MULTITURN_25, ..product.encoder },
        serial: 1,
        baud: Baud::Fixed(BaudRate::Mbit1_5),
        timing: Timing::Exact,
    };
    Bench::power_up_as(product, factory, TornMemory::new(), Hand::default())
}

#[test]
fn with_a_word_of_25_bits_the_diagnosis_shows_the_product_and_the_limits_are_those_of_the_word() {
    let mut bench = with_25_bits();
    let refused = octets_of(&[STANDARD, FULL_RANGE].concat());
    assert_eq!(bench.asks(0x3D, &refused).as_deref(), Some("E5"));
    assert_eq!(bench.status(), "420500FF059B");
    let told = bench.told();
    let text = "parameters refused: Set_Prm octets 14–17: total resolution 536870912 exceeds 8192 × \
                4096 = 33554432";
    assert!(told.contains(&text.to_string()), "{told:?}");
    bench.brings_up("0A 00002000 02000000", 0xF1);
    let diagnosis = bench.diagnosis();
    assert_eq!(diagnosis[9..16], octets_of("01 00002000 FFFF"));
    bench.turn_to((1 << 25) - 1);
    assert_eq!(bench.position("00000000"), (1 << 25) - 1);
}

#[test]
fn turns_beyond_the_word_are_counted_on_where_its_range_is_no_multiple() {
    // 3600 steps, 100 turns, on 4096 turns.
    let mut bench = with_25_bits().running("0A 00000E10 00057E40");
    for code in [1 << 23, 1 << 24, 3 << 23, 8_192] {
        bench.turn_to(code);
    }
    assert_eq!(bench.position("00000000"), 4_097 * 3_600 % 360_000);
}

/// 3600 steps, 5001 turns.
#[test]
fn a_record_that_the_word_cannot_measure_with_counts_as_damaged() {
    let mut bench = Bench::power_up("heag162-p29").running("0A 00000E10 0112B690");
    assert_eq!(bench.writes(), 1);
    let Bench { memory, factory, .. } = bench;
    let product = Product::find("heag162-p29").expect("in the catalogue");
    let model = Model { geometry: Geometry::MULTITURN_25, ..product.encoder };
    let factory = Factory { model, ..factory };
    bench = Bench::power_up_as(product, factory, memory, Hand::default());
    assert_eq!(bench.snapshot().memory, MemoryState::Damaged);
    bench.brings_up("02", 0xF1);
}

#[test]
fn a_line_fault_holds_the_position_and_is_an_alarm_that_ends_after_the_fault() {
    let mut bench = Bench::power_up("heag162-p29").running(FULL_RANGE);
    bench.turn_to(5_000);
    bench.device.sensor_mut().turning = true;
    assert_eq!(bench.exchanges("00000000").0, 0x08);
    bench.device.sensor_mut().reading = Reading::Failed(LineFault::StuckHigh);
    bench.device.sensor_mut().code = 0;
    assert_eq!(bench.exchanges("00000000"), (0x0A, "00001388".into()));
    assert_eq!((bench.diagnosis()[0], bench.lamp()), (0x08, Lamp::Red));
    for _ in 0..4 {
        bench.wait(Duration::from_millis(1_500));
        assert_eq!(bench.exchanges("00000000"), (0x08, "00001388".into()));
        assert_eq!(bench.lamp(), Lamp::Red);
    }
    bench.device.sensor_mut().reading = Reading::Failed(LineFault::StuckLow);
    bench.wait(Duration::from_millis(100));
    bench.device.sensor_mut().reading = Reading::Fresh;
    bench.device.sensor_mut().code = 5_001;
    assert_eq!(bench.exchanges("00000000").1, "00001389");
    assert_eq!(bench.lamp(), Lamp::Red, "for 2.5 s");
    bench.wait(Duration::from_millis(1_300));
    bench.exchanges("00000000");
    bench.wait(Duration::from_millis(1_300));
    assert_eq!((bench.exchanges("00000000").0, bench.lamp()), (0x0A, Lamp::Green));
    let events = bench.events();
    let expected = [
        Event::LineFault(LineFault::StuckHigh),
        Event::LineFault(LineFault::StuckLow),
        Event::LineRight,
        Event::PositionErrorEnded,
    ];
    assert!(events.ends_with(&expected), "each is told once: {events:?}");
}

#[test]
fn without_a_word_since_power_up_there_is_no_position_to_preset() {
    let hand = Hand { reading: Reading::Failed(LineFault::StuckHigh), ..Hand::default() };
    let mut bench =
        Bench::power_up_with("heag162-p29", TornMemory::new(), hand).running(FULL_RANGE);
    assert_eq!(bench.position("00000000"), 0);
    assert_eq!(bench.position("80000009"), 0);
    let told = bench.told();
    assert!(told.iter().any(|text| text.starts_with("preset refused: the SSI line")), "{told:?}");
    assert!(!bench.state().preset_refused, "it was not out of range");
    assert_eq!(bench.writes(), 0);
    bench.device.sensor_mut().reading = Reading::Fresh;
    bench.device.sensor_mut().code = 40;
    bench.position("00000000");
    assert_eq!(bench.position("80000009"), 9);
}

#[test]
fn a_record_written_again_before_the_first_word_keeps_the_reference() {
    // 3600 steps, 100 turns.
    let mut bench = Bench::power_up("heag162-p29").running("0A 00000E10 00057E40");
    bench.position("00000000");
    bench.serves_memory = false;
    bench.position("80000005");
    let kept = bench.device.keep(bench.now).expect("the preset");
    bench.device.sensor_mut().reading = Reading::Failed(LineFault::StuckHigh);
    bench.device.power_cycle(bench.now);
    bench.device.kept(bench.now, Err("worn out"));
    bench.wait(Duration::from_secs(60));
    let again = bench.device.keep(bench.now).expect("the preset again");
    assert_eq!((again.saved, again.bus), (kept.saved, kept.bus));
    assert!(again.reference.is_some());
}

#[test]
fn a_line_that_is_dead_at_power_up_loses_no_reference() {
    // 3600 steps, 100 turns.
    let mut bench = Bench::power_up("heag162-p29").running("0A 00000E10 00057E40");
    for quarter in [1 << 27, 1 << 28, 3 << 27, 8_192] {
        bench.turn_to(quarter);
    }
    let position = bench.position("00000000");
    bench.device.sensor_mut().reading = Reading::Failed(LineFault::StuckHigh);
    let mut bench = bench.power_cycled(8_192);
    // Other settings that need turns, while nothing is known of the shaft.
    bench.brings_up("0A 00000001 00000003", 0xF1);
    bench.device.sensor_mut().reading = Reading::Fresh;
    bench.exchanges("00000000");
    bench.turn_to((1 << 29) - 1);
    bench.turn_to(8_192);
    bench.turn_to((1 << 29) - 1);
    let other = bench.position("00000000");
    assert_eq!(other, 2, "a step before the zero of three");
    let mut bench = bench.power_cycled((1 << 29) - 1).running("0A 00000001 00000003");
    assert_eq!(bench.position("00000000"), other);
    assert_eq!(position, 65_537 * 3_600 % 360_000);
}

#[test]
fn a_preset_during_a_line_fault_is_not_made_of_the_held_position() {
    let mut bench = Bench::power_up("heag162-p29").running(FULL_RANGE);
    bench.turn_to(5_000);
    bench.position("00000000");
    bench.device.sensor_mut().reading = Reading::Failed(LineFault::StuckHigh);
    bench.device.sensor_mut().code = 77_000;
    bench.position("00000000");
    bench.position("80000000");
    assert_eq!(bench.writes(), 0, "a wrong offset went into memory");
}
