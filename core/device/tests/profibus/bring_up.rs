//! From power-up to the exchange of data, octet for octet (profibus clauses 2 and 5).

use codewheel_device::product::PROFIBUS;
use codewheel_encoder::Geometry;
use codewheel_profibus::State;
use codewheel_sim::memory::TornMemory;

use crate::bench::{Bench, EXAMPLE, Hand, hex, octets_of};

/// The diagnosis of a 29-bit encoder behind the first six octets, with everything at its default.
const REST: &str = "33 00 0A 01 00 00 20 00 FF FF 00 00 01 00 00 00 00 01 10 01 21 FF FF FF FF \
                    00 00 00 00 00 00 00 00 00 00 20 00 20 00 00 00 2A 2A 2A 2A 2A 2A 2A 2A 2A 2A";

#[test]
fn the_conversation_of_the_book_is_answered_octet_for_octet() {
    let hand = Hand { code: 0x0123_4567, ..Hand::default() };
    let mut bench = Bench::power_up_with("amg11-p29", TornMemory::new(), hand);
    bench.answers(
        "68 05 05 68 87 82 6C 3C 3E EF 16",
        &["68 3E 3E 68 82 87 08 3E 3C 02 05 00 FF 05 9B", REST, "A1 16"].concat(),
    );
    bench.answers(
        "68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00 A2 16",
        "E5",
    );
    bench.answers("68 06 06 68 87 82 7C 3E 3E F1 F2 16", "E5");
    bench.answers(
        "68 05 05 68 87 82 5C 3C 3E DF 16",
        &["68 3E 3E 68 82 87 08 3E 3C 00 0C 00 02 05 9B", REST, "A9 16"].concat(),
    );
    bench.answers(
        "68 07 07 68 07 02 7D 00 00 00 00 86 16",
        "68 07 07 68 02 07 08 01 23 45 67 E1 16",
    );
}

/// n and T at their defaults, and what the diagnosis says of the disc: type, S, revolutions.
fn by_hand(geometry: Geometry) -> (&'static str, &'static str) {
    match geometry {
        Geometry::SINGLETURN_13 => ("00002000 00002000", "00 00002000 0000"),
        Geometry::SINGLETURN_18 => ("00040000 00040000", "00 00040000 0000"),
        _ => ("00002000 20000000", "01 00002000 FFFF"),
    }
}

#[test]
fn every_product_exchanges_data_in_both_classes_and_all_four_configurations() {
    for product in &PROFIBUS {
        let (values, disc) = by_hand(product.encoder.geometry);
        let code = product.encoder.geometry.range() - 2;
        for identifier in [0xD0, 0xD1, 0xF0, 0xF1] {
            for class in [1, 2] {
                let what = format!("{} class {class} {identifier:02X}h", product.model);
                let mut bench = Bench::power_up(product.model);
                bench.turn_to(code);
                let octets = if class == 1 { "00" } else { &["0A", values].concat() };
                bench.brings_up(octets, identifier);
                let diagnosis = hex(&bench.diagnosis());
                let status = if class == 1 { "0A 00 02" } else { "33 00 0A" };
                let front = ["00 0C 00 02 05 9B", status, disc].concat();
                assert!(diagnosis.starts_with(&hex(&octets_of(&front))), "{what}: {diagnosis}");
                assert_eq!(diagnosis.len() / 2, if class == 1 { 16 } else { 57 }, "{what}");
                let outputs = match identifier {
                    0xF0 => "0000",
                    0xF1 => "00000000",
                    _ => "",
                };
                let (response, inputs) = bench.exchanges(outputs);
                let expected = match identifier {
                    0xD1 | 0xF1 => format!("{code:08X}"),
                    _ => format!("{:04X}", code & 0xFFFF),
                };
                assert_eq!((response, inputs), (0x08, expected), "{what}");
                assert_eq!(
                    bench.asks(0x3B, &[]).expect("Get_Cfg")[18..20],
                    format!("{identifier:02X}")
                );
            }
        }
    }
}

#[test]
fn before_there_was_a_configuration_get_cfg_names_one_word_for_13_bits_and_two_for_the_others() {
    for (model, identifier) in [("amg11-p13", "F0"), ("heag162-p18", "F1"), ("hmg10-p29", "F1")] {
        let mut bench = Bench::power_up(model);
        assert_eq!(&bench.asks(0x3B, &[]).expect("Get_Cfg")[18..20], identifier, "{model}");
    }
}

#[test]
fn set_prm_has_7_9_17_or_25_octets_and_the_short_ones_are_class_1() {
    for (octets, class_2) in [
        ("0000", false),
        ("01", false),
        ("02", true),
        (EXAMPLE, true),
        ("0A 00000E10 000E1000 0000000000000000", true),
    ] {
        let mut bench = Bench::power_up("amg11-p29");
        if octets == "0000" {
            // Without octet 8.
            let answer = bench.asks(0x3D, &octets_of("88 01 C8 0B 05 9B 00"));
            assert_eq!(answer.as_deref(), Some("E5"));
        } else {
            bench.parameterizes(octets);
        }
        assert_eq!(bench.state().state, State::WaitCfg, "{octets}");
        assert_eq!(bench.state().class_2, class_2, "{octets}");
        assert_eq!(bench.diagnosis().len(), if class_2 { 57 } else { 16 }, "{octets}");
    }
}

/// PROFIBUS manual §8: 3600 × 256 = 921600 = E1000h, high word 14, low word 4096.
#[test]
fn the_example_of_the_manual_scales_256_turns_to_921600_steps() {
    let mut bench = Bench::power_up("amg11-p29").running("0A 0000 0E10 000E 1000");
    for (code, position) in [(0, 0), (8_192, 3_600), (256 * 8_192 - 1, 921_599), (256 * 8_192, 0)] {
        bench.turn_to(code);
        assert_eq!(bench.position("00000000"), position, "code {code}");
    }
    let diagnosis = hex(&bench.diagnosis());
    assert_eq!(diagnosis[78..94], *"00000E10000E1000");
}

#[test]
fn ccw_counts_down_and_is_told_in_octet_9() {
    let mut bench = Bench::power_up("amg11-p13");
    bench.turn_to(10);
    let mut bench = bench.running("0B 00002000 00002000");
    assert_eq!(bench.diagnosis()[8], 0x0B);
    assert_eq!(bench.position("00000000"), 8_192 - 10);
    bench.turn_to(11);
    assert_eq!(bench.position("00000000"), 8_192 - 11);
    // Without class 2 the direction counts all the same.
    bench.brings_up("01", 0xD1);
    assert_eq!(bench.diagnosis()[8], 0x03);
    assert_eq!(bench.position(""), 8_192 - 11);
}

#[test]
fn without_class_2_nothing_is_scaled_whatever_is_sent() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.turn_to(1_000_000);
    // Even values that class 2 would refuse.
    bench.brings_up("08 FFFFFFFF 00000000", 0xD1);
    assert_eq!(bench.position(""), 1_000_000);
    assert_eq!(bench.diagnosis()[8], 0x02);
    let told = bench.told();
    let scaled = "Set_Prm octet 9: scaling is on and class 2 off, so the position is not scaled";
    assert!(told.contains(&scaled.to_string()), "{told:?}");
}

#[test]
fn class_2_without_scaling_works_in_the_steps_of_the_disc() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.turn_to(1_000_000);
    let mut bench = bench.running("02 00000001 FFFFFFFF");
    assert_eq!(bench.position("00000000"), 1_000_000);
    let diagnosis = hex(&bench.diagnosis());
    assert_eq!(diagnosis[78..94], *"0000200020000000");
}

#[test]
fn reserved_bits_and_octets_are_ignored_and_told() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.parameterizes("FA 00000E10 000E1000 0000005500000000");
    let told = bench.told();
    assert!(
        told.contains(&"Set_Prm octet 9: the reserved bits F0h are ignored".into()),
        "{told:?}"
    );
    assert!(told.contains(&"Set_Prm octet 21: reserved, 55h is ignored".into()), "{told:?}");
    // Commissioning diagnostics, bit 2, is none of them.
    bench.parameterizes("0E 00000E10 000E1000");
    assert!(!bench.told().iter().any(|text| text.contains("ignored")));
}

#[test]
fn one_word_that_is_too_short_for_the_position_is_told() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.brings_up(EXAMPLE, 0xF0);
    let events = bench.events();
    let text = "position needs 20 bits, 16 are sent: choose two words";
    let event = events.iter().find(|event| event.to_string() == text);
    assert!(event.is_some_and(|event| event.is_trouble()), "{events:?}");
    bench.brings_up("0A 00000001 00010000", 0xF0);
    assert!(!bench.told().iter().any(|text| text.contains("bits, 16")), "65536 steps fit");
}

#[test]
fn what_the_shaft_shows_at_power_up_is_no_alarm() {
    let hand = Hand { code: 123_456_789, ..Hand::default() };
    let mut bench = Bench::power_up_with("amg11-p29", TornMemory::new(), hand);
    bench.brings_up("00", 0xD1);
    assert_eq!(bench.exchanges(""), (0x08, "075BCD15".into()));
}

#[test]
fn reserved_bits_of_octet_8_are_told() {
    let mut bench = Bench::power_up("amg11-p29");
    bench.events();
    let answer = bench.asks(0x3D, &octets_of("88 01 C8 0B 05 9B 00 18 00"));
    assert_eq!(answer.as_deref(), Some("E5"));
    let told = bench.told();
    assert!(told.iter().any(|text| text.contains("octet 8")), "{told:?}");
}
