//! What the tests of this folder share: the 23 products, settings to try, and an oracle.
#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part")]

use codewheel_encoder::{
    Block, Direction, Encoder, Geometry, Kept, Model, Reference, Sample, Settings,
};
use codewheel_station::{Duration, Instant};
use proptest::prelude::*;

/// All 23 products by their command line names.
pub fn products() -> Vec<(String, Model)> {
    let model = |geometry, cell, follows| Model {
        geometry,
        lithium_cell: cell,
        total_follows_steps: follows,
    };
    let mut products = Vec::new();
    for family in ["amg11", "amg81", "pmg10", "hmg11", "hmg10"] {
        let cell = family == "amg81";
        for (bus, follows) in [("d", true), ("p", false)] {
            products.push((
                format!("{family}-{bus}13"),
                model(Geometry::SINGLETURN_13, false, follows),
            ));
            products
                .push((format!("{family}-{bus}29"), model(Geometry::MULTITURN_29, cell, false)));
        }
    }
    for (name, geometry) in [
        ("heag162-p13", Geometry::SINGLETURN_13),
        ("heag162-p18", Geometry::SINGLETURN_18),
        ("heag162-p29", Geometry::MULTITURN_29),
    ] {
        products.push((name.to_owned(), model(geometry, false, false)));
    }
    products
}

pub const MULTITURN: Model =
    Model { geometry: Geometry::MULTITURN_29, lithium_cell: false, total_follows_steps: false };

/// A converter with a 25-bit SSI word: no product of its own, but a geometry of its own.
pub const WORD_OF_25_BITS: Model = Model { geometry: Geometry::MULTITURN_25, ..MULTITURN };

/// Any of the 23 products, or the 29-bit converter with a 25-bit word.
pub fn any_model() -> impl Strategy<Value = Model> {
    let mut models: Vec<Model> = products().into_iter().map(|(_, model)| model).collect();
    models.push(WORD_OF_25_BITS);
    prop::sample::select(models)
}

/// Numbers 1 … max, often at the edges, powers of two and their neighbours.
pub fn count_to(max: u32) -> impl Strategy<Value = u32> {
    prop_oneof![
        3 => 1..=max,
        1 => Just(max),
        1 => 1..=max.min(20),
        1 => (0..32 - max.leading_zeros(), 0..3u32)
            .prop_map(move |(bit, near)| ((1 << bit) + near).saturating_sub(1).clamp(1, max)),
    ]
}

/// Legal settings of a product.
pub fn settings_of(model: Model) -> impl Strategy<Value = Settings> {
    let direction = prop_oneof![Just(Direction::Cw), Just(Direction::Ccw)];
    let steps = prop_oneof![
        3 => count_to(model.geometry.singleturn_resolution()),
        1 => Just(3_600),
    ];
    (direction, steps, prop::bool::weighted(0.9)).prop_flat_map(
        move |(direction, steps_per_turn, scaling)| {
            let revolutions = model.geometry.revolutions();
            let total = if model.total_follows_steps {
                Just(steps_per_turn).boxed()
            } else {
                prop_oneof![
                    count_to(steps_per_turn * revolutions),
                    count_to(revolutions).prop_map(move |turns| turns * steps_per_turn),
                ]
                .boxed()
            };
            total.prop_map(move |total_resolution| Settings {
                direction,
                steps_per_turn,
                total_resolution,
                scaling,
            })
        },
    )
}

/// Raw codes of a product: anywhere, and ±2S around 0, N/4, N/2 and N−1.
pub fn code_of(model: Model) -> impl Strategy<Value = u32> {
    let range = model.geometry.range();
    let two_turns = 2 * i64::from(model.geometry.singleturn_resolution());
    prop_oneof![
        0..range,
        (prop::sample::select(vec![0, range / 4, range / 2, range - 1]), -two_turns..=two_turns)
            .prop_map(
                move |(spot, near)| (i64::from(spot) + near).rem_euclid(i64::from(range)) as u32
            ),
    ]
}

pub fn model_and_settings() -> impl Strategy<Value = (Model, Settings)> {
    any_model().prop_flat_map(|model| (Just(model), settings_of(model)))
}

pub fn at_millis(millis: u64) -> Instant {
    Instant::ZERO + Duration::from_millis(millis)
}

pub fn code(code: u32) -> Sample {
    Sample { code, ..Sample::default() }
}

/// An encoder with `settings` in force and nothing known of the shaft.
pub fn encoder_with(model: Model, settings: Settings) -> Encoder {
    let block = Block { settings, ..Block::default_for(model) };
    Encoder::power_up(model, block, None).expect("the settings are legal")
}

/// An encoder at the end of a shaft whose true angle is known in raw steps, turns and all.
///
/// It is written from the manuals' words with 128-bit integers, shares no line with the encoder,
/// and never sees a wrapped code.
#[derive(Clone, Debug)]
pub struct Oracle {
    pub model: Model,
    /// The true angle since the device was made, clockwise positive.
    pub angle: i128,
    pub settings: Settings,
    /// The angle of the raw zero below the shaft at the last real change of the settings.
    pub zero: i128,
    pub preset: u32,
    pub offset: i128,
}

impl Oracle {
    pub fn new(model: Model, settings: Settings, angle: i128) -> Self {
        let mut oracle = Self { model, angle, settings, zero: 0, preset: 0, offset: 0 };
        oracle.zero = oracle.raw_zero();
        oracle
    }

    pub fn range(&self) -> i128 {
        i128::from(self.model.geometry.range())
    }

    /// What the disc shows.
    pub fn code(&self) -> u32 {
        self.angle.rem_euclid(self.range()) as u32
    }

    /// The angle of the raw zero below the shaft.
    pub fn raw_zero(&self) -> i128 {
        self.angle.div_euclid(self.range()) * self.range()
    }

    pub fn total(&self) -> i128 {
        if self.settings.scaling {
            i128::from(self.settings.total_resolution)
        } else {
            self.range()
        }
    }

    /// Scaled steps from the zero the settings were made at, the way the position grows.
    pub fn unwrapped(&self) -> i128 {
        let disc = i128::from(self.model.geometry.singleturn_resolution());
        let steps =
            if self.settings.scaling { i128::from(self.settings.steps_per_turn) } else { disc };
        let turned = match self.settings.direction {
            Direction::Cw => self.angle - self.zero,
            Direction::Ccw => self.zero - self.angle,
        };
        (turned * steps).div_euclid(disc)
    }

    pub fn position(&self) -> u32 {
        (self.unwrapped() + self.offset).rem_euclid(self.total()) as u32
    }

    pub fn set_settings(&mut self, settings: Settings) {
        if settings != self.settings {
            *self = Self::new(self.model, settings, self.angle);
        }
    }

    pub fn set_preset(&mut self, preset: u32) {
        self.preset = preset;
        self.offset = i128::from(preset) - self.unwrapped().rem_euclid(self.total());
    }

    /// Whether every angle with the same code has the same position.
    pub fn code_suffices(&self) -> bool {
        let disc = i128::from(self.model.geometry.singleturn_resolution());
        let steps =
            if self.settings.scaling { i128::from(self.settings.steps_per_turn) } else { disc };
        self.range() / disc * steps % self.total() == 0
    }
}

/// A proptest configuration of so many cases; a seed that failed is printed, and kept beside the
/// tests.
pub fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: Some(Box::new(prop::test_runner::FileFailurePersistence::WithSource(
            "regressions",
        ))),
        // Shrinking nested strategies may take minutes without bounds.
        max_shrink_iters: 2_000,
        max_flat_map_regens: 10_000,
        ..ProptestConfig::default()
    }
}

/// Anything a record can hold, sensible or not.
pub fn kept() -> impl Strategy<Value = Kept> {
    let settings = (any::<bool>(), any::<u32>(), any::<u32>(), any::<bool>()).prop_map(
        |(ccw, steps_per_turn, total_resolution, scaling)| Settings {
            direction: if ccw { Direction::Ccw } else { Direction::Cw },
            steps_per_turn,
            total_resolution,
            scaling,
        },
    );
    let saved = (settings, any::<u32>(), any::<i32>(), any::<i64>(), any::<u32>()).prop_map(
        |(settings, preset, offset, crossings_at_change, cos_delta)| Block {
            settings,
            preset,
            offset,
            crossings_at_change,
            cos_delta,
        },
    );
    let reference = prop::option::of(
        (any::<i64>(), any::<u32>()).prop_map(|(crossings, code)| Reference { crossings, code }),
    );
    (any::<u16>(), saved, reference, any::<u32>(), any::<u32>(), any::<[u8; 24]>()).prop_map(
        |(fingerprint, saved, reference, serial, writes, bus)| Kept {
            fingerprint,
            saved,
            reference,
            serial,
            writes,
            bus,
        },
    )
}
