//! The Parameter object, class 0F (AMG manual §7; devicenet clause 5).

use crate::bench::{Bench, hex, octets};

/// One parameter as the manual and the standard have it.
struct Parameter {
    /// The attribute of class 2F (AMG manual §7).
    link: u8,
    /// The name in the manual.
    name: &'static str,
    /// Type code (CIP volume 1, appendix C) and size.
    data_type: (u8, usize),
    settable: bool,
    enumerated: bool,
    default: u32,
}

const BOOL: (u8, usize) = (0xC1, 1);
const DINT: (u8, usize) = (0xC4, 4);
const USINT: (u8, usize) = (0xC6, 1);
const UINT: (u8, usize) = (0xC7, 2);
const UDINT: (u8, usize) = (0xC8, 4);

const fn setting(
    link: u8,
    name: &'static str,
    data_type: (u8, usize),
    enumerated: bool,
    default: u32,
) -> Parameter {
    Parameter { link, name, data_type, settable: true, enumerated, default }
}

const fn reading(
    link: u8,
    name: &'static str,
    data_type: (u8, usize),
    enumerated: bool,
    default: u32,
) -> Parameter {
    Parameter { link, name, data_type, settable: false, enumerated, default }
}

/// The manual's table, with the types of §8 and the defaults of §4 for an AMG 81 D29.
const TABLE: [Parameter; 19] = [
    setting(3, "Sense of rotation", BOOL, true, 0),
    reading(4, "Internal diagnostic function (not used)", BOOL, true, 0),
    reading(5, "Scaling function", BOOL, true, 1),
    reading(6, "Position format", USINT, true, 0),
    setting(7, "Steps per turn", UDINT, false, 8_192),
    setting(8, "Total resolution in steps", UDINT, false, 1 << 29),
    reading(9, "Measurement steps (not used)", UDINT, false, 0),
    setting(10, "Preset value", UDINT, false, 0),
    reading(12, "Position value", DINT, false, 0),
    reading(80, "Operating status", USINT, false, 0b110),
    reading(81, "Singleturn resolution", UDINT, false, 8_192),
    reading(82, "Number of revolutions", UINT, false, 65_535),
    reading(85, "Alarm flag", BOOL, true, 0),
    reading(83, "Alarm signals", UINT, false, 0),
    reading(84, "Supported alarm signals", UINT, false, 1),
    reading(88, "Warning flag", BOOL, true, 0),
    reading(86, "Warning messages", UINT, false, 0),
    reading(87, "Supported warning messages", UINT, false, 0x10),
    reading(89, "Profile / software version", UDINT, false, 0x0101_0110),
];

fn parameters() -> impl Iterator<Item = (u8, &'static Parameter)> {
    (1..).zip(&TABLE)
}

/// The data of a good answer to a Get.
#[track_caller]
fn get(bench: &mut Bench, instance: u8, attribute: u8) -> Vec<u8> {
    let answer = bench.ask(&format!("0E 0F {instance:02X} {attribute:02X}")).expect("an answer");
    let octets = octets(&answer);
    assert_eq!(octets[0], 0x8E, "0f/{instance}/{attribute}: {answer}");
    octets[1..].to_vec()
}

fn number(octets: &[u8]) -> u32 {
    octets.iter().rev().fold(0, |bits, octet| bits << 8 | u32::from(*octet))
}

/// The text of a SHORT_STRING, which nothing follows.
fn text(octets: &[u8]) -> String {
    assert_eq!(usize::from(octets[0]), octets.len() - 1);
    String::from_utf8(octets[1..].to_vec()).expect("ASCII")
}

fn value(parameter: &Parameter, value: u32) -> String {
    hex(&value.to_le_bytes()[..parameter.data_type.1])
}

#[test]
fn every_attribute_of_every_instance_agrees_with_the_manuals_table() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    for (instance, parameter) in parameters() {
        let Parameter { link, name, data_type: (code, size), .. } = *parameter;
        let linked = bench.ask(&format!("0E 2F 01 {link:02X}")).expect("an answer");
        assert_eq!(hex(&get(&mut bench, instance, 1)), linked[2..], "{name}: the value");
        assert_eq!(get(&mut bench, instance, 1).len(), size, "{name}");
        assert_eq!(get(&mut bench, instance, 2), [6], "{name}");
        assert_eq!(get(&mut bench, instance, 3), [0x20, 0x2F, 0x24, 1, 0x30, link], "{name}");
        let descriptor = number(&get(&mut bench, instance, 4));
        assert_eq!(get(&mut bench, instance, 4).len(), 2);
        assert_eq!(descriptor & 0b10 != 0, parameter.enumerated, "{name}: bit 1, enumerated");
        assert_eq!(descriptor & 0b1_0000 == 0, parameter.settable, "{name}: bit 4, read only");
        assert_eq!(descriptor & 0b1101, 0, "{name}: no settable path, no scaling");
        assert_eq!(get(&mut bench, instance, 5), [code], "{name}");
        assert_eq!(get(&mut bench, instance, 6), [size as u8], "{name}");
        for (attribute, limit) in [(7, 16), (8, 4), (9, 64)] {
            let text = text(&get(&mut bench, instance, attribute));
            assert!(text.len() <= limit, "{name}: {text}");
            assert!(text.bytes().all(|octet| (b' '..=b'~').contains(&octet)), "{name}: {text}");
            assert!(attribute == 8 || !text.is_empty(), "{name}");
        }
        if name.len() <= 16 {
            assert_eq!(text(&get(&mut bench, instance, 7)), name);
        }
        let [minimum, maximum, default] =
            [10, 11, 12].map(|attribute| get(&mut bench, instance, attribute));
        for limit in [&minimum, &maximum, &default] {
            assert_eq!(limit.len(), size, "{name}");
        }
        let [minimum, maximum, default] = [minimum, maximum, default].map(|octets| number(&octets));
        assert_eq!(default, parameter.default, "{name}");
        assert!((minimum..=maximum).contains(&default), "{name}: {minimum} … {maximum}");
        for (attribute, expected) in (13..=20).zip([1, 1, 1, 0, 0, 0, 0, 0]) {
            let octets = get(&mut bench, instance, attribute);
            assert_eq!((octets.len(), number(&octets)), (2, expected), "{name}, {attribute}");
        }
        assert_eq!(get(&mut bench, instance, 21), [0], "{name}");
        for absent in [0, 22, 23, 100, 255] {
            let request = format!("0F {instance:02X} {absent:02X}");
            bench.asks(&format!("0E {request}"), "94 14 FF");
            bench.asks(&format!("10 {request} 00"), "94 14 FF");
        }
        for fixed in 2..=21 {
            bench.asks(&format!("10 0F {instance:02X} {fixed:02X} 00"), "94 0E FF");
        }
    }
}

#[test]
fn the_short_names_are_told_apart() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    let mut names: Vec<String> =
        (1..=19).map(|instance| text(&get(&mut bench, instance, 7))).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), 19);
}

#[test]
fn the_limits_are_those_in_force() {
    let limits = |bench: &mut Bench, instance| {
        (number(&get(bench, instance, 10)), number(&get(bench, instance, 11)))
    };
    let mut bench = Bench::power_up("amg11-d29").allocated();
    assert_eq!(limits(&mut bench, 1), (0, 1));
    assert_eq!(limits(&mut bench, 5), (1, 8_192));
    assert_eq!(limits(&mut bench, 6), (1, 1 << 29));
    assert_eq!(limits(&mut bench, 8), (0, (1 << 29) - 1));
    bench.write(7, 3_600);
    bench.write(8, 921_600);
    assert_eq!(limits(&mut bench, 5), (1, 8_192), "S");
    assert_eq!(limits(&mut bench, 6), (1, 3_600 * 65_536), "n·M");
    assert_eq!(limits(&mut bench, 8), (0, 921_599), "T − 1");
    // The defaults stay what they are.
    assert_eq!(number(&get(&mut bench, 5, 12)), 8_192);
    assert_eq!(number(&get(&mut bench, 6, 12)), 1 << 29);
    let mut singleturn = Bench::power_up("amg11-d13").allocated();
    singleturn.write(7, 360);
    assert_eq!(limits(&mut singleturn, 5), (1, 8_192));
    assert_eq!(limits(&mut singleturn, 6).1, 360);
    assert_eq!(limits(&mut singleturn, 8), (0, 359));
    assert_eq!(number(&get(&mut singleturn, 6, 12)), 8_192);
    assert_eq!(number(&get(&mut singleturn, 12, 1)), 0);
}

#[test]
fn a_value_at_its_limit_is_taken_and_one_beyond_is_refused_as_through_class_2f() {
    for model in ["amg11-d29", "amg11-d13"] {
        for instance in [1, 5, 6, 8] {
            let parameter = &TABLE[usize::from(instance) - 1];
            let link = parameter.link;
            for attribute in [10, 11] {
                let mut bench = Bench::power_up(model).allocated();
                let limit = number(&get(&mut bench, instance, attribute));
                let limit_octets = value(parameter, limit);
                bench.asks(&format!("10 0F {instance:02X} 01 {limit_octets}"), "90");
                bench.asks(&format!("0E 2F 01 {link:02X}"), &format!("8E {limit_octets}"));
                // The limit may be another one now.
                let limit = number(&get(&mut bench, instance, attribute));
                let beyond = if attribute == 10 { limit.wrapping_sub(1) } else { limit + 1 };
                let beyond = value(parameter, beyond);
                let before = bench.device.encoder().block();
                bench.asks(&format!("10 0F {instance:02X} 01 {beyond}"), "94 09 FF");
                bench.asks(&format!("10 2F 01 {link:02X} {beyond}"), "94 09 FF");
                assert_eq!(bench.device.encoder().block(), before);
            }
        }
    }
}

#[test]
fn a_set_is_a_set_of_the_linked_attribute_with_all_its_refusals() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    for (instance, parameter) in parameters() {
        let Parameter { link, name, data_type: (_, size), settable, .. } = *parameter;
        let own = format!("10 0F {instance:02X} 01");
        let linked = format!("10 2F 01 {link:02X}");
        for length in [0, size - 1, size, size + 1, size + 3] {
            let data = hex(&[&[1][..], &[0; 8]].concat()[..length]);
            let through = bench.ask(&format!("{own} {data}"));
            let direct = bench.ask(&format!("{linked} {data}"));
            assert_eq!(through, direct, "{name} with {length} octets");
            let expected = match length {
                _ if !settable => "940EFF",
                length if length < size => "9413FF",
                length if length > size => "9415FF",
                _ => "90",
            };
            assert_eq!(through.as_deref(), Some(expected), "{name} with {length} octets");
        }
        bench.asks("05 0F 00", "85");
    }
    bench.asks("10 0F 01 01 02", "94 09 FF");
    bench.asks("10 0F 01 01 FF", "94 09 FF");
}

#[test]
fn a_preset_through_the_parameter_object_is_executed() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.turn_to(123_456);
    bench.asks("10 0F 08 01 E8 03 00 00", "90");
    assert_eq!((bench.read(12), bench.read(91)), (1_000, 1_000 - 123_456));
    assert_eq!(number(&get(&mut bench, 9, 1)), 1_000);
}

#[test]
fn the_class_tells_what_it_is() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    for (attribute, value) in
        [("01", "0100"), ("02", "1300"), ("08", "0F00"), ("09", "0000"), ("0A", "00")]
    {
        bench.asks(&format!("0E 0F 00 {attribute}"), &format!("8E {value}"));
        bench.asks(&format!("10 0F 00 {attribute} 00"), "94 08 FF");
    }
    for absent in ["00", "03", "07", "0B", "FF"] {
        bench.asks(&format!("0E 0F 00 {absent}"), "94 14 FF");
    }
    // Attributes 2, 8, 9, 10 (CIP volume 1, chapter 5); language 0 is English.
    bench.asks("01 0F 00", "81 1300 0F00 0000 00");
    bench.asks("01 0F 00 00", "94 15 FF");
}

#[test]
fn get_attributes_all_is_every_attribute_in_its_order() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    for instance in 1..=19 {
        let all: Vec<u8> =
            (1..=21).flat_map(|attribute| get(&mut bench, instance, attribute)).collect();
        bench.asks(&format!("01 0F {instance:02X}"), &format!("81 {}", hex(&all)));
        bench.asks(&format!("01 0F {instance:02X} 00"), "94 15 FF");
    }
}

#[test]
fn enumerated_values_have_names_and_others_have_none() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    bench.asks("4B 0F 01 00", &format!("CB 02 {}", hex(b"CW")));
    bench.asks("4B 0F 01 01", &format!("CB 03 {}", hex(b"CCW")));
    for (instance, parameter) in parameters() {
        let request = format!("4B 0F {instance:02X}");
        if !parameter.enumerated {
            bench.asks(&format!("{request} 00"), "94 08 FF");
            continue;
        }
        // A BOOL has two values; the one format of the position is in steps.
        let last = if parameter.data_type == BOOL { 1 } else { 0 };
        for value in 0..=last {
            let answer = bench.ask(&format!("{request} {value:02X}")).expect("an answer");
            let octets = octets(&answer);
            assert_eq!(octets[0], 0xCB, "{}: {answer}", parameter.name);
            let name = text(&octets[1..]);
            assert!((1..=16).contains(&name.len()), "{}: {name}", parameter.name);
        }
        bench.asks(&format!("{request} {:02X}", last + 1), "94 20 FF");
        bench.asks(&format!("{request} FF"), "94 20 FF");
        bench.asks(&request, "94 13 FF");
        bench.asks(&format!("{request} 00 00"), "94 15 FF");
    }
    bench.asks("4B 0F 00 00", "94 08 FF");
}

#[test]
fn save_restore_and_reset_are_for_all_parameters_together() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    bench.asks("10 0F 05 01 E8 03 00 00", "90");
    bench.asks("16 0F 00", "96");
    bench.asks("10 0F 05 01 D0 07 00 00", "90");
    bench.asks("15 0F 00", "95");
    assert_eq!(bench.read(7), 1_000);
    bench.asks("05 0F 00", "85");
    assert_eq!(bench.read(7), 8_192);
    for service in ["05", "15", "16"] {
        bench.asks(&format!("{service} 0F 00 00"), "94 15 FF");
        for instance in 1..=19 {
            bench.asks(&format!("{service} 0F {instance:02X}"), "94 08 FF");
        }
    }
    let mut bench = bench.power_cycled();
    assert_eq!(bench.read(7), 1_000);
}

#[test]
fn there_are_nineteen_instances_and_no_other_service() {
    let mut bench = Bench::power_up("amg11-d29").allocated();
    for instance in ["14", "15", "20", "FF"] {
        for service in ["01 0F", "05 0F", "15 0F", "16 0F", "4B 0F", "02 0F"] {
            bench.asks(&format!("{service} {instance}"), "94 16 FF");
        }
        bench.asks(&format!("0E 0F {instance} 01"), "94 16 FF");
        bench.asks(&format!("10 0F {instance} 01 00"), "94 16 FF");
    }
    for service in ["00", "02", "06", "08", "09", "0D", "4C", "7F"] {
        bench.asks(&format!("{service} 0F 00"), "94 08 FF");
        bench.asks(&format!("{service} 0F 01"), "94 08 FF");
    }
}
