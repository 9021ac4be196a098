//! The Acknowledge Handler object, class 2B (devicenet clause 5).

use codewheel_station::Duration;

use crate::bench::Bench;

fn reads(bench: &mut Bench, timer: &str, limit: &str) {
    bench.asks("0E 2B 01 01", &format!("8E {timer}"));
    bench.asks("0E 2B 01 02", &format!("8E {limit}"));
}

#[test]
fn it_waits_16_ms_repeats_once_and_serves_instance_4() {
    let mut bench = Bench::allocated();
    reads(&mut bench, "1000", "01");
    bench.asks("0E 2B 01 03", "8E 0400");
    for absent in ["00", "04", "05", "FF"] {
        bench.asks(&format!("0E 2B 01 {absent}"), "94 14 FF");
        bench.asks(&format!("10 2B 01 {absent} 00"), "94 14 FF");
    }
}

#[test]
fn timer_and_limit_can_be_set_and_the_connection_cannot() {
    let mut bench = Bench::allocated();
    bench.asks("10 2B 01 01 01 00", "90 0100");
    bench.asks("10 2B 01 01 FF FF", "90 FFFF");
    bench.asks("10 2B 01 02 FF", "90");
    for (request, refusal) in [
        ("10 2B 01 01 00 00", "09"),
        ("10 2B 01 01", "13"),
        ("10 2B 01 01 10", "13"),
        ("10 2B 01 01 10 00 00", "15"),
        ("10 2B 01 02", "13"),
        ("10 2B 01 02 01 00", "15"),
        ("10 2B 01 03 04 00", "0E"),
        ("10 2B 01 03", "0E"),
        ("10 2B 01", "13"),
        ("0E 2B 01", "13"),
        ("0E 2B 01 01 00", "15"),
    ] {
        bench.asks(request, &format!("94 {refusal} FF"));
    }
    reads(&mut bench, "FFFF", "FF");
    bench.asks("10 2B 01 02 00", "90");
    reads(&mut bench, "FFFF", "00");
}

#[test]
fn there_is_one_instance_and_two_services() {
    let mut bench = Bench::allocated();
    for service in ["01", "05", "0D", "15", "16", "4B"] {
        bench.asks(&format!("{service} 2B 01"), "94 08 FF");
        bench.asks(&format!("{service} 2B 00"), "94 08 FF");
    }
    bench.asks("0E 2B 02 01", "94 16 FF");
    bench.asks("10 2B 02 01 10 00", "94 16 FF");
    bench.asks("0E 2B 00 01", "8E 0100");
    bench.asks("0E 2B 00 02", "8E 0100");
    bench.asks("0E 2B 00 03", "94 14 FF");
    bench.asks("10 2B 00 01 01 00", "94 08 FF");
}

#[test]
fn an_allocation_of_instance_4_from_nothing_brings_the_defaults_back_and_no_other_does() {
    let mut bench = Bench::with(0x01);
    let set = |bench: &mut Bench| {
        bench.asks("10 2B 01 01 F4 01", "90 F401");
        bench.asks("10 2B 01 02 07", "90");
    };
    set(&mut bench);
    bench.asks("4B 03 01 02 0A", "CB 00");
    reads(&mut bench, "F401", "07");
    for choice in ["10", "20", "50", "60"] {
        set(&mut bench);
        bench.asks(&format!("4B 03 01 {choice} 0A"), "CB 00");
        reads(&mut bench, "1000", "01");
        set(&mut bench);
        // Refused, so nothing changes.
        bench.asks(&format!("4B 03 01 {choice} 0A"), "94 0B 02");
        reads(&mut bench, "F401", "07");
        bench.asks(&format!("4C 03 01 {choice}"), "CC");
        reads(&mut bench, "F401", "07");
    }
    // A timed-out connection exists: to allocate it anew is not from nothing.
    bench.asks("4B 03 01 10 0A", "CB 00");
    set(&mut bench);
    bench.hears("42C#0A100504096400");
    bench.collect();
    bench.wait(Duration::from_secs(10));
    bench.asks("0E 05 04 01", "8E 04");
    bench.asks("4B 03 01 10 0A", "CB 00");
    reads(&mut bench, "F401", "07");
}

#[test]
fn the_timer_set_last_counts_for_the_next_production() {
    let mut bench = Bench::with(0x11);
    bench.asks("10 2B 01 01 F4 01", "90 F401");
    bench.hears("42C#0A100504090000");
    bench.collect();
    assert_eq!(bench.wait(Duration::from_nanos(499_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#02000000"]);
}
