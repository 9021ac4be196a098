//! Get_Attributes_All of the Identity object, and the Device Heartbeat Message (devicenet clause 5).

use codewheel_devicenet::NetworkSettings;
use codewheel_station::{Duration, Instant};

use crate::bench::Bench;

/// MAC 05, CD, instance 0001, state 3 operational, no flags, consistency value 0000.
const HEARTBEAT: &str = "42B#05CD010003000000";

#[test]
fn all_attributes_of_the_identity_come_in_their_order() {
    let mut bench = Bench::allocated();
    let all = "3412 0000 0B00 0102 0100 0DF0FECA 03546F79 03 0000 00";
    bench.asks("01 01 01", &format!("81 {all}"));
    bench.asks("01 01 01 00", "94 15 FF");
    bench.asks("01 01 02", "94 16 FF");
    bench.asks("01 01 00", "94 08 FF");
    for path in ["02 01", "03 01", "04 01", "05 01"] {
        bench.asks(&format!("01 {path}"), "94 08 FF");
    }
}

#[test]
fn the_interval_is_one_octet_zero_by_default_and_kept_at_once() {
    let mut bench = Bench::allocated();
    bench.asks("0E 01 01 0A", "8E 00");
    bench.asks("10 01 01 0A", "94 13 FF");
    bench.asks("10 01 01 0A 01 00", "94 15 FF");
    assert_eq!(bench.node.toy.kept, None);
    bench.asks("10 01 01 0A FF", "90");
    bench.asks("0E 01 01 0A", "8E FF");
    let settings = NetworkSettings { heartbeat_interval: 255, ..NetworkSettings::default() };
    assert_eq!(bench.node.toy.kept, Some(settings));
}

#[test]
fn a_heartbeat_comes_every_interval_with_and_without_a_connection() {
    let mut bench = Bench::allocated();
    assert_eq!(bench.wait(Duration::from_secs(5)), [""; 0]);
    bench.asks("10 01 01 0A 03", "90");
    let start = bench.now;
    let beats = bench.log(Duration::from_secs(30));
    assert_eq!(bench.node.server.master(), None, "the connection has ended meanwhile");
    let expected: Vec<(Instant, String)> = (1..=10)
        .map(|beat| (start + Duration::from_secs(3 * beat), HEARTBEAT.to_owned()))
        .collect();
    assert_eq!(beats, expected);
}

#[test]
fn a_new_interval_counts_from_then_and_zero_ends_it() {
    let mut bench = Bench::with(0x01);
    bench.asks("10 01 01 0A 0A", "90");
    bench.wait(Duration::from_secs(9));
    bench.asks("10 01 01 0A 02", "90");
    assert_eq!(bench.wait(Duration::from_nanos(1_999_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), [HEARTBEAT]);
    bench.asks("10 01 01 0A 00", "90");
    assert_eq!(bench.wait(Duration::from_secs(1_000)), [""; 0]);
}

#[test]
fn a_kept_interval_beats_from_the_moment_the_node_is_on_line() {
    let mut bench = Bench::power_up();
    let settings = NetworkSettings { heartbeat_interval: 1, ..NetworkSettings::default() };
    bench.node.server = codewheel_devicenet::Server::new(
        bench.node.server.mac(),
        bench.node.server.bit_rate(),
        settings,
    );
    bench.collect();
    let frames = bench.log(Duration::from_secs(4));
    let second = |seconds| Instant::ZERO + Duration::from_secs(seconds);
    let times: Vec<Instant> = frames.iter().map(|(at, _)| *at).collect();
    assert_eq!(times, [second(1), second(3), second(4)]);
    assert_eq!(frames[1].1, HEARTBEAT);
}

#[test]
fn a_heartbeat_goes_after_an_answer() {
    let mut bench = Bench::with(0x01);
    bench.asks("10 01 01 0A 01", "90");
    bench.now += Duration::from_secs(1);
    bench.hears("42C#0A0E010103");
    assert_eq!(bench.collect(), ["42B#0A8E0B00", HEARTBEAT]);
}
