//! Cyclic production: connection instance 4, allocated with bit 5 (devicenet clause 6; AMG manual
//! §3.3, "1 to 65535 ms").

use codewheel_devicenet::connection::State;
use codewheel_station::{Duration, Instant, Station};

use crate::bench::Bench;

/// An unacknowledged cyclic connection with this expected packet rate, just established.
fn beating(rate_ms: u16) -> Bench {
    let mut bench = Bench::with(0x61);
    let [low, high] = rate_ms.to_le_bytes();
    bench.hears(&format!("42C#0A10050409{low:02X}{high:02X}"));
    bench
}

#[test]
fn the_beat_has_no_drift_at_the_shortest_and_the_longest_rate() {
    for (rate_ms, beats) in [(1, 10_000), (7, 1_000), (65_535, 100)] {
        let mut bench = beating(rate_ms);
        let start = bench.now;
        bench.collect();
        let rate = Duration::from_millis(u64::from(rate_ms));
        let productions = bench.log(rate.times(beats));
        assert_eq!(productions.len() as u64, beats);
        for (beat, (at, frame)) in productions.iter().enumerate() {
            assert_eq!(*at, start + rate.times(beat as u64 + 1), "{rate_ms} ms");
            assert!(frame.starts_with("345#"));
        }
    }
}

#[test]
fn a_busy_wire_delays_productions_and_does_not_shift_the_beat() {
    let mut bench = beating(10);
    bench.collect();
    let start = bench.now;
    let at = |micros| start + Duration::from_micros(micros);
    // Late by less than one beat, then by more than two.
    for (now, frames, next) in [
        (at(13_300), 1, at(20_000)),
        (at(19_999), 0, at(20_000)),
        (at(47_500), 1, at(50_000)),
        (at(50_000), 1, at(60_000)),
        (at(80_000), 1, at(90_000)),
    ] {
        bench.now = now;
        bench.node.advance(now);
        assert_eq!(bench.collect().len(), frames, "at {now}");
        assert_eq!(bench.node.deadline(), Some(next), "after {now}");
    }
}

#[test]
fn a_change_is_not_produced_between_two_beats() {
    let mut bench = beating(100);
    bench.collect();
    bench.node.toy.moved = true;
    assert!(!bench.node.server.watches_changes());
    assert_eq!(bench.wait(Duration::from_millis(99)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_millis(1)), ["345#02000000"]);
}

#[test]
fn a_new_rate_begins_a_new_beat() {
    let mut bench = beating(1_000);
    bench.collect();
    bench.wait(Duration::from_millis(300));
    bench.asks("10 05 04 09 14 00", "90 1400");
    let start = bench.now;
    let times: Vec<Instant> =
        bench.log(Duration::from_millis(60)).into_iter().map(|(at, _)| at).collect();
    assert_eq!(times, [20, 40, 60].map(|millis| start + Duration::from_millis(millis)));
}

#[test]
fn an_acknowledged_cycle_waits_for_each_acknowledge_and_times_out_without() {
    let mut bench = Bench::with(0x21);
    bench.hears("42C#0A100504090A00");
    bench.collect();
    for _ in 0..2_000 {
        bench.says("42A#", &[]);
        assert_eq!(bench.wait(Duration::from_millis(10)).len(), 1);
    }
    bench.says("42A#", &[]);
    // The last production's repeat, and those of the next, until 4 × 10 ms without an acknowledge.
    bench.wait(Duration::from_millis(39));
    assert_eq!(bench.node.server.connection_state(4), Some(State::Established));
    bench.wait(Duration::from_millis(1));
    assert_eq!(bench.node.server.connection_state(4), Some(State::TimedOut));
    assert_eq!(bench.wait(Duration::from_secs(5)), [""; 0]);
}

/// Decision: rate 0 is taken as it is by every other connection, and never elapses.
#[test]
fn a_rate_of_zero_produces_once_and_never_by_time() {
    let mut bench = beating(0);
    assert_eq!(bench.collect().iter().filter(|frame| frame.starts_with("345#")).count(), 1);
    assert_eq!(bench.wait(Duration::from_secs(100_000)), [""; 0]);
    assert_eq!(bench.node.server.connection_state(4), Some(State::Established));
}
