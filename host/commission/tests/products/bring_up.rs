//! From power-up to data exchange: every product, rate, class and configuration.

use codewheel_commission::profibus::MasterSettings;
use codewheel_device::product::PROFIBUS;
use codewheel_profibus::{Baud, State};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::segment::{MASTER, Segment, Wanted, encoder, some_cycles};

/// So long the encoders search an idle line: by then they try a rate below 12M.
const HEAD_START: Duration = Duration::from_millis(75);

/// Where the shafts stand: a fraction of a turn that differs from product to product.
fn shaft(place: usize) -> String {
    format!("still angle={}deg", 10 + 17 * place)
}

/// ⌊r·n/S⌋ mod T, by the book.
fn position(code: u32, wanted: Wanted, singleturn_resolution: u32, codes: u64) -> u32 {
    let (steps, total) = if wanted.class_2 {
        (u64::from(wanted.steps_per_turn), u64::from(wanted.total_resolution))
    } else {
        (u64::from(singleturn_resolution), codes)
    };
    let scaled = u64::from(code) * steps / u64::from(singleturn_resolution);
    u32::try_from(scaled % total).expect("below T")
}

/// All thirteen products on one segment that found its rate by itself.
fn bring_up(rate: BaudRate, class_2: bool, configuration: u8) {
    let mut segment = Segment::new();
    let mut all = Vec::new();
    for (place, product) in PROFIBUS.iter().enumerate() {
        let address = 10 + u8::try_from(place).expect("few");
        let now = segment.wire.now();
        segment
            .attach_encoder(address, encoder(now, product, address, &shaft(place), Baud::Search));
        let geometry = product.encoder.geometry;
        all.push(Wanted {
            address,
            class_2,
            configuration,
            steps_per_turn: 3_600.min(geometry.singleturn_resolution()),
            total_resolution: 3_600 * geometry.revolutions().min(256),
        });
    }
    segment.run(HEAD_START);
    for address in segment.addresses() {
        assert_ne!(segment.encoder(address).slave().baud_rate(), BaudRate::Mbit12);
        assert!(!segment.encoder(address).slave().has_baud_rate());
    }
    let mut settings = MasterSettings::new(MASTER, rate);
    settings.highest_station_address = MASTER + 1;
    settings.watchdog = Some(Duration::from_secs(5));
    segment.attach_master(settings, &all);
    let step = some_cycles(rate);
    let good = segment.run_till(Duration::from_secs(60), step, |segment| segment.all_exchange(3));
    let state = segment.addresses().into_iter().map(|of| segment.encoder(of).slave().state());
    assert!(
        good,
        "{rate}, class 2 {class_2}, {configuration:02X}h: {:?}",
        state.collect::<Vec<_>>()
    );
    let what = format!("{rate}, class 2 {class_2}, {configuration:02X}h");
    for (wanted, product) in all.iter().zip(&PROFIBUS) {
        let device = segment.encoder(wanted.address);
        assert_eq!(device.slave().state(), State::DataExchange);
        assert_eq!(device.slave().baud_rate(), rate);
        assert_eq!(device.slave().master(), Some(MASTER));
        let geometry = product.encoder.geometry;
        let code = device.encoder().code();
        let expected =
            position(code, *wanted, geometry.singleturn_resolution(), u64::from(geometry.range()));
        let octets = expected.to_be_bytes();
        let inputs = segment.master().slave(wanted.address).expect("in the list").inputs;
        assert_eq!(inputs, &octets[4 - wanted.octets()..], "{} at {what}", product.title);
    }
    let has_outputs = configuration & 0x20 != 0;
    if has_outputs {
        preset(&mut segment, &all, step, &what);
    }
    segment.expect_peace();
}

/// Preset 42: the clock bit set, and reset again. Class 1 has no preset (manual §7.4).
fn preset(segment: &mut Segment, all: &[Wanted], step: Duration, what: &str) {
    for clock in [true, false] {
        for wanted in all {
            let mut octets = vec![0; wanted.octets()];
            *octets.last_mut().expect("octets") = 42;
            octets[0] = if clock { 0x80 } else { 0x00 };
            segment
                .master_mut()
                .set_outputs(wanted.address, &octets)
                .expect("as many as there are");
        }
        segment.run(step);
    }
    for wanted in all {
        let inputs = segment.master().slave(wanted.address).expect("in the list").inputs;
        let is_42 = inputs.ends_with(&[0, 42]);
        assert_eq!(is_42, wanted.class_2, "{inputs:?} at {what}");
    }
}

macro_rules! at_each_rate {
    ($($name:ident: $rate:ident,)*) => {$(
        #[test]
        fn $name() {
            for class_2 in [false, true] {
                for configuration in [0xD0, 0xD1, 0xF0, 0xF1] {
                    bring_up(BaudRate::$rate, class_2, configuration);
                }
            }
        }
    )*};
}

// One test a rate, so that they run side by side and name the rate.
at_each_rate! {
    all_products_classes_and_configurations_exchange_data_at_9_6k: Kbit9_6,
    all_products_classes_and_configurations_exchange_data_at_19_2k: Kbit19_2,
    all_products_classes_and_configurations_exchange_data_at_45_45k: Kbit45_45,
    all_products_classes_and_configurations_exchange_data_at_93_75k: Kbit93_75,
    all_products_classes_and_configurations_exchange_data_at_187_5k: Kbit187_5,
    all_products_classes_and_configurations_exchange_data_at_500k: Kbit500,
    all_products_classes_and_configurations_exchange_data_at_1_5m: Mbit1_5,
    all_products_classes_and_configurations_exchange_data_at_3m: Mbit3,
    all_products_classes_and_configurations_exchange_data_at_6m: Mbit6,
    all_products_classes_and_configurations_exchange_data_at_12m: Mbit12,
}
