//! The way to data exchange, as masters go it.

use codewheel_profibus::{Event, State};

use crate::bench::{Bench, telegram};

#[test]
fn the_bring_up_of_a_real_master_goes_through_octet_for_octet() {
    let mut bench = Bench::power_up();
    bench.says(
        "68 05 05 68 87 82 6C 3C 3E EF 16",
        &telegram(2, 7, 0x08, Some((62, 60)), "02 05 00 FF 05 9B 02 00"),
    );
    bench.says(
        "68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00 A2 16",
        "E5",
    );
    let user = [0x00, 0x0A, 0x00, 0x00, 0x20, 0x00, 0x20, 0x00, 0x00, 0x00];
    assert_eq!(bench.toy.user.as_deref(), Some(&user[..]));
    bench.says("68 06 06 68 87 82 7C 3E 3E F1 F2 16", "E5");
    bench.says(
        "68 05 05 68 87 82 5C 3C 3E DF 16",
        &telegram(2, 7, 0x08, Some((62, 60)), "00 0C 00 02 05 9B 02 00"),
    );
    bench.says("68 07 07 68 07 02 7D 00 00 00 00 86 16", "68 07 07 68 02 07 08 00 00 12 34 57 16");
    let master = 2;
    let expected = [Event::Parameterized { master }, Event::DataExchange { master }];
    assert_eq!(bench.toy.events, expected);
    assert_eq!(bench.slave.master(), Some(2));
}

#[test]
fn a_bring_up_that_begins_with_fdl_status_goes_through_as_well() {
    let mut bench = Bench::power_up();
    bench.says("10 07 02 49 52 16", "10 02 07 00 09 16");
    bench.says(
        &telegram(7, 2, 0x6D, Some((60, 62)), ""),
        &telegram(2, 7, 0x08, Some((62, 60)), "02 05 00 FF 05 9B 02 00"),
    );
    let user = "00 0A 00 00 20 00 20 00 00 00 00 00 00 00 00 00 00 00";
    let parameters = format!("88 03 0A 00 05 9B 01 {user}");
    bench.says(&telegram(7, 2, 0x5D, Some((61, 62)), &parameters), "E5");
    bench.says(&telegram(7, 2, 0x7D, Some((62, 62)), "F1"), "E5");
    bench.says(
        &telegram(7, 2, 0x5D, Some((60, 62)), ""),
        &telegram(2, 7, 0x08, Some((62, 60)), "00 0C 00 02 05 9B 02 00"),
    );
    assert_eq!(bench.slave.state(), State::DataExchange);
}

#[test]
fn fdl_status_is_answered_in_every_state() {
    for mut bench in [Bench::power_up(), Bench::parameterized(), Bench::exchanging()] {
        bench.says("10 07 02 49 52 16", "10 02 07 00 09 16");
    }
}

#[test]
fn get_cfg_is_answered_in_every_state_and_to_anyone() {
    for mut bench in [Bench::power_up(), Bench::parameterized(), Bench::exchanging()] {
        for master in [2, 3] {
            let expected = telegram(master, 7, 0x08, Some((62, 59)), "F1");
            bench.asks(master, Some(59), "", &expected);
        }
    }
}

#[test]
fn low_and_high_priority_are_alike_and_any_ssap_is_swapped() {
    let mut bench = Bench::power_up();
    for (code, ssap) in [(0x6C, 62), (0x6D, 62), (0x6C, 0), (0x6D, 0xFF)] {
        bench.says(
            &telegram(7, 2, code, Some((60, ssap)), ""),
            &telegram(2, 7, 0x08, Some((ssap, 60)), "02 05 00 FF 05 9B 02 00"),
        );
    }
}

#[test]
fn a_request_in_eight_octets_of_sd3_is_read_like_sd2() {
    let mut bench = Bench::power_up();
    // Set_Prm of six octets behind two service access points: too short.
    bench.says("A2 87 82 6D 3D 3E 80 01 01 00 05 9B 13 16", "E5");
    assert!(bench.slave.faults().parameters);
    // RD_Inp, whose six octets of data are not looked at.
    let mut bench = Bench::exchanging();
    bench.says(
        "A2 87 82 6D 38 3E 00 00 00 00 00 00 EC 16",
        &telegram(2, 7, 0x08, Some((62, 56)), "00 00 12 34"),
    );
}
