//! The six octets of Slave_Diag that the standard defines.

use crate::bench::{Bench, SC};

#[test]
fn the_station_status_says_how_far_the_slave_is() {
    assert_eq!(Bench::power_up().diagnosis(), "02 05 00 FF 05 9B 02 00");
    assert_eq!(Bench::parameterized().diagnosis(), "02 0C 00 02 05 9B 02 00");
    assert_eq!(Bench::exchanging().diagnosis(), "00 0C 00 02 05 9B 02 00");
    let without_watchdog = Bench::power_up().then_parameterized("B0 00 00 0B 05 9B 00 00");
    assert_eq!(without_watchdog.then_configured("F1").diagnosis(), "00 04 00 02 05 9B 02 00");
}

#[test]
fn sync_and_freeze_mode_show_while_they_last() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, 0x20, 0);
    assert_eq!(bench.diagnosis(), "00 2C 00 02 05 9B 02 00");
    bench.global_control(2, 0x08, 0);
    assert_eq!(bench.diagnosis(), "00 3C 00 02 05 9B 02 00");
    bench.global_control(2, 0x14, 0);
    assert_eq!(bench.diagnosis(), "00 0C 00 02 05 9B 02 00");
}

#[test]
fn what_the_device_adds_shows_in_every_state_and_sets_ext_diag() {
    for (mut bench, status) in [
        (Bench::power_up(), "0A 05 00 FF"),
        (Bench::parameterized(), "0A 0C 00 02"),
        (Bench::exchanging(), "08 0C 00 02"),
    ] {
        bench.toy.set_alarm(1);
        assert_eq!(bench.diagnosis(), format!("{status} 05 9B 02 01"));
    }
}

#[test]
fn faults_of_the_parameters_show_until_the_next_set_prm() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(61), "80 00 00 00 12 34 00", SC);
    assert_eq!(bench.diagnosis(), "42 05 00 FF 05 9B 02 00");
    bench.asks(2, Some(61), "80 00 00 00 05 9B 00 80", SC);
    assert_eq!(bench.diagnosis(), "52 05 00 FF 05 9B 02 00", "Not_Supported as well");
    let mut bench = bench.then_parameterized("80 00 00 00 05 9B 00");
    assert_eq!(bench.diagnosis(), "02 04 00 02 05 9B 02 00");
}

#[test]
fn the_octets_are_those_of_the_moment_the_answer_leaves() {
    let mut bench = Bench::exchanging();
    let request = bench.request(2, Some(60), "");
    bench.hears(&request);
    bench.toy.set_alarm(1);
    assert!(bench.answer().contains("08 0C 00 02 05 9B 02 01"));
}
