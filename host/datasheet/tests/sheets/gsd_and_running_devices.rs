//! GSD files, read by gsd-parser, against slaves that run, brought up by profirust: a master that
//! knows the file alone comes to data exchange with every product.

use std::path::Path;

use codewheel_commission::profibus::SlaveState;
use codewheel_datasheet::{from_hilo, hilo, sheet_for};
use codewheel_device::product::PROFIBUS;
use codewheel_device::profibus::diagnosis::Row as Diagnosis;
use codewheel_device::{Product, profibus};
use codewheel_encoder::{Direction, Settings};
use codewheel_station::rs485::BaudRate;
use gsd_parser::{
    GenericStationDescription, Module, PrmBuilder, PrmValueConstraint, SupportedSpeeds,
    UserPrmDataDefinition,
};

use crate::gsd_reader::{Facts, facts};
use crate::segment::{CODE, Outcome, Plan, lengths};

const STEPS: [&str; 2] = ["Measuring units per rev. hi", "Measuring units per rev. lo"];
const TOTAL: [&str; 2] = ["Total measuring range (units) hi", "Total measuring range (units) lo"];
const POSITION_AND_PRESET: &str = "32 bit position and preset";
/// One product of each file.
const ONE_OF_EACH: [&str; 3] = ["amg11-p13", "heag162-p18", "amg11-p29"];

fn product(model: &str) -> &'static Product {
    Product::find(model).expect("a model of the catalogue")
}

fn read(product: &Product) -> GenericStationDescription {
    let sheet = sheet_for(product);
    match gsd_parser::parser::parse(Path::new(sheet.file_name), &sheet.text) {
        Ok(gsd) => gsd,
        Err(error) => panic!("{error}"),
    }
}

fn keywords(product: &Product) -> Facts {
    facts(&sheet_for(product).text)
}

fn module<'a>(gsd: &'a GenericStationDescription, name: &str) -> &'a Module {
    gsd.available_modules.iter().find(|module| module.name == name).expect("a module of the file")
}

fn definition<'a>(gsd: &'a GenericStationDescription, name: &str) -> &'a UserPrmDataDefinition {
    let mut references = gsd.user_prm_data.data_ref.iter();
    &references.find(|(_, definition)| definition.name == name).expect("a parameter of the file").1
}

fn limits(gsd: &GenericStationDescription, name: &str) -> (u32, u32) {
    match definition(gsd, name).constraint {
        PrmValueConstraint::MinMax(minimum, maximum) => (minimum as u32, maximum as u32),
        ref other => panic!("{name}: {other:?}"),
    }
}

/// The octets of Set_Prm from 8 on, with these numbers in the fields that a tool shows.
fn parameters(gsd: &GenericStationDescription, steps: u32, total: u32) -> Vec<u8> {
    let mut builder = PrmBuilder::new(&gsd.user_prm_data);
    for ([hi, lo], value) in [(STEPS, steps), (TOTAL, total)] {
        let (high, low) = hilo(value);
        builder.set_prm(hi, high.into()).set_prm(lo, low.into());
    }
    builder.into_bytes()
}

fn defaults(gsd: &GenericStationDescription) -> Vec<u8> {
    PrmBuilder::new(&gsd.user_prm_data).into_bytes()
}

fn run(product: &'static Product, name: &str, octets: &[u8]) -> Outcome {
    let gsd = read(product);
    Plan::of(product, &gsd, module(&gsd, name), octets).run()
}

#[test]
fn a_file_says_of_the_device_what_the_device_says_of_itself() {
    for product in &PROFIBUS {
        let gsd = read(product);
        let bits = product.encoder.geometry.range().trailing_zeros();
        assert_eq!(gsd.gsd_revision, 1);
        assert_eq!((gsd.vendor.as_str(), gsd.ident_number), ("Baumer group", 0x059B));
        assert_eq!(gsd.model, format!("xMG_HEAG {bits} bit"));
        assert!(gsd.model.len() <= 32);
        assert!(gsd.sync_mode_supported && gsd.freeze_mode_supported && gsd.auto_baud_supported);
        assert!(!gsd.set_slave_addr_supported && !gsd.fail_safe);
        assert!(gsd.modular_station);
        assert_eq!((gsd.max_modules, gsd.max_input_length), (1, 4));
        assert_eq!((gsd.max_output_length, gsd.max_data_length), (4, 8));
        assert_eq!(gsd.supported_speeds, SupportedSpeeds::all() - SupportedSpeeds::B31250);
        assert_eq!(gsd.max_tsdr, gsd_parser::MaxTsdr::default());
        let running = run(product, POSITION_AND_PRESET, &defaults(&gsd)).diagnosis;
        assert_eq!(running.ident_number, gsd.ident_number);
        let octets = 6 + running.extended.len();
        assert!(octets <= usize::from(gsd.max_diag_data_length), "{octets} octets of diagnosis");
    }
}

#[test]
fn class_and_profile_are_those_of_the_diagnosis() {
    for model in ONE_OF_EACH {
        let product = product(model);
        let gsd = read(product);
        let keywords = keywords(product);
        let running = run(product, POSITION_AND_PRESET, &defaults(&gsd)).diagnosis;
        let whole = [&[0; 6][..], &running.extended].concat();
        let told = |key| Diagnosis::find(key).and_then(|row| row.number_in(&whole));
        assert_eq!(told("profile-version"), Some(0x0110));
        assert_eq!(keywords["DP_Encoder_profile_version"], "1.1");
        assert_eq!(told("operating-status").map(|bits| bits & 0b10), Some(0b10));
        assert_eq!(keywords["DP_Encoder_class"], "2");
        assert_eq!(keywords["Slave_Family"], "7", "encoders");
    }
}

#[test]
fn tools_of_both_revisions_send_the_same_octets() {
    for product in &PROFIBUS {
        let keywords = keywords(product);
        let gsd = read(product);
        let octets = defaults(&gsd);
        let text: Vec<String> = octets.iter().map(u8::to_string).collect();
        assert_eq!(keywords["User_Prm_Data_Len"], "18");
        assert_eq!(keywords["Max_User_Prm_Data_Len"], "18");
        assert_eq!(keywords["User_Prm_Data"], text.join(","), "{}", product.model);
        assert_eq!(keywords["Ext_User_Prm_Data_Const(0)"], text.join(","), "{}", product.model);
        assert_eq!(octets, profibus::parameters::default_octets(product.encoder));
    }
}

/// PROFIBUS manual §4 and §8: what a tool lets people enter, hi and lo.
#[test]
fn fields_take_what_the_manual_allows() {
    let full = (0, 65_535);
    for (model, steps, total) in [
        ("amg11-p13", [(0, 0), (1, 8_192)], [(0, 0), (1, 8_192)]),
        ("heag162-p18", [(0, 4), full], [(0, 4), full]),
        ("amg11-p29", [(0, 0), (1, 8_192)], [(0, 8_192), full]),
    ] {
        let gsd = read(product(model));
        assert_eq!(STEPS.map(|name| limits(&gsd, name)), steps, "{model}");
        assert_eq!(TOTAL.map(|name| limits(&gsd, name)), total, "{model}");
        let texts = definition(&gsd, "Sense of rotation").text_ref.clone().expect("names");
        assert_eq!((texts["CW"], texts["CCW"]), (0, 1));
        for (name, default) in [
            ("Sense of rotation", 0),
            ("Class 2 functionality", 1),
            ("Commissioning diagnostics", 0),
            ("Scaling function", 1),
        ] {
            let definition = definition(&gsd, name);
            assert_eq!(definition.default_value, default, "{name}");
            assert_eq!(limits(&gsd, name), (0, 1), "{name}");
            assert!(definition.text_ref.is_some(), "{name}");
        }
        let long = gsd.user_prm_data.data_ref.iter().find(|(_, found)| found.name.len() > 32);
        assert_eq!(long, None, "GSD specification: 32 characters");
    }
}

#[test]
fn every_product_comes_to_data_exchange_with_every_module_and_the_defaults() {
    for product in &PROFIBUS {
        let gsd = read(product);
        assert_eq!(gsd.available_modules.len(), 4);
        for module in &gsd.available_modules {
            let outcome = Plan::of(product, &gsd, module, &defaults(&gsd)).run();
            let name = format!("{}, {}", product.model, module.name);
            assert_eq!(outcome.state, SlaveState::DataExchange, "{name}");
            assert_eq!(outcome.in_force, Settings::default_for(product.encoder), "{name}");
            assert!(outcome.class_2, "{name}");
            let octets = CODE.to_be_bytes();
            let (inputs, _) = lengths(&module.config);
            assert_eq!(outcome.inputs, octets[4 - inputs..], "{name}");
        }
    }
}

/// PROFIBUS manual §8: 3600 steps and 256 turns, entered as hi 14 and lo 4096.
#[test]
fn the_example_of_the_manual_reaches_the_encoder_through_hi_and_lo() {
    let product = product("amg11-p29");
    let gsd = read(product);
    let octets = parameters(&gsd, 3_600, 921_600);
    assert_eq!(octets[1..10], [0x0A, 0x00, 0x00, 0x0E, 0x10, 0x00, 0x0E, 0x10, 0x00]);
    let outcome = run(product, POSITION_AND_PRESET, &octets);
    assert_eq!(outcome.state, SlaveState::DataExchange);
    let Settings { direction, steps_per_turn, total_resolution, scaling } = outcome.in_force;
    assert_eq!((steps_per_turn, total_resolution), (3_600, 921_600));
    assert_eq!((direction, scaling), (Direction::Cw, true));
    assert_eq!(outcome.inputs, (CODE * 3_600 / 8_192).to_be_bytes());
}

#[test]
fn what_the_example_asks_for_is_too_much_for_one_turn() {
    for (model, accepted) in [("amg11-p13", false), ("heag162-p18", false), ("amg11-p29", true)] {
        // A tool keeps to the limits of the 13-bit file, so these octets are made with another.
        let octets = parameters(&read(product("amg11-p29")), 3_600, 921_600);
        let outcome = run(product(model), POSITION_AND_PRESET, &octets);
        let expected = if accepted { SlaveState::DataExchange } else { SlaveState::ParameterError };
        assert_eq!(outcome.state, expected, "{model}");
    }
}

#[test]
fn texts_that_a_tool_shows_choose_what_they_say() {
    for model in ONE_OF_EACH {
        let product = product(model);
        let gsd = read(product);
        let mut builder = PrmBuilder::new(&gsd.user_prm_data);
        builder.set_prm_from_text("Sense of rotation", "CCW");
        builder.set_prm_from_text("Commissioning diagnostics", "ON");
        let outcome = run(product, POSITION_AND_PRESET, builder.as_bytes());
        assert_eq!(outcome.state, SlaveState::DataExchange, "{model}");
        assert_eq!(outcome.in_force.direction, Direction::Ccw, "{model}");
        let position = product.encoder.geometry.range() - CODE;
        assert_eq!(outcome.inputs, position.to_be_bytes(), "{model}");
    }
}

/// The octets that the defaults give, with one number overwritten where its references point to.
fn overwritten(gsd: &GenericStationDescription, numbers: [([&str; 2], u32); 2]) -> Vec<u8> {
    let mut octets = defaults(gsd);
    for (names, value) in numbers {
        let (hi, lo) = hilo(value);
        for (name, word) in names.into_iter().zip([hi, lo]) {
            let mut references = gsd.user_prm_data.data_ref.iter();
            let (offset, _) = references.find(|(_, found)| found.name == name).expect(name);
            octets[*offset..offset + 2].copy_from_slice(&word.to_be_bytes());
        }
    }
    octets
}

/// A tool judges hi and lo each for itself. Where hi can be more than 0, lo can be anything, and the
/// slave has the last word.
#[test]
fn the_slave_takes_the_limits_of_the_file_and_refuses_what_lies_beyond() {
    for model in ONE_OF_EACH {
        let product = product(model);
        let gsd = read(product);
        let highest = |[hi, lo]: [&str; 2]| {
            let (_, hi) = limits(&gsd, hi);
            let lo = if hi == 0 { limits(&gsd, lo).1 } else { 0 };
            from_hilo(hi, lo).expect("two words")
        };
        let (steps, total) = (highest(STEPS), highest(TOTAL));
        for (steps, total, accepted) in [
            (steps, total, true),
            (steps + 1, total, false),
            (steps, total + 1, false),
            (1, 1, true),
            (0, 1, false),
            (1, 0, false),
        ] {
            let octets = overwritten(&gsd, [(STEPS, steps), (TOTAL, total)]);
            let outcome = run(product, POSITION_AND_PRESET, &octets);
            let case = format!("{model}, n {steps}, T {total}");
            if accepted {
                assert_eq!(outcome.state, SlaveState::DataExchange, "{case}");
                assert_eq!(outcome.in_force.steps_per_turn, steps, "{case}");
                assert_eq!(outcome.in_force.total_resolution, total, "{case}");
            } else {
                assert_eq!(outcome.state, SlaveState::ParameterError, "{case}");
            }
        }
    }
}

#[test]
fn every_rate_of_the_file_is_found_by_a_slave_that_searches() {
    let product = product("amg11-p29");
    let gsd = read(product);
    let keywords = keywords(product);
    for rate in BaudRate::ALL {
        let name = rate.to_string();
        let keyword = format!("{}_supp", name.trim_end_matches('k'));
        assert_eq!(keywords[&keyword], "1");
        let module = module(&gsd, POSITION_AND_PRESET);
        let plan = Plan::of(product, &gsd, module, &defaults(&gsd));
        let outcome = plan.searching_at(rate).run();
        assert_eq!(outcome.state, SlaveState::DataExchange, "{rate}");
    }
    let rates = keywords.keys().filter(|keyword| keyword.ends_with("M_supp")).count();
    assert_eq!(rates, 4, "1.5M, 3M, 6M, 12M");
}
