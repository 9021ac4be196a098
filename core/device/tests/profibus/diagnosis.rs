//! What Slave_Diag says, and when (PROFIBUS manual §7; profibus clause 2).

use codewheel_device::product::PROFIBUS;
use codewheel_device::profibus::diagnosis::Row;

use crate::bench::{Bench, EXAMPLE, FULL_RANGE, STANDARD, hex, octets_of};

/// The number that the row with this key has in a diagnosis.
fn number(key: &str, diagnosis: &[u8]) -> Option<i64> {
    Row::find(key).expect("a row").number_in(diagnosis)
}

/// Decision: 16 and 57 octets are the whole of it; octets 58 and 59 are not sent.
#[test]
fn the_long_diagnosis_is_for_class_2_and_for_everybody_without_good_parameters() {
    let mut bench = Bench::power_up("amg11-p29");
    let lengths = |bench: &mut Bench| {
        let diagnosis = bench.diagnosis();
        (diagnosis.len(), diagnosis[6])
    };
    assert_eq!(lengths(&mut bench), (57, 0x33), "before the first Set_Prm");
    bench.parameterizes("00");
    assert_eq!(lengths(&mut bench), (16, 0x0A));
    bench.configures(0xD1);
    assert_eq!(lengths(&mut bench), (16, 0x0A));
    bench.asks(0x3D, &octets_of(&[STANDARD, "0A"].concat()));
    assert_eq!(lengths(&mut bench), (57, 0x33), "after a refused one");
    bench.parameterizes("00");
    assert_eq!(lengths(&mut bench), (16, 0x0A));
    // Found bad before the encoder was asked.
    bench.asks(0x3D, &octets_of("88 01 C8 0B 00 00 00"));
    assert_eq!(lengths(&mut bench), (57, 0x33));
    bench.parameterizes(EXAMPLE);
    assert_eq!(lengths(&mut bench), (57, 0x33));
}

#[test]
fn the_rows_find_in_the_telegram_what_is_in_force() {
    let mut bench = Bench::power_up("amg11-p29").running("0B 00000E10 000E1000");
    bench.turn_to(8_192);
    bench.position("00000000");
    bench.position("80000001");
    let diagnosis = bench.diagnosis();
    let offset = 1 - (921_600 - 3_600);
    for (key, value) in [
        ("extended-diagnosis-length", 51),
        ("alarms", 0),
        ("operating-status", 0b1011),
        ("encoder-type", 1),
        ("singleturn-resolution", 8_192),
        ("revolutions", 65_535),
        ("supported-alarms", 1),
        ("warnings", 0),
        ("supported-warnings", 0),
        ("profile-version", 0x0110),
        ("software-version", 0x0121),
        ("operating-hours", 0xFFFF_FFFF),
        ("offset", offset),
        ("steps-per-turn", 3_600),
        ("total-resolution", 921_600),
    ] {
        assert_eq!(number(key, &diagnosis), Some(value), "{key}");
    }
    assert_eq!(diagnosis[47..57], [0x2A; 10]);
}

#[test]
fn only_the_amg_81_multiturn_has_a_cell_to_warn_of_in_octet_21() {
    for product in &PROFIBUS {
        let mut bench = Bench::power_up(product.model);
        bench.brings_up("02", 0xD1);
        bench.device.sensor_mut().cell_low = true;
        let (response, _) = bench.exchanges("");
        let diagnosis = bench.diagnosis();
        let has_cell = product.model == "amg81-p29";
        let expected = if has_cell { "00200020" } else { "00000000" };
        assert_eq!(hex(&diagnosis[19..23]), expected, "{}", product.model);
        assert_eq!(response, if has_cell { 0x0A } else { 0x08 }, "{}", product.model);
        assert_eq!(diagnosis[0], if has_cell { 0x08 } else { 0x00 }, "{}", product.model);
    }
}

#[test]
fn a_warning_is_a_diagnosis_to_be_read_that_falsifies_nothing() {
    let mut bench = Bench::power_up("amg81-p29").running(FULL_RANGE);
    bench.turn_to(77);
    assert_eq!(bench.exchanges("00000000"), (0x08, "0000004D".into()));
    bench.device.sensor_mut().cell_low = true;
    assert_eq!(bench.exchanges("00000000"), (0x0A, "0000004D".into()));
    assert_eq!(bench.exchanges("00000000").0, 0x0A, "until it has been read");
    assert_eq!(bench.diagnosis()[..8], octets_of("08 0C 00 02 05 9B 33 00"));
    assert_eq!(bench.exchanges("00000000").0, 0x08);
    bench.device.sensor_mut().cell_low = false;
    assert_eq!(bench.exchanges("00000000").0, 0x0A, "its end is to be read as well");
    assert_eq!(bench.diagnosis()[0], 0x00);
    assert_eq!(bench.exchanges("00000000").0, 0x08);
    let told = bench.told().join("; ");
    assert!(told.contains("voltage too low; lithium cell: voltage right again"), "{told}");
}

/// Decision: the short diagnosis has no octets for warnings, so in class 1 there is nothing to read.
#[test]
fn in_class_1_a_weak_cell_is_no_diagnosis() {
    let mut bench = Bench::power_up("amg81-p29");
    bench.brings_up("00", 0xD1);
    bench.device.sensor_mut().cell_low = true;
    assert_eq!(bench.exchanges("").0, 0x08);
    assert_eq!(bench.diagnosis()[0], 0x00);
    assert!(bench.snapshot().warning);
    bench.brings_up(FULL_RANGE, 0xD1);
    assert_eq!(bench.diagnosis()[0], 0x08);
}
