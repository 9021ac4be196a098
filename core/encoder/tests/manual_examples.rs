//! The numbers the manuals print.

mod common;

use codewheel_encoder::{Block, Direction, Encoder, Refusal, Settings};
use common::{MULTITURN, at_millis, code, encoder_with, products};

/// DeviceNet manual §8, "Total resolution in steps"; PROFIBUS manual §8, "Example".
#[test]
fn the_worked_example_3600_times_256_comes_out_as_printed() {
    let mut encoder = encoder_with(MULTITURN, Settings::default_for(MULTITURN));
    encoder.sample(at_millis(0), code(0));
    assert_eq!(encoder.set_total_resolution(8_192 * 256), Ok(true));
    assert_eq!(encoder.set_steps_per_turn(3_600), Ok(true), "256 turns as programmed stay");
    let total = encoder.settings().total_resolution;
    assert_eq!(total, 921_600);
    assert_eq!(total, 0xE1000);
    assert_eq!((total >> 16, total & 0xFFFF), (14, 4_096));

    let half_a_turn = 4_096;
    encoder.sample(at_millis(10), code(half_a_turn));
    assert_eq!(encoder.position(), 1_800);
    encoder.sample(at_millis(20), code(8_192 * 255 + 8_191));
    assert_eq!(encoder.position(), 921_599, "the last step of the measuring range");
    encoder.sample(at_millis(30), code(8_192 * 256));
    assert_eq!(encoder.position(), 0, "and its beginning anew");
}

/// Both manuals, §4: the tables of operating parameters.
#[test]
fn every_product_starts_with_the_defaults_of_the_manual() {
    let all = products();
    assert_eq!(all.len(), 23);
    for (name, model) in all {
        let encoder = Encoder::with_defaults(model);
        assert_eq!(encoder.block(), Block::default_for(model), "{name}");
        assert_eq!(encoder.block().check(model), Ok(()), "{name}");
        let Settings { direction, steps_per_turn, total_resolution, scaling } = encoder.settings();
        let bits = name.chars().rev().take(2).collect::<Vec<_>>();
        let (steps, total) = match bits[..] {
            ['3', '1'] => (8_192, 8_192),
            ['8', '1'] => (262_144, 262_144),
            _ => (8_192, 536_870_912),
        };
        assert_eq!((direction, scaling), (Direction::Cw, true), "{name}");
        assert_eq!((steps_per_turn, total_resolution), (steps, total), "{name}");
        assert_eq!((encoder.preset(), encoder.offset(), encoder.cos_delta()), (0, 0, 1), "{name}");
        assert!(!encoder.has_sample() && !encoder.alarm() && !encoder.warning(), "{name}");
    }
}

/// DeviceNet manual §8: "Total resolution = Steps per turn × turns", so more is refused.
#[test]
fn a_total_beyond_the_turns_of_the_disc_is_refused_with_what_is_possible() {
    let mut encoder = encoder_with(MULTITURN, Settings::default_for(MULTITURN));
    let asked = Settings { steps_per_turn: 3_600, ..encoder.settings() };
    let refusal = encoder.apply(asked).unwrap_err();
    assert_eq!(refusal, Refusal::TotalResolution { max: 3_600 * 65_536 });
    assert!(refusal.to_string().contains("lower the total as well"));
    assert_eq!(encoder.settings(), Settings::default_for(MULTITURN));
}

/// Decision: a code of N or more is taken modulo N.
#[test]
fn a_code_beyond_the_disc_is_taken_modulo_its_range() {
    for (name, model) in products() {
        let mut encoder = encoder_with(model, Settings::default_for(model));
        encoder.sample(at_millis(0), code(u32::MAX));
        assert_eq!(encoder.code(), model.geometry.range() - 1, "{name}");
        assert_eq!(encoder.position(), model.geometry.range() - 1, "{name}");
    }
}

/// AMG 81 multiturn only: PROFIBUS manual §7.2, octets 20 to 23.
#[test]
fn only_a_product_with_a_lithium_cell_warns_and_only_while_its_voltage_is_low() {
    for (name, model) in products() {
        let mut encoder = encoder_with(model, Settings::default_for(model));
        let mut low = code(5);
        low.cell_low = true;
        encoder.sample(at_millis(0), low);
        assert_eq!(encoder.warning(), name == "amg81-d29" || name == "amg81-p29", "{name}");
        encoder.sample(at_millis(10), code(5));
        assert!(!encoder.warning(), "{name}");
    }
}

#[test]
fn an_encoder_fits_into_300_octets() {
    let size = size_of::<Encoder>();
    assert!(size <= 300, "{size} octets");
}
