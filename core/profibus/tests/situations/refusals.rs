//! What is refused, and what is met with silence.

use codewheel_profibus::{Baud, Settings, Slave, Timing};
use codewheel_station::Instant;
use codewheel_station::rs485::{BaudRate, Input};

use crate::bench::{Bench, RS, Toy, octets, telegram};

#[test]
fn services_the_slave_has_not_are_refused_in_every_state() {
    for mut bench in [Bench::power_up(), Bench::parameterized(), Bench::exchanging()] {
        let state = bench.slave.state();
        for (what, request) in [
            ("Set_Slave_Add", telegram(7, 2, 0x6D, Some((55, 62)), "09 05 9B 00")),
            ("Global_Control for data", telegram(7, 2, 0x6D, Some((58, 62)), "00 00")),
            ("MS1", telegram(7, 2, 0x6D, Some((51, 51)), "5E 00 00 04")),
            ("SAP 0", telegram(7, 2, 0x6D, Some((0, 62)), "")),
            ("SAP 63", telegram(7, 2, 0x6C, Some((63, 62)), "")),
            ("a second extension octet", telegram(7, 2, 0x6C, Some((0xBC, 62)), "")),
            ("SDA", telegram(7, 2, 0x63, None, "00")),
            ("SDA high", telegram(7, 2, 0x65, Some((61, 62)), "80 00 00 00 05 9B 00")),
            ("ident", telegram(7, 2, 0x4E, None, "")),
            ("LSAP status", telegram(7, 2, 0x4F, None, "")),
            ("only DA extended", "68 05 05 68 87 02 6C 3C 3E 6F 16".into()),
            ("only SA extended", "68 05 05 68 07 82 6C 3C 3E 6F 16".into()),
            ("one extension octet for two", "68 04 04 68 87 82 6C 3C B1 16".into()),
            ("no extension octet at all", "10 87 82 6C 75 16".into()),
        ] {
            bench.hears(&request);
            assert_eq!((what, bench.answer()), (what, RS.to_owned()));
            assert_eq!(bench.slave.state(), state, "{what}");
        }
    }
}

#[test]
fn what_is_not_for_the_slave_to_answer_meets_silence() {
    for mut bench in [Bench::power_up(), Bench::parameterized(), Bench::exchanging()] {
        for (what, request) in [
            ("a request for data to everyone", telegram(127, 2, 0x6D, Some((60, 62)), "")),
            ("FDL status to everyone", telegram(127, 2, 0x49, None, "")),
            ("another station", telegram(8, 2, 0x6D, Some((60, 62)), "")),
            ("from station 126", telegram(7, 126, 0x6D, Some((60, 62)), "")),
            ("from station 127", telegram(7, 127, 0x6D, Some((60, 62)), "")),
            ("FC with bit 7", telegram(7, 2, 0xED, Some((60, 62)), "")),
            ("an answer", telegram(7, 2, 0x08, Some((60, 62)), "")),
            ("a reserved code", telegram(7, 2, 0x67, Some((60, 62)), "")),
            ("SDN", telegram(7, 2, 0x44, Some((60, 62)), "")),
            ("a token", "DC 07 02".into()),
            ("a short acknowledge", "E5".into()),
        ] {
            bench.hears(&request);
            assert_eq!((what, bench.answer()), (what, String::new()));
        }
    }
}

#[test]
fn a_stranger_is_refused_data_exchange_and_nothing_changes() {
    let mut bench = Bench::exchanging();
    bench.asks(3, None, "80 00 00 05", "10 03 07 03 0D 16");
    bench.asks(3, None, "80", "10 03 07 03 0D 16");
    assert_eq!(bench.toy.told, [""; 0]);
    bench.exchanges("00 00 00 00", "00 00 12 34", &["00 00 00 00"]);
}

#[test]
fn any_address_answers_masters_at_0_to_125_but_its_own() {
    for address in [0, 1, 99, 125] {
        for master in 0..=127_u8 {
            let baud = Baud::Fixed(BaudRate::Kbit500);
            let mut slave = Slave::<4>::new(Settings {
                address,
                ident_number: 0x059B,
                baud,
                timing: Timing::Exact,
            });
            let mut toy = Toy::default();
            let now = Instant::from_nanos(1_000_000_000);
            slave.handle(
                now,
                Input::Octets(&octets(&telegram(address, master, 0x6D, Some((60, 62)), ""))),
                &mut toy,
            );
            let later = now + BaudRate::Kbit500.bits(11);
            let answer = slave.transmit(later, &mut toy);
            assert_eq!(answer.is_some(), master <= 125 && master != address, "{address} {master}");
        }
    }
}

#[test]
fn an_ssap_with_bit_7_is_swapped() {
    let mut bench = Bench::power_up();
    let answer = telegram(2, 7, 8, Some((0xFE, 59)), "F1");
    bench.says(&telegram(7, 2, 0x6D, Some((59, 0xFE)), ""), &answer);
}
