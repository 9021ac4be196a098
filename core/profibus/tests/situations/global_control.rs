//! Sync, Freeze and Clear.

use codewheel_profibus::State;

use crate::bench::{Bench, GOOD_PARAMETERS, RS, SC, telegram};

const CLEAR: u8 = 0x02;
const UNFREEZE: u8 = 0x04;
const FREEZE: u8 = 0x08;
const UNSYNC: u8 = 0x10;
const SYNC: u8 = 0x20;

#[test]
fn in_sync_mode_outputs_wait_for_the_next_sync() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 01", "00 00 12 34", &["00 00 00 01"]);
    bench.global_control(2, SYNC, 0);
    bench.exchanges("00 00 00 02", "00 00 12 34", &[]);
    bench.exchanges("00 00 00 03", "00 00 12 34", &[]);
    bench.asks(2, Some(57), "", &telegram(2, 7, 8, Some((62, 57)), "00 00 00 01"));
    bench.global_control(2, SYNC, 0);
    assert_eq!(bench.toy.told, ["00 00 00 03"]);
    bench.asks(2, Some(57), "", &telegram(2, 7, 8, Some((62, 57)), "00 00 00 03"));
}

#[test]
fn unsync_transfers_at_once_and_ends_sync_mode() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, SYNC, 0);
    bench.exchanges("00 00 00 02", "00 00 12 34", &[]);
    bench.global_control(2, UNSYNC, 0);
    assert_eq!(bench.toy.told, ["00 00 00 02"]);
    assert!(!bench.slave.is_in_sync_mode());
    bench.exchanges("00 00 00 03", "00 00 12 34", &["00 00 00 03"]);
    bench.global_control(2, UNSYNC, 0);
    assert_eq!(bench.toy.told, ["00 00 00 03"], "nothing waits outside Sync mode");
}

#[test]
fn a_sync_before_the_first_outputs_transfers_nothing() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, SYNC, 0);
    bench.global_control(2, SYNC, 0);
    bench.global_control(2, UNSYNC, 0);
    assert_eq!(bench.toy.told, [""; 0]);
}

#[test]
fn freeze_latches_the_inputs_until_the_next_freeze_or_unfreeze() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, FREEZE, 0);
    bench.toy.inputs = [0, 0, 0, 2];
    bench.exchanges("00 00 00 00", "00 00 12 34", &["00 00 00 00"]);
    bench.asks(2, Some(56), "", &telegram(2, 7, 8, Some((62, 56)), "00 00 12 34"));
    bench.global_control(2, FREEZE, 0);
    bench.toy.inputs = [0, 0, 0, 3];
    bench.exchanges("00 00 00 00", "00 00 00 02", &["00 00 00 00"]);
    bench.global_control(2, UNFREEZE, 0);
    bench.exchanges("00 00 00 00", "00 00 00 03", &["00 00 00 00"]);
}

#[test]
fn clear_acts_once_also_on_outputs_that_wait() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 01", "00 00 12 34", &["00 00 00 01"]);
    bench.global_control(2, SYNC, 0);
    bench.exchanges("00 00 00 02", "00 00 12 34", &[]);
    bench.global_control(2, CLEAR, 0);
    assert_eq!(bench.toy.told, ["clear"]);
    assert_eq!(bench.slave.state(), State::DataExchange);
    bench.asks(2, Some(57), "", &telegram(2, 7, 8, Some((62, 57)), "00 00 00 00"));
    bench.global_control(2, UNSYNC, 0);
    assert_eq!(bench.toy.told, ["clear", "00 00 00 00"], "what waited is 0");
    bench.exchanges("00 00 00 03", "00 00 12 34", &["00 00 00 03"]);
}

#[test]
fn in_one_telegram_clear_comes_before_sync_and_unsync() {
    for command in [SYNC, UNSYNC] {
        let mut bench = Bench::exchanging();
        bench.global_control(2, SYNC, 0);
        bench.exchanges("00 00 00 02", "00 00 12 34", &[]);
        bench.global_control(2, CLEAR | command, 0);
        assert_eq!(bench.toy.told, ["clear", "00 00 00 00"], "cleared before it is transferred");
        assert_eq!(bench.slave.is_in_sync_mode(), command == SYNC);
    }
}

/// EN 50170-2: both bits set switch the mode off.
#[test]
fn unsync_and_sync_in_one_telegram_transfer_once_and_end_sync_mode() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, SYNC | UNSYNC, 0);
    assert!(!bench.slave.is_in_sync_mode(), "it does not begin either");
    bench.exchanges("00 00 00 01", "00 00 12 34", &["00 00 00 01"]);
    bench.global_control(2, SYNC, 0);
    bench.exchanges("00 00 00 02", "00 00 12 34", &[]);
    bench.global_control(2, SYNC | UNSYNC, 0);
    assert_eq!(bench.toy.told, ["00 00 00 02"], "what waited is transferred");
    assert!(!bench.slave.is_in_sync_mode());
    bench.exchanges("00 00 00 03", "00 00 12 34", &["00 00 00 03"]);
}

/// EN 50170-2: both bits set switch the mode off.
#[test]
fn unfreeze_and_freeze_in_one_telegram_end_freeze_mode() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, FREEZE | UNFREEZE, 0);
    assert!(!bench.slave.is_in_freeze_mode(), "it does not begin either");
    bench.global_control(2, FREEZE, 0);
    bench.toy.inputs = [0, 0, 0, 9];
    bench.global_control(2, FREEZE | UNFREEZE, 0);
    assert!(!bench.slave.is_in_freeze_mode());
    bench.exchanges("00 00 00 00", "00 00 00 09", &["00 00 00 00"]);
}

#[test]
fn the_end_of_one_mode_and_the_beginning_of_the_other_may_stand_in_one_telegram() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, SYNC, 0);
    bench.global_control(2, UNSYNC | FREEZE, 0);
    assert!(!bench.slave.is_in_sync_mode() && bench.slave.is_in_freeze_mode());
    bench.global_control(2, SYNC | UNFREEZE, 0);
    assert!(bench.slave.is_in_sync_mode() && !bench.slave.is_in_freeze_mode());
}

#[test]
fn only_the_groups_of_the_slave_are_meant_and_group_0_is_everyone() {
    // Group_Ident 3.
    for (groups, meant) in [(0, true), (1, true), (2, true), (3, true), (0xFE, true), (0x84, false)]
    {
        let mut bench = Bench::exchanging();
        bench.global_control(2, SYNC, groups);
        assert_eq!(bench.slave.is_in_sync_mode(), meant, "groups {groups:02X}h");
    }
    let mut bench = Bench::power_up().then_parameterized("B0 00 00 00 05 9B 00");
    bench = bench.then_configured("F1");
    bench.global_control(2, SYNC, 0xFF);
    assert!(!bench.slave.is_in_sync_mode(), "a slave of no group");
    bench.global_control(2, SYNC, 0);
    assert!(bench.slave.is_in_sync_mode());
}

#[test]
fn sync_and_freeze_must_have_been_asked_for() {
    for (status, sync, freeze) in [("80", false, false), ("A0", true, false), ("90", false, true)] {
        let parameters = format!("{status} 00 00 00 05 9B 00");
        let mut bench = Bench::power_up().then_parameterized(&parameters);
        bench = bench.then_configured("F1");
        bench.global_control(2, SYNC | FREEZE, 0);
        assert_eq!(
            (bench.slave.is_in_sync_mode(), bench.slave.is_in_freeze_mode()),
            (sync, freeze)
        );
        bench.exchanges("00 00 00 01", "00 00 12 34", if sync { &[] } else { &["00 00 00 01"] });
    }
}

#[test]
fn it_is_obeyed_from_the_owner_alone_and_in_data_exchange_alone() {
    let mut bench = Bench::exchanging();
    bench.global_control(3, SYNC | CLEAR, 0);
    assert!(!bench.slave.is_in_sync_mode());
    assert_eq!(bench.toy.told, [""; 0]);
    let mut bench = Bench::parameterized();
    bench.global_control(2, SYNC | CLEAR, 0);
    assert_eq!(bench.toy.told, [""; 0]);
    assert!(!bench.then_configured("F1").slave.is_in_sync_mode());
}

#[test]
fn it_may_be_sent_to_the_station_itself_and_at_either_priority() {
    for (destination, code) in [(7, 0x44), (7, 0x46), (127, 0x44), (127, 0x46)] {
        let mut bench = Bench::exchanging();
        bench.says(&telegram(destination, 2, code, Some((58, 62)), "20 00"), "");
        assert!(bench.slave.is_in_sync_mode(), "{destination} {code:02X}");
    }
}

#[test]
fn what_is_no_whole_global_control_is_ignored() {
    for telegram in [
        telegram(127, 2, 0x46, Some((58, 62)), "20"),
        telegram(127, 2, 0x46, Some((58, 62)), "20 00 00"),
        telegram(127, 2, 0x46, Some((57, 62)), "20 00"),
        telegram(127, 2, 0x46, None, "20 00"),
        telegram(8, 2, 0x46, Some((58, 62)), "20 00"),
        telegram(127, 2, 0x7D, Some((58, 62)), "20 00"),
        "68 06 06 68 FF 02 46 3A 20 00 A1 16".into(),
    ] {
        let mut bench = Bench::exchanging();
        bench.says(&telegram, "");
        assert!(!bench.slave.is_in_sync_mode(), "{telegram}");
    }
    let mut bench = Bench::exchanging();
    bench.says(&telegram(7, 2, 0x7D, Some((58, 62)), "20 00"), RS);
    assert!(!bench.slave.is_in_sync_mode(), "as a request for data");
}

#[test]
fn others_read_transferred_outputs_and_frozen_inputs() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 01", "00 00 12 34", &["00 00 00 01"]);
    bench.global_control(2, 0x28, 0);
    bench.toy.inputs = [9; 4];
    bench.exchanges("00 00 00 02", "00 00 12 34", &[]);
    bench.asks(3, Some(57), "", &telegram(3, 7, 8, Some((62, 57)), "00 00 00 01"));
    bench.asks(3, Some(56), "", &telegram(3, 7, 8, Some((62, 56)), "00 00 12 34"));
    // The same configuration again changes nothing, another one thaws.
    bench.asks(2, Some(62), "F1", SC);
    bench.asks(3, Some(56), "", &telegram(3, 7, 8, Some((62, 56)), "00 00 12 34"));
    bench.asks(2, Some(62), "D1", SC);
    bench.asks(3, Some(56), "", &telegram(3, 7, 8, Some((62, 56)), "09 09 09 09"));
}

#[test]
fn after_a_clear_in_sync_mode_a_sync_transfers_zeros() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, 0x20, 0);
    bench.exchanges("80 00 00 02", "00 00 12 34", &[]);
    bench.global_control(2, 0x02, 0);
    bench.toy.told.clear();
    bench.global_control(2, 0x20, 0);
    assert_eq!(bench.toy.told, ["00 00 00 00"]);
    bench.exchanges("", "00 00 12 34", &["clear"]);
    assert!(bench.slave.is_in_sync_mode());
}

#[test]
fn a_second_sync_without_new_outputs_transfers_the_same() {
    let mut bench = Bench::exchanging();
    bench.exchanges("80 00 00 05", "00 00 12 34", &["80 00 00 05"]);
    bench.toy.told.clear();
    bench.global_control(2, 0x20, 0);
    bench.global_control(2, 0x20, 0);
    assert_eq!(bench.toy.told, ["80 00 00 05"]);
}

#[test]
fn good_parameters_end_sync_and_freeze_at_once() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, 0x28, 0);
    let mut bench = bench.then_parameterized(GOOD_PARAMETERS);
    assert_eq!(bench.diagnosis(), "02 0C 00 02 05 9B 02 00");
}
