//! EDS files against encoders that run: what the file says is what they answer.

use codewheel_device::product::DEVICENET;

use crate::devicenet_bench::Bench;
use crate::eds_reader::{Eds, Param, number, path, text};

const IDENTITY: u8 = 0x01;
const ASSEMBLY: u8 = 0x04;
const CONNECTION: u8 = 0x05;
const PARAMETER: u8 = 0x0F;
const STEPS_PER_TURN: u8 = 5;
const GET_ENUM_STRING: u8 = 0x4B;
const INVALID_VALUE: u8 = 0x09;
const NOT_SETTABLE: u8 = 0x0E;

fn every_file() -> impl Iterator<Item = (&'static str, Eds, Bench)> {
    let models = DEVICENET.iter().map(|product| product.model);
    models.map(|model| (model, Eds::of(model), Bench::allocated(model)))
}

fn unsigned(octets: &[u8]) -> i64 {
    octets.iter().rev().fold(0, |bits, octet| bits << 8 | i64::from(*octet))
}

fn short_string(octets: &[u8]) -> String {
    assert_eq!(usize::from(octets[0]), octets.len() - 1);
    String::from_utf8(octets[1..].to_vec()).expect("ASCII")
}

/// The limits and the default that the Parameter object tells at this moment.
fn told(bench: &mut Bench, param: &Param) -> [i64; 3] {
    [10, 11, 12].map(|attribute| {
        let octets = bench.get([PARAMETER, param.instance, attribute]);
        param.value(&octets)
    })
}

#[test]
fn a_file_has_the_sections_in_their_order() {
    let sections = [
        "File",
        "Device",
        "Device Classification",
        "IO_Info",
        "ParamClass",
        "Params",
        "EnumPar",
        "Groups",
    ];
    for (_, eds, _) in every_file() {
        assert_eq!(eds.section_names(), sections);
        assert_eq!(eds.fields("Device Classification", "Class1"), ["DeviceNet"]);
    }
}

#[test]
fn the_device_is_the_one_its_identity_object_tells() {
    for (model, eds, mut bench) in every_file() {
        for (entry, attribute) in [("VendCode", 1), ("ProdType", 2), ("ProdCode", 3)] {
            let told = unsigned(&bench.get([IDENTITY, 1, attribute]));
            assert_eq!(eds.number("Device", entry), told, "{model}: {entry}");
        }
        let revision = bench.get([IDENTITY, 1, 4]).into_iter().map(i64::from);
        let file = ["MajRev", "MinRev"].map(|entry| eds.number("Device", entry));
        assert!(revision.eq(file), "{model}: {file:?}");
        let name = short_string(&bench.get([IDENTITY, 1, 7]));
        assert_eq!(eds.text("Device", "ProdName"), name);
    }
}

#[test]
fn every_parameter_reads_as_its_instance_of_the_parameter_object() {
    for (model, eds, mut bench) in every_file() {
        for param in eds.params() {
            let mut get = |attribute| bench.get([PARAMETER, param.instance, attribute]);
            assert_eq!(get(2), [param.path.len() as u8], "{model}: {param:?}");
            assert_eq!(get(3), param.path, "{model}: {param:?}");
            assert_eq!(get(4), param.descriptor.to_le_bytes(), "{model}: {param:?}");
            assert_eq!(get(5), [param.type_code], "{model}: {param:?}");
            assert_eq!(get(6), [param.size as u8], "{model}: {param:?}");
            assert_eq!(short_string(&get(7)), param.name);
            assert_eq!(short_string(&get(8)), param.unit);
            assert_eq!(short_string(&get(9)), param.help);
            assert_eq!(param.value(&get(12)), param.default, "{model}: {param:?}");
            let scaling: Vec<i64> = (13..=21).map(|attribute| unsigned(&get(attribute))).collect();
            assert_eq!(param.scaling, scaling, "{model}: {param:?}");
        }
    }
}

#[test]
fn the_parameters_are_all_that_the_class_has_and_the_class_is_as_it_says() {
    for (model, eds, mut bench) in every_file() {
        let highest = unsigned(&bench.get([PARAMETER, 0, 2]));
        let instances = eds.params().into_iter().map(|param| i64::from(param.instance));
        assert!(instances.eq(1..=highest), "{model}");
        for (entry, attribute) in [("MaxInst", 2), ("Descriptor", 8), ("CfgAssembly", 9)] {
            let told = unsigned(&bench.get([PARAMETER, 0, attribute]));
            assert_eq!(eds.number("ParamClass", entry), told, "{model}: {entry}");
        }
    }
}

#[test]
fn every_path_leads_to_the_value_of_its_instance() {
    for (model, eds, mut bench) in every_file() {
        for param in eds.params() {
            let direct = bench.get(param.target());
            assert_eq!(direct, bench.get([PARAMETER, param.instance, 1]), "{model}: {param:?}");
            // Nothing was set, the shaft is at rest: all of it is at its default.
            assert_eq!(param.value(&direct), param.default, "{model}: {param:?}");
        }
    }
}

/// A new encoder has the widest limits but for the total resolution of singleturn encoders, which
/// follows the steps per turn; there the file has what both ends give together.
#[test]
fn limits_are_those_the_encoder_tells_over_all_its_settings() {
    for (model, eds, mut bench) in every_file() {
        let params = eds.params();
        let steps = &params[usize::from(STEPS_PER_TURN) - 1];
        let new: Vec<_> = params.iter().map(|param| told(&mut bench, param)).collect();
        bench.sets(steps.target(), &steps.octets(steps.minimum)).expect("the smallest is taken");
        for (param, [minimum, maximum, default]) in params.iter().zip(new) {
            let [least, most, _] = told(&mut bench, param);
            let widest = [minimum.min(least), maximum.max(most), default];
            assert_eq!([param.minimum, param.maximum, param.default], widest, "{model}: {param:?}");
            let follows = model.ends_with("d13") && param.name == "Total resolution";
            assert_eq!(widest[..2] == [minimum, maximum], !follows, "{model}: {param:?}");
        }
    }
}

#[test]
fn every_setting_takes_its_limits_and_nothing_beyond() {
    for (model, eds, _) in every_file() {
        for param in eds.params().iter().filter(|param| param.is_settable()) {
            for (limit, beyond) in
                [(param.minimum, param.minimum.wrapping_sub(1)), (param.maximum, param.maximum + 1)]
            {
                let mut bench = Bench::allocated(model);
                if param.name == "Total resolution" && model.ends_with("d13") {
                    let steps = [0x2F, 1, 7];
                    assert_eq!(bench.sets(steps, &param.octets(limit)), Ok(()));
                }
                let octets = param.octets(limit);
                assert_eq!(bench.sets(param.target(), &octets), Ok(()), "{model}: {param:?}");
                assert_eq!(bench.get(param.target()), octets, "{model}: {param:?}");
                let refused = bench.sets(param.target(), &param.octets(beyond));
                assert_eq!(refused, Err(INVALID_VALUE), "{model}, {beyond}: {param:?}");
            }
        }
    }
}

#[test]
fn what_is_read_only_there_cannot_be_set_here() {
    for (model, eds, mut bench) in every_file() {
        let params = eds.params();
        let settable = params.iter().filter(|param| param.is_settable());
        assert!(settable.map(|param| param.instance).eq([1, 5, 6, 8]), "AMG manual, 8");
        for param in params.iter().filter(|param| !param.is_settable()) {
            let refused = bench.sets(param.target(), &param.octets(param.default));
            assert_eq!(refused, Err(NOT_SETTABLE), "{model}: {param:?}");
        }
    }
}

#[test]
fn enumerated_values_have_the_names_that_the_encoder_gives() {
    for (model, eds, mut bench) in every_file() {
        for param in eds.params() {
            let enumerated = param.descriptor & 0x0002 != 0;
            assert_eq!(!param.names.is_empty(), enumerated, "{model}: {param:?}");
            let mut name = |value: usize| {
                bench.ask(&[GET_ENUM_STRING, PARAMETER, param.instance, value as u8])
            };
            for (value, expected) in param.names.iter().enumerate() {
                let answer = name(value);
                assert_eq!(answer[0], GET_ENUM_STRING | 0x80, "{model}: {param:?}");
                assert_eq!(short_string(&answer[1..]), *expected, "{model}: {param:?}");
            }
            // Not enumerated at all, or not that far.
            let status = if enumerated { 0x20 } else { 0x08 };
            assert_eq!(name(param.names.len()), [0x94, status, 0xFF], "{model}: {param:?}");
            assert!(!enumerated || param.maximum < param.names.len() as i64, "{model}: {param:?}");
        }
    }
}

#[test]
fn every_parameter_is_in_one_group() {
    for (model, eds, _) in every_file() {
        let mut grouped = Vec::new();
        for (_, fields) in eds.entries("Groups") {
            assert!(!text(&fields[0]).is_empty());
            let members: Vec<i64> = fields[2..].iter().map(|field| number(field)).collect();
            assert_eq!(number(&fields[1]), members.len() as i64, "{model}");
            grouped.extend(members);
        }
        grouped.sort_unstable();
        assert!(grouped.into_iter().eq(1..=19), "{model}");
    }
}

/// The assemblies of `[IO_Info]`: octets, connections, path.
fn inputs(eds: &Eds) -> Vec<(i64, i64, Vec<u8>)> {
    let entries = eds.entries("IO_Info").iter();
    let inputs = entries.filter(|(name, _)| name.starts_with("Input"));
    let inputs = inputs.map(|(_, fields)| {
        let path = path(&fields[5]);
        assert_eq!(fields.len(), 7);
        assert_eq!([number(&fields[1]), number(&fields[4])], [0, path.len() as i64]);
        assert!(!text(&fields[3]).is_empty() && !text(&fields[6]).is_empty());
        (number(&fields[0]), number(&fields[2]), path)
    });
    inputs.collect()
}

#[test]
fn every_input_is_an_assembly_that_the_poll_connection_can_produce() {
    for (model, eds, mut bench) in every_file() {
        let inputs = inputs(&eds);
        let assemblies = unsigned(&bench.get([ASSEMBLY, 0, 2]));
        assert_eq!(inputs.len() as i64, assemblies, "{model}");
        bench.allocates(0x02).expect("poll");
        for (octets, _, path) in &inputs {
            assert_eq!(bench.sets([CONNECTION, 2, 14], path), Ok(()), "{model}: {path:02X?}");
            assert_eq!(unsigned(&bench.get([CONNECTION, 2, 7])), *octets, "{model}");
            let size = unsigned(&bench.get([ASSEMBLY, path[3], 4]));
            assert_eq!(size, *octets, "{model}");
        }
        // Input1 is the default, and nothing is consumed.
        let mut new = Bench::allocated(model);
        new.allocates(0x02).expect("poll");
        for (entry, _, _) in CONNECTIONS {
            assert_eq!(eds.fields("IO_Info", entry)[1..], ["1", "0"], "{model}: {entry}");
        }
        assert_eq!(new.get([CONNECTION, 2, 14]), inputs[0].2, "{model}");
        assert_eq!(unsigned(&new.get([CONNECTION, 2, 8])), 0, "{model}");
    }
}

/// The file's bit of each connection and the bit that allocates it.
const CONNECTIONS: [(&str, i64, u8); 3] =
    [("PollInfo", 0x0001, 0x02), ("COSInfo", 0x0004, 0x10), ("CyclicInfo", 0x0008, 0x20)];

#[test]
fn connections_go_together_where_the_file_says_so_and_nowhere_else() {
    for (model, eds, _) in every_file() {
        for (entry, _, choice) in CONNECTIONS {
            let together = number(&eds.fields("IO_Info", entry)[0]);
            let mut known = 0;
            for (_, bit, other) in CONNECTIONS {
                let allocated = Bench::on_line(model).allocates(0x01 | choice | other);
                assert_eq!(allocated.is_ok(), together & bit != 0, "{model}: {entry} with {bit}");
                known |= bit;
            }
            assert_eq!(together & !known, 0, "{model}: {entry}");
            for (_, by, _) in inputs(&eds) {
                assert_eq!(by, known, "{model}: all connections carry all inputs");
            }
        }
        let default = eds.number("IO_Info", "Default");
        assert!(CONNECTIONS.iter().any(|(_, bit, _)| *bit == default), "{model}");
    }
}

#[test]
fn connections_that_the_file_leaves_out_are_refused() {
    let eds = Eds::of("amg11-d29");
    let entries = eds.entries("IO_Info").iter();
    assert!(entries.clone().all(|(name, _)| name != "StrobeInfo" && !name.starts_with("Output")));
    for choice in [0x04, 0x08] {
        assert_eq!(Bench::on_line("amg11-d29").allocates(0x01 | choice), Err([0x02, 0x02]));
    }
}
