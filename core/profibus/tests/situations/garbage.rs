//! Broken telegrams, and how the slave finds back.

use codewheel_profibus::{Baud, Timing};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant};

use crate::bench::{Bench, GOOD_PARAMETERS, RS, SC, octets, telegram};

const FDL_STATUS: &str = "10 07 02 49 52 16";
const ANSWER: &str = "10 02 07 00 09 16";

#[test]
fn a_broken_telegram_meets_silence_and_is_counted() {
    for (what, hex) in [
        ("checksum", "10 07 02 49 53 16"),
        ("end delimiter", "10 07 02 49 52 17"),
        ("lengths that differ", "68 05 06 68 87 82 6C 3C 3E EF 16"),
        ("length too short", "68 03 03 68 07 02 49 52 16"),
        ("length too long", "68 FA FA 68 07 02 49 52 16"),
        ("SD2 not repeated", "68 05 05 10 87 82 6C 3C 3E EF 16"),
        ("no start delimiter", "17 10 07 02 49 52 16"),
    ] {
        for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
            bench.says(hex, "");
            assert_eq!(bench.slave.counters().broken, 1, "{what}");
            bench.wait(Duration::from_millis(1));
            bench.says(FDL_STATUS, ANSWER);
        }
    }
}

#[test]
fn a_telegram_inside_a_broken_one_is_not_taken() {
    for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
        bench.says(&format!("68 10 11 68 {FDL_STATUS}"), "");
        assert_eq!(bench.slave.counters().telegrams, 0);
    }
}

#[test]
fn with_bit_times_thirty_three_idle_bits_end_a_broken_telegram() {
    for (pause, answer) in [(32, ""), (33, ANSWER)] {
        let mut bench = Bench::power_up();
        bench.hears("10 07 02 49 53 16");
        bench.hears_after(pause, &octets(FDL_STATUS));
        assert_eq!(bench.answer(), answer, "{pause} bits");
    }
}

#[test]
fn without_them_a_pause_of_a_millisecond_does_or_of_thirty_three_bits_at_the_slowest_rates() {
    for (rate, micros) in [
        (BaudRate::Mbit12, 1_000),
        (BaudRate::Kbit93_75, 1_000),
        (BaudRate::Kbit19_2, 1_719),
        (BaudRate::Kbit9_6, 3_438),
    ] {
        for (pause, answer) in [(micros - 1, ""), (micros, ANSWER)] {
            let mut bench = Bench::new(Baud::Fixed(rate), Timing::Coarse);
            bench.hears("10 07 02 49 53 16");
            bench.wait(Duration::from_micros(pause));
            bench.slave.handle(bench.now, Input::Octets(&octets(FDL_STATUS)), &mut bench.toy);
            assert_eq!(bench.answer(), answer, "{pause} µs at {rate}");
        }
    }
}

#[test]
fn garbage_that_goes_on_keeps_the_slave_deaf() {
    for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
        bench.hears("17");
        for _ in 0..10 {
            bench.hears_after(20, &octets(FDL_STATUS));
            assert_eq!(bench.slave.deadline(), None);
        }
        assert_eq!(bench.slave.counters().broken, 1, "one piece of garbage");
    }
}

#[test]
fn with_bit_times_a_gap_of_one_bit_breaks_a_telegram() {
    for (gap, answer) in [(0, ANSWER), (1, "")] {
        let mut bench = Bench::power_up();
        bench.hears("10 07 02");
        bench.hears_after(gap, &octets("49 52 16"));
        assert_eq!(bench.answer(), answer, "{gap} bits");
        assert_eq!(bench.slave.counters().broken, u32::from(gap > 0));
    }
}

#[test]
fn with_bit_times_a_telegram_that_was_cut_off_does_not_spoil_the_next() {
    let mut bench = Bench::power_up();
    bench.hears("68 05 05 68 87 82");
    bench.says(FDL_STATUS, ANSWER);
    assert_eq!(bench.slave.counters().broken, 1);
}

#[test]
fn without_them_a_telegram_is_waited_for_fifty_milliseconds() {
    for (millis, answer) in [(49, ANSWER), (50, "")] {
        let mut bench = Bench::on_a_pc();
        bench.hears("10 07 02");
        bench.wait(Duration::from_millis(millis));
        bench.slave.handle(bench.now, Input::Octets(&octets("49 52 16")), &mut bench.toy);
        assert_eq!(bench.answer(), answer, "{millis} ms");
    }
    let mut bench = Bench::on_a_pc();
    bench.hears("68 05 05 68 87 82");
    bench.wait(Duration::from_millis(50));
    bench.says(FDL_STATUS, ANSWER);
    assert_eq!(bench.slave.counters().broken, 1, "what was cut off");
}

#[test]
fn with_bit_times_a_request_demands_an_idle_line() {
    for (pause, answer) in [(11, ""), (32, ""), (33, ANSWER), (100, ANSWER)] {
        let mut bench = Bench::power_up();
        bench.hears("DC 02 02");
        bench.hears_after(pause, &octets(FDL_STATUS));
        assert_eq!(bench.answer(), answer, "{pause} bits after a token");
    }
    let mut bench = Bench::on_a_pc();
    bench.hears("DC 02 02");
    bench.hears_after(11, &octets(FDL_STATUS));
    assert_eq!(bench.answer(), ANSWER, "on a PC none is demanded");
}

#[test]
fn with_bit_times_bits_are_counted_to_the_nearest_half() {
    // 32.5 bits at 500 kbit/s.
    for (nanos, answer) in [(64_999, ""), (65_000, ANSWER)] {
        let mut bench = Bench::power_up();
        bench.hears("DC 02 02");
        bench.wait(Duration::from_nanos(nanos));
        bench.hears_after(0, &octets(FDL_STATUS));
        assert_eq!(bench.answer(), answer, "{nanos} ns after a token");
    }
}

#[test]
fn with_bit_times_telegrams_may_come_octet_by_octet() {
    for rate in BaudRate::ALL {
        let mut bench = Bench::new(Baud::Fixed(rate), Timing::Exact);
        bench.hears("DC 02 02");
        for (place, octet) in octets(FDL_STATUS).into_iter().enumerate() {
            bench.hears_after(if place == 0 { 33 } else { 0 }, &[octet]);
        }
        assert_eq!(bench.answer(), ANSWER, "{rate}");
    }
}

#[test]
fn a_broken_character_breaks_the_telegram_it_stands_in() {
    for mut bench in [Bench::power_up(), Bench::on_a_pc()] {
        bench.hears("10 07 02");
        bench.slave.handle(bench.now, Input::BrokenCharacter, &mut bench.toy);
        bench.hears_after(0, &octets("52 16"));
        assert_eq!(bench.answer(), "");
        assert_eq!(bench.slave.counters().broken, 1);
        bench.wait(Duration::from_millis(1));
        bench.says(FDL_STATUS, ANSWER);
    }
}

#[test]
fn on_a_pc_one_broken_octet_does_not_make_the_slave_deaf_on_a_busy_bus() {
    let mut bench = Bench::on_a_pc();
    bench.hears("17");
    let mut answers = 0;
    for _ in 0..10_000 {
        // A master that polls another slave, and then us; 0.4 ms of silence each time.
        bench.hears_after(60, &octets(&telegram(8, 2, 0x49, None, "")));
        bench.hears_after(60, &octets(&telegram(2, 8, 0x00, None, "")));
        bench.hears_after(60, &octets(FDL_STATUS));
        let sent = bench.sends(bench.slave.baud_rate().bits(200));
        answers += sent.len();
    }
    assert!(
        answers > 0,
        "deaf for {} s",
        bench.now.since(Instant::from_nanos(1_000_000_000)).as_millis() / 1000
    );
}

#[test]
fn with_bit_times_a_master_clock_that_is_a_little_slow_does_not_break_long_pieces() {
    let mut bench = Bench::new(Baud::Fixed(BaudRate::Mbit1_5), Timing::Exact);
    let request = octets(&telegram(7, 2, 0x6C, Some((55, 62)), &"00 ".repeat(200)));
    bench.hears_after(40, &request[..10]);
    let rest = &request[10..];
    let nanos = bench.slave.baud_rate().characters(rest.len() as u32).as_nanos();
    bench.wait(Duration::from_nanos(nanos + nanos * 3 / 1000));
    bench.slave.handle(bench.now, Input::Octets(rest), &mut bench.toy);
    assert_eq!(bench.answer(), RS);
}

#[test]
fn with_bit_times_a_master_clock_that_is_a_little_fast_still_leaves_an_idle_line() {
    let mut bench = Bench::power_up();
    bench.hears("DC 02 02");
    let request =
        octets(&bench.request(2, Some(61), &format!("{GOOD_PARAMETERS} {}", "00 ".repeat(17))));
    let bits = 33 + request.len() as u32 * 11;
    let nanos = bench.slave.baud_rate().bits(bits).as_nanos();
    bench.wait(Duration::from_nanos(nanos - nanos * 3 / 1000));
    bench.slave.handle(bench.now, Input::Octets(&request), &mut bench.toy);
    assert_eq!(bench.answer(), SC);
}
