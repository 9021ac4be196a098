//! The rows of Set_Prm as a GSD file needs them (PROFIBUS manual §6.1 and §8; profibus clause 4).

use codewheel_device::product::PROFIBUS;
use codewheel_device::profibus::parameters::{LENGTHS, ROWS, Row, default_octets};
use codewheel_encoder::{Geometry, Model};

use crate::bench::{Bench, hex, octets_of};

fn row(key: &str) -> &'static Row {
    Row::find(key).expect("a row")
}

fn model(geometry: Geometry) -> Model {
    Model { geometry, lithium_cell: false, total_follows_steps: false }
}

/// The vendor's GSD file of the 13-bit encoders, User_Prm_Data.
#[test]
fn the_default_octets_are_those_of_the_vendors_gsd_file() {
    assert_eq!(
        default_octets(model(Geometry::SINGLETURN_13)).to_vec(),
        octets_of("00 0A 00 00 20 00 00 00 20 00 00 00 00 00 00 00 00 00")
    );
    assert_eq!(
        hex(&default_octets(model(Geometry::MULTITURN_29))),
        "000A0000200020000000".to_owned() + "0000000000000000"
    );
}

#[test]
fn the_default_octets_bring_every_product_to_the_exchange_of_data() {
    for product in &PROFIBUS {
        let octets = default_octets(product.encoder);
        let bench = Bench::power_up(product.model).running(&hex(&octets[1..]));
        assert!(bench.state().class_2);
        assert_eq!(
            bench.snapshot().in_force.settings.total_resolution,
            product.encoder.geometry.range()
        );
    }
}

/// The words of a row: octet, default, range.
fn words(key: &str, geometry: Geometry) -> [(u8, u16, u16, u16); 2] {
    row(key).words(model(geometry)).expect("a number").map(|word| {
        assert!(word.name.len() <= 32 && word.name.is_ascii(), "{}", word.name);
        (word.octet, word.default, *word.range.start(), *word.range.end())
    })
}

#[test]
fn numbers_are_two_words_with_the_ranges_of_the_gsd_file() {
    let (steps, total) = ("steps-per-turn", "total-resolution");
    for (key, geometry, expected) in [
        (steps, Geometry::SINGLETURN_13, [(10, 0, 0, 0), (12, 8_192, 1, 8_192)]),
        (total, Geometry::SINGLETURN_13, [(14, 0, 0, 0), (16, 8_192, 1, 8_192)]),
        (steps, Geometry::MULTITURN_29, [(10, 0, 0, 0), (12, 8_192, 1, 8_192)]),
        (total, Geometry::MULTITURN_29, [(14, 8_192, 0, 8_192), (16, 0, 0, 65_535)]),
        (steps, Geometry::SINGLETURN_18, [(10, 4, 0, 4), (12, 0, 0, 65_535)]),
        (total, Geometry::SINGLETURN_18, [(14, 4, 0, 4), (16, 0, 0, 65_535)]),
    ] {
        assert_eq!(words(key, geometry), expected, "{key} {geometry:?}");
    }
    assert_eq!(row("scaling").words(model(Geometry::MULTITURN_29)), None);
}

#[test]
fn every_row_reads_what_it_wrote_and_leaves_the_others_alone() {
    let model = model(Geometry::MULTITURN_29);
    for row in ROWS {
        let (minimum, maximum) = (row.range)(model).into_inner();
        for value in [minimum, maximum] {
            let mut user = default_octets(model);
            row.write(value, &mut user);
            for other in ROWS {
                let expected = if other.key == row.key { value } else { (other.default)(model) };
                assert_eq!(other.read(&user), Some(expected), "{} after {}", other.key, row.key);
            }
        }
        assert!(LENGTHS.contains(&row.length()));
        let short = default_octets(model);
        let short = &short[..usize::from(row.octets.last) - 8];
        assert_eq!(row.read(short), None, "{} in a Set_Prm one octet too short", row.key);
        assert!((row.range)(model).contains(&(row.default)(model)));
    }
}

#[test]
fn names_fit_a_gsd_file_and_keys_a_command_line() {
    for (place, row) in ROWS.iter().enumerate() {
        assert!(row.name.len() <= 32 && row.name.is_ascii() && !row.help.is_empty());
        assert!(row.key.bytes().all(|octet| octet.is_ascii_alphanumeric() || octet == b'-'));
        assert!(ROWS[place + 1..].iter().all(|other| other.key != row.key));
    }
}
