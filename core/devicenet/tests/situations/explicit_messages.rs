//! Requests, refusals and silence (devicenet clause 4).

use crate::bench::Bench;

#[test]
fn a_get_and_a_set_with_xid_and_mac_echoed() {
    let mut bench = Bench::allocated();
    bench.says("42C#4A1064010134 12", &["42B#4A90"]);
    bench.says("42C#0A0E640101", &["42B#0A8E3412"]);
    assert_eq!(bench.node.toy.value, 0x1234);
}

#[test]
fn unknown_classes_and_instances_do_not_exist() {
    let mut bench = Bench::allocated();
    for path in ["65 01", "00 01", "FF 01", "01 02", "02 02", "03 02", "04 03", "64 02", "06 00"] {
        bench.asks(&format!("0E {path} 01"), "94 16 FF");
    }
}

#[test]
fn unknown_services_are_not_supported() {
    let mut bench = Bench::allocated();
    for path in ["01 01", "02 01", "03 01", "04 01", "05 01", "64 01", "01 00", "05 00"] {
        for service in ["00", "02", "1C", "32", "7F"] {
            bench.asks(&format!("{service} {path}"), "94 08 FF");
        }
    }
}

#[test]
fn a_get_without_attribute_is_short_and_one_with_data_is_long() {
    let mut bench = Bench::allocated();
    bench.asks("0E 01 01", "94 13 FF");
    bench.asks("0E 64 01", "94 13 FF");
    bench.asks("10 64 01", "94 13 FF");
    bench.asks("0E 01 01 01 00", "94 15 FF");
    bench.asks("0E 64 01 01 00", "94 15 FF");
}

#[test]
fn a_service_without_class_and_instance_is_short() {
    let mut bench = Bench::allocated();
    bench.asks("0E", "94 13 FF");
    bench.asks("0E 01", "94 13 FF");
}

#[test]
fn empty_frames_lone_headers_and_responses_are_met_with_silence() {
    let mut bench = Bench::allocated();
    for message in ["42C#", "42C#0A", "42C#0A8E0101", "42C#0AFF010101", "42C#8A", "42C#8A00"] {
        bench.says(message, &[]);
    }
}

#[test]
fn class_attributes_tell_revision_and_highest_instance() {
    let mut bench = Bench::allocated();
    for (class, revision, instances) in [
        ("01", "0100", "0100"),
        ("02", "0100", "0100"),
        ("03", "0200", "0100"),
        ("04", "0200", "0200"),
        ("64", "0300", "0100"),
    ] {
        bench.asks(&format!("0E {class} 00 01"), &format!("8E {revision}"));
        bench.asks(&format!("0E {class} 00 02"), &format!("8E {instances}"));
        bench.asks(&format!("0E {class} 00 03"), "94 14 FF");
        bench.asks(&format!("10 {class} 00 01 01 00"), "94 08 FF");
    }
}
