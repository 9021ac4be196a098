//! Chk_Cfg: which configurations lead where.

use codewheel_profibus::{Event, Loss, State};
use codewheel_station::Duration;

use crate::bench::{Bench, RS, SC, telegram};

#[test]
fn without_parameters_a_configuration_is_refused() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(62), "F1", RS);
    assert_eq!(bench.slave.state(), State::WaitPrm);
}

#[test]
fn a_bad_configuration_is_a_fault_that_stays_until_the_next_parameters() {
    for (mut bench, identifiers) in
        [(Bench::parameterized(), "F2"), (Bench::exchanging(), "F1 F1"), (Bench::exchanging(), "")]
    {
        bench.asks(2, Some(62), identifiers, SC);
        assert_eq!(bench.slave.state(), State::WaitPrm);
        assert_eq!(bench.toy.events.last(), Some(&Event::Lost(Loss::Configuration)));
        assert_eq!(bench.diagnosis(), "06 05 00 FF 05 9B 02 00");
        bench.asks(2, Some(62), "F1", RS);
        bench = bench.then_exchanging();
        assert_eq!(bench.diagnosis(), "00 0C 00 02 05 9B 02 00");
    }
}

#[test]
fn a_configuration_that_the_slave_has_no_room_for_is_a_fault() {
    let mut bench = Bench::parameterized();
    bench.asks(2, Some(62), "F7", SC);
    assert!(bench.slave.faults().configuration);
}

#[test]
fn the_same_configuration_again_changes_nothing() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    bench.global_control(2, 0x20, 0);
    bench.toy.told.clear();
    bench.asks(2, Some(62), "F1", SC);
    assert_eq!(bench.toy.told, [""; 0], "data exchange goes on");
    assert!(bench.slave.is_in_sync_mode());
    bench.asks(2, Some(57), "", &telegram(2, 7, 0x08, Some((62, 57)), "00 00 00 05"));
}

#[test]
fn another_good_configuration_is_taken_with_outputs_0_and_sync_and_freeze_off() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    bench.global_control(2, 0x28, 0);
    assert!(bench.slave.is_in_sync_mode() && bench.slave.is_in_freeze_mode());
    bench.toy.told.clear();
    bench.asks(2, Some(62), "F0", SC);
    assert_eq!(bench.slave.state(), State::DataExchange);
    assert_eq!(bench.toy.told, ["begin"]);
    assert!(!bench.slave.is_in_sync_mode() && !bench.slave.is_in_freeze_mode());
    bench.asks(2, Some(57), "", &telegram(2, 7, 0x08, Some((62, 57)), "00 00"));
    bench.exchanges("80 01", "12 34", &["80 01"]);
    bench.asks(2, Some(59), "", &telegram(2, 7, 0x08, Some((62, 59)), "F0"));
}

#[test]
fn after_refused_parameters_their_master_gets_its_configuration_acknowledged_unlooked_at() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(61), "80 00 00 00 12 34 00", SC);
    for identifiers in ["F1", "F2 F2"] {
        bench.asks(2, Some(62), identifiers, SC);
        assert_eq!(bench.slave.state(), State::WaitPrm);
    }
    bench.asks(3, Some(62), "F1", "10 03 07 03 0D 16");
    assert_eq!(bench.diagnosis(), "42 05 00 FF 05 9B 02 00");
    // Up to the next Set_Prm, of whomever.
    bench.asks(3, Some(61), "C0 00 00 00 12 34 00", SC);
    bench.asks(2, Some(62), "F1", RS);
}

#[test]
fn an_old_refusal_does_not_outlive_good_parameters() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(61), "80 00 00 00 12 34 00", SC);
    let mut bench = bench.then_exchanging();
    bench.wait(Duration::from_millis(200));
    bench.asks(2, Some(62), "F1", RS);
}

#[test]
fn cfg_fault_does_not_outlive_a_refused_set_prm() {
    let mut bench = Bench::parameterized();
    bench.asks(2, Some(62), "F2", SC);
    bench.asks(2, Some(61), "80 00 00 00 12 34 00", SC);
    assert_eq!(bench.diagnosis(), "42 05 00 FF 05 9B 02 00");
}
