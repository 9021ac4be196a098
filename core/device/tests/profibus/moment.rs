//! What leaves is of the moment it leaves, also where nobody called `advance` before.

use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, EXAMPLE, FULL_RANGE, Hand, hex, octets_of};

const EXCHANGE: &str = "68 07 07 68 07 02 6D 00 00 00 00 76 16";

/// What leaves when nobody called `advance` in between: the bench of the other tests always does.
fn answers_without_advance(
    bench: &mut Bench,
    request: &str,
    deed: impl FnOnce(&mut Hand),
) -> String {
    bench.wait(Duration::from_millis(10));
    bench.device.handle(bench.now, Input::Octets(&octets_of(request)));
    deed(bench.device.sensor_mut());
    let due = bench.now + BaudRate::Mbit1_5.bits(11);
    let answer = bench.device.transmit(due).expect("an answer");
    hex(answer.octets())
}

#[test]
fn a_warning_that_nobody_looked_for_is_in_the_diagnosis() {
    let mut bench = Bench::power_up("amg81-p29").running(FULL_RANGE);
    bench.wait(Duration::from_millis(10));
    bench.device.sensor_mut().cell_low = true;
    // Not looked at before the telegram ends.
    let answer =
        bench.hears_now(&octets_of("68 05 05 68 87 82 6C 3C 3E EF 16")).expect("Slave_Diag");
    assert_eq!(&answer[18..20], "08");
    assert_eq!(&answer[58..60], "20");
}

#[test]
fn the_position_is_that_of_the_moment_the_answer_leaves() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    let answer = answers_without_advance(&mut bench, EXCHANGE, |hand| hand.code = 1_234);
    assert_eq!(answer[14..22], *"000004D2");
}

#[test]
fn the_diagnosis_is_that_of_the_moment_the_answer_leaves() {
    let mut bench = Bench::power_up("amg81-p29").running(FULL_RANGE);
    let request = "68 05 05 68 87 82 6D 3C 3E F0 16";
    let answer = answers_without_advance(&mut bench, request, |hand| hand.cell_low = true);
    assert_eq!((&answer[18..20], &answer[58..60]), ("08", "20"));
}

#[test]
fn a_refused_preset_calls_for_the_diagnosis_in_that_very_answer() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.position("00000000");
    let request = "68 07 07 68 07 02 6D FF FF FF FF 72 16";
    let answer = answers_without_advance(&mut bench, request, |_| {});
    assert_eq!(&answer[12..14], "0A");
}

#[test]
fn class_1_ends_the_alarm_in_the_diagnosis_at_once() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.position("00000000");
    bench.exchanges("FFFFFFFF");
    let request = "68 0E 0E 68 87 82 6D 3D 3E B8 01 C8 0B 05 9B 00 00 00";
    let sum = octets_of(request)[4..].iter().fold(0_u8, |sum, octet| sum.wrapping_add(*octet));
    let request = format!("{request} {sum:02X} 16");
    assert_eq!(answers_without_advance(&mut bench, &request, |_| {}), "E5");
    assert!(!bench.snapshot().alarm);
    assert_eq!(bench.diagnosis()[0], 0x02);
}
