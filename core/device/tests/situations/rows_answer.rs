//! The rows and the running device say the same (design: one source of truth).

use codewheel_device::devicenet::rows::{ROWS, Source};

use crate::bench::Bench;

#[test]
fn every_row_is_answered_with_the_octets_of_its_type() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    for row in &ROWS {
        let answer = bench.ask(&format!("0E 2F 01 {:02X}", row.attribute)).expect("an answer");
        assert!(answer.starts_with("8E"), "{}: {answer}", row.name);
        if row.data_type.octets() != 0 {
            assert_eq!(answer.len() / 2 - 1, row.data_type.octets(), "{}", row.name);
        }
    }
    bench.asks("0E 2F 01 01", "8E 18");
    bench.asks("0E 2F 01 02", "8E 0102030405060708090A0B0C 50515253545556575859 5B 5F");
}

#[test]
fn every_parameter_takes_its_limits_and_refuses_what_lies_beyond() {
    let mut bench = Bench::power_up("amg81-d29").allocated();
    for row in ROWS.iter().filter(|row| row.source == Source::Parameter) {
        let limits = |bench: &Bench| {
            let view = codewheel_device::devicenet::rows::View {
                product: bench.device.product(),
                encoder: bench.device.encoder(),
            };
            row.range.expect("a parameter has a range")(view)
        };
        let octets = row.data_type.octets();
        let write = |bench: &mut Bench, value: i64| {
            let bytes = crate::bench::hex(&value.to_le_bytes()[..octets]);
            bench.ask(&format!("10 2F 01 {:02X} {bytes}", row.attribute)).expect("an answer")
        };
        let range = limits(&bench);
        assert_eq!(write(&mut bench, range.maximum), "90", "{} maximum", row.name);
        let range = limits(&bench);
        assert_eq!(write(&mut bench, range.maximum + 1), "9409FF", "{} above", row.name);
        assert_eq!(write(&mut bench, range.minimum), "90", "{} minimum", row.name);
        let range = limits(&bench);
        assert_eq!(write(&mut bench, range.minimum - 1), "9409FF", "{} below", row.name);
        bench.asks("05 2F 01", "85");
    }
}
