//! A life with power cuts: settings, presets, saves, turns with and without power, against an
//! oracle that sees the true angle of the shaft.

mod common;

use codewheel_encoder::{Block, Encoder, Geometry, Model, Reference, Settings};
use common::{
    MULTITURN, Oracle, any_model, at_millis, cases, code, count_to, encoder_with, settings_of,
};
use proptest::prelude::*;

/// An encoder with the memory and the floor above it that a device has.
struct Device {
    model: Model,
    encoder: Encoder,
    saved: Block,
    reference: Option<Reference>,
    reference_writes: u32,
    millis: u64,
}

impl Device {
    fn new(model: Model, settings: Settings) -> Self {
        let encoder = encoder_with(model, settings);
        let saved = encoder.block();
        Self { model, encoder, saved, reference: None, reference_writes: 0, millis: 0 }
    }

    fn sample(&mut self, raw: u32) {
        self.millis += 10;
        self.encoder.sample(at_millis(self.millis), code(raw));
        let stale = |kept| self.encoder.reference_is_stale(&kept);
        if self.saved.needs_reference(self.model) && self.reference.is_none_or(stale) {
            self.reference = self.encoder.reference();
            self.reference_writes += 1;
        }
    }

    fn save(&mut self) {
        self.saved = self.encoder.block();
        self.reference =
            self.encoder.reference().filter(|_| self.saved.needs_reference(self.model));
    }

    fn power_cut(&mut self) {
        self.encoder = Encoder::power_up(self.model, self.saved, self.reference).unwrap();
    }
}

#[derive(Clone, Copy, Debug)]
enum Happening {
    Turn(i128),
    Change(Settings),
    Preset(u32),
    Save,
    Restore,
    PowerCut(i128),
}

fn happening(model: Model) -> impl Strategy<Value = Happening> {
    let range = i128::from(model.geometry.range());
    let turn = |limit: i128| {
        let near = limit.min(20_000);
        prop_oneof![-limit + 1..limit, -near + 1..near, -1..=1i128, Just(limit - 1)]
    };
    prop_oneof![
        6 => turn(range / 2).prop_map(Happening::Turn),
        1 => settings_of(model).prop_map(Happening::Change),
        1 => count_to(model.geometry.range()).prop_map(Happening::Preset),
        1 => Just(Happening::Save),
        1 => Just(Happening::Restore),
        3 => turn(range / 4).prop_map(Happening::PowerCut),
    ]
}

/// A singleturn disc keeps no turns: after a power cut the shaft counts as being in the turn the
/// settings, or a preset where turns matter, were made in.
fn forget_turns(oracle: &mut Oracle) {
    if !oracle.model.geometry.is_multiturn() {
        oracle.angle = oracle.zero + i128::from(oracle.code());
    }
}

proptest! {
    #![proptest_config(cases(1_000))]

    #[test]
    fn through_a_life_of_settings_and_power_cuts_the_position_follows_the_true_angle(
        (model, settings, happenings) in any_model().prop_flat_map(|model| {
            let life = prop::collection::vec(happening(model), 1..80);
            (Just(model), settings_of(model), life)
        }),
    ) {
        let mut device = Device::new(model, settings);
        let mut oracle = Oracle::new(model, settings, 12_345);
        let mut saved = oracle.clone();
        device.sample(oracle.code());
        device.save();
        for happening in happenings {
            match happening {
                Happening::Turn(way) => {
                    oracle.angle += way;
                    device.sample(oracle.code());
                }
                Happening::Change(settings) => {
                    device.encoder.apply(settings).unwrap();
                    oracle.set_settings(settings);
                }
                Happening::Preset(any) => {
                    let preset = any % oracle.total() as u32;
                    device.encoder.set_preset(preset).unwrap();
                    if !model.geometry.is_multiturn() && !oracle.code_suffices() {
                        oracle.zero = oracle.raw_zero();
                    }
                    oracle.set_preset(preset);
                }
                Happening::Save => {
                    device.save();
                    saved = oracle.clone();
                }
                Happening::Restore => {
                    device.encoder.load(device.saved).unwrap();
                    oracle = Oracle { angle: oracle.angle, ..saved.clone() };
                }
                Happening::PowerCut(way) => {
                    device.power_cut();
                    oracle = Oracle { angle: oracle.angle + way, ..saved.clone() };
                    forget_turns(&mut oracle);
                    device.sample(oracle.code());
                    saved.angle = oracle.angle;
                }
            }
            prop_assert_eq!(device.encoder.position(), oracle.position(), "{:?}", happening);
            prop_assert_eq!(device.encoder.preset(), oracle.preset);
        }
    }

    #[test]
    fn a_reference_is_written_at_most_once_per_quarter_of_the_range(
        settings in settings_of(MULTITURN),
        ways in prop::collection::vec(-4_000..8_000i128, 200),
    ) {
        let mut device = Device::new(MULTITURN, settings);
        let mut oracle = Oracle::new(MULTITURN, settings, 0);
        device.sample(0);
        let (first, mut turned) = (device.reference_writes, 0);
        for turns in ways {
            oracle.angle += turns * 8_192;
            turned += turns.abs();
            device.sample(oracle.code());
        }
        let writes = i128::from(device.reference_writes - first);
        prop_assert!(writes <= turned / 16_384, "{} writes in {} turns", writes, turned);
        if device.saved.needs_reference(MULTITURN) {
            prop_assert_eq!(first, 1);
        } else {
            prop_assert_eq!(device.reference_writes, 0);
        }
    }
}

fn uneven() -> Settings {
    Settings {
        steps_per_turn: 3_600,
        total_resolution: 360_000,
        ..Settings::default_for(MULTITURN)
    }
}

/// DeviceNet manual §8: "parameterizing will have to be done anew as soon as the encoder's zero
/// point has been exceeded in powerless state". The reference spares it within N/4.
#[test]
fn the_raw_zero_passed_in_the_dark_within_a_quarter_of_the_range_is_found() {
    let quarter = i128::from(Geometry::MULTITURN_29.range() / 4);
    for way in [1 - quarter, -8_192, 8_192, quarter - 1] {
        for start in [0, 5, -5] {
            let mut device = Device::new(MULTITURN, uneven());
            let mut oracle = Oracle::new(MULTITURN, uneven(), start);
            device.sample(oracle.code());
            device.encoder.set_preset(1_000).unwrap();
            oracle.set_preset(1_000);
            device.save();
            device.power_cut();
            oracle.angle += way;
            device.sample(oracle.code());
            assert_eq!(device.encoder.position(), oracle.position(), "{way} from {start}");
        }
    }
}

/// Decision: exactly half the range is no crossing, neither way.
#[test]
fn exactly_half_the_range_is_no_crossing_and_one_step_more_is_one() {
    let half = Geometry::MULTITURN_29.range() / 2;
    for (from, to, crossings) in [
        (0, half, 0),
        (half, 0, 0),
        (0, half + 1, -1),
        (half + 1, 0, 1),
        (2 * half - 1, half - 1, 0),
        (2 * half - 1, half - 2, 1),
    ] {
        let mut encoder = encoder_with(MULTITURN, uneven());
        encoder.sample(at_millis(0), code(from));
        encoder.sample(at_millis(10), code(to));
        let expected = Some(Reference { crossings, code: to });
        assert_eq!(encoder.reference(), expected, "{from} to {to}");
    }
}

#[test]
fn a_reference_is_stale_beyond_a_quarter_of_the_range_and_not_at_it() {
    let quarter = Geometry::MULTITURN_29.range() / 4;
    let mut encoder = encoder_with(MULTITURN, uneven());
    encoder.sample(at_millis(0), code(0));
    for kept in [-1, 1].map(|way| way * i64::from(quarter)) {
        let reference = |angle: i64| Reference {
            crossings: angle.div_euclid(4 * i64::from(quarter)),
            code: angle.rem_euclid(4 * i64::from(quarter)) as u32,
        };
        assert!(!encoder.reference_is_stale(&reference(kept)));
        assert!(encoder.reference_is_stale(&reference(kept + kept.signum())));
    }
}

#[test]
fn without_a_reference_the_same_passage_costs_the_position_as_the_manual_warns() {
    let mut device = Device::new(MULTITURN, uneven());
    let mut oracle = Oracle::new(MULTITURN, uneven(), 5);
    device.sample(oracle.code());
    device.save();
    device.reference = None;
    device.power_cut();
    oracle.angle -= 10;
    device.sample(oracle.code());
    assert_ne!(device.encoder.position(), oracle.position());
}

#[test]
fn the_first_sample_infers_no_crossing_no_alarm_and_no_velocity() {
    let mut encoder = encoder_with(MULTITURN, uneven());
    encoder.sample(at_millis(0), code(Geometry::MULTITURN_29.range() - 1));
    assert_eq!(encoder.unwrapped(), 3_600 * 65_536 - 1);
    assert!(!encoder.alarm());
    assert_eq!(encoder.velocity(at_millis(0)), 0);
    assert_eq!(encoder.reference().map(|reference| reference.crossings), Some(0));
}

#[test]
fn settings_changed_before_the_first_sample_start_in_the_range_it_finds() {
    let range = Geometry::MULTITURN_29.range();
    let reference = Reference { crossings: 7, code: range - 10 };
    let block = Block { crossings_at_change: 7, ..Block::default_for(MULTITURN) };
    let mut encoder = Encoder::power_up(MULTITURN, block, Some(reference)).unwrap();
    encoder.apply(uneven()).unwrap();
    encoder.sample(at_millis(0), code(8_192));
    assert_eq!(encoder.reference(), Some(Reference { crossings: 8, code: 8_192 }));
    assert_eq!(encoder.block().crossings_at_change, 8);
    assert_eq!((encoder.unwrapped(), encoder.position()), (3_600, 3_600));
}

#[test]
fn the_crossings_belong_to_the_shaft_and_outlive_every_setting() {
    let mut encoder = encoder_with(MULTITURN, uneven());
    for milli in 0..9 {
        // A third of the range each: three rounds.
        let raw = u64::from(Geometry::MULTITURN_29.range()) * milli / 3;
        encoder.sample(
            at_millis(10 * milli),
            code((raw % u64::from(Geometry::MULTITURN_29.range())) as u32),
        );
        encoder.set_total_resolution(1_000 + milli as u32).unwrap();
    }
    assert_eq!(encoder.reference().map(|reference| reference.crossings), Some(2));
    assert_eq!(encoder.block().crossings_at_change, 2);
    encoder.load(encoder.default_block()).unwrap();
    assert_eq!(encoder.reference().map(|reference| reference.crossings), Some(2));
}

#[test]
fn a_singleturn_disc_keeps_no_reference_and_its_preset_survives_all_the_same() {
    let model = Model { geometry: Geometry::SINGLETURN_13, ..MULTITURN };
    let settings =
        Settings { steps_per_turn: 100, total_resolution: 30, ..Settings::default_for(model) };
    let mut device = Device::new(model, settings);
    for turn_third in 0..7 {
        device.sample(8_192 * turn_third / 3 % 8_192);
    }
    device.encoder.set_preset(11).unwrap();
    device.save();
    assert_eq!(device.encoder.reference(), None);
    device.power_cut();
    device.sample(0);
    assert_eq!(device.encoder.position(), 11);
}

#[test]
fn any_reference_a_record_may_hold_leaves_the_position_in_range() {
    for crossings in [i64::MIN, i64::MIN + 1, -1, i64::MAX - 1, i64::MAX] {
        for at_change in [i64::MIN, 0, i64::MAX] {
            let block = Block {
                crossings_at_change: at_change,
                settings: uneven(),
                ..Block::default_for(MULTITURN)
            };
            for kept in [0, 1 << 29, 1 << 31, u32::MAX] {
                let reference = Reference { crossings, code: kept };
                let mut encoder = Encoder::power_up(MULTITURN, block, Some(reference)).unwrap();
                for (step, raw) in (0..).zip([0, u32::MAX, 5, 1 << 28]) {
                    encoder.sample(at_millis(10 * step), code(raw));
                    assert!(encoder.position() < 360_000);
                    let _ = encoder.reference_is_stale(&reference);
                    let _ = encoder.velocity(at_millis(10 * step));
                }
            }
        }
    }
}
