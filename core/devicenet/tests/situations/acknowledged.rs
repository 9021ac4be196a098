//! Acknowledged change of state: acknowledges, repeats, time-outs (devicenet clauses 5 and 6).

use codewheel_devicenet::connection::State;
use codewheel_devicenet::{Event, NetworkStatus};
use codewheel_station::{Duration, Station};

use crate::bench::Bench;

fn state(bench: &Bench) -> Option<State> {
    bench.node.server.connection_state(4)
}

/// An acknowledged change of state connection with this expected packet rate, its first production
/// out and acknowledged.
fn acknowledged(rate: &str) -> Bench {
    let mut bench = Bench::with(0x11);
    bench.hears(&format!("42C#0A10050409{rate}"));
    assert_eq!(bench.collect().len(), 2);
    bench.says("42A#", &[]);
    bench
}

fn move_now(bench: &mut Bench) {
    bench.node.toy.moved = true;
    bench.node.advance(bench.now);
}

#[test]
fn only_an_empty_frame_acknowledges() {
    let mut bench = acknowledged("0000");
    move_now(&mut bench);
    assert_eq!(bench.collect(), ["345#02000000"]);
    // With data, to another message, of another MAC ID.
    for other in ["42A#00", "42A#0000000000", "429#", "42B#", "432#"] {
        bench.says(other, &[]);
    }
    assert_eq!(bench.wait(Duration::from_millis(16)), ["345#03000000"], "so it is repeated");
    bench.says("42A#", &[]);
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
}

#[test]
fn a_frame_with_data_in_place_of_an_acknowledge_keeps_nothing_alive() {
    let mut bench = acknowledged("6400");
    for _ in 0..3 {
        bench.wait(Duration::from_millis(100));
        bench.says("42A#01", &[]);
    }
    bench.wait(Duration::from_nanos(99_999_999));
    assert_eq!(state(&bench), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(state(&bench), Some(State::TimedOut));
}

#[test]
fn what_is_not_acknowledged_is_repeated_with_the_newest_data_and_then_given_up() {
    let mut bench = acknowledged("0000");
    bench.asks("10 2B 01 01 0A 00", "90 0A00");
    bench.asks("10 2B 01 02 03", "90");
    move_now(&mut bench);
    let start = bench.now;
    assert_eq!(bench.collect(), ["345#02000000"]);
    let repeats = bench.log(Duration::from_secs(1));
    let expected = [(10, 3), (20, 4), (30, 5)];
    let expected = expected.map(|(after, count)| {
        (start + Duration::from_millis(after), format!("345#0{count}000000"))
    });
    assert_eq!(repeats, expected, "three repeats 10 ms apart, each as fresh as it can be");
    // The next change begins anew.
    move_now(&mut bench);
    assert_eq!(bench.collect(), ["345#06000000"]);
    assert_eq!(bench.wait(Duration::from_secs(1)).len(), 3);
}

#[test]
fn without_retries_a_production_is_given_up_after_the_acknowledge_time() {
    let mut bench = acknowledged("0000");
    bench.asks("10 2B 01 02 00", "90");
    move_now(&mut bench);
    bench.collect();
    move_now(&mut bench);
    assert_eq!(bench.wait(Duration::from_nanos(15_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#03000000"], "the next change");
}

#[test]
fn the_acknowledge_time_counts_from_when_the_frame_is_on_the_wire() {
    let mut bench = acknowledged("0000");
    move_now(&mut bench);
    let frame = bench.hands_out().expect("a production");
    assert_eq!(bench.wait(Duration::from_millis(200)), [""; 0], "the wire is busy");
    bench.is_sent(&frame);
    assert_eq!(bench.wait(Duration::from_nanos(15_999_999)), [""; 0]);
    assert_eq!(bench.wait(Duration::from_nanos(1)), ["345#03000000"]);
}

#[test]
fn an_acknowledge_that_comes_before_the_report_of_the_sent_frame_counts() {
    let mut bench = acknowledged("0000");
    move_now(&mut bench);
    let frame = bench.hands_out().expect("a production");
    bench.says("42A#", &[]);
    bench.is_sent(&frame);
    assert_eq!(bench.wait(Duration::from_secs(1)), [""; 0]);
}

#[test]
fn an_acknowledge_that_overtakes_the_repeat_takes_it_back() {
    let mut bench = acknowledged("0000");
    move_now(&mut bench);
    bench.collect();
    bench.now += Duration::from_millis(16);
    bench.node.advance(bench.now);
    bench.says("42A#", &[]);
    assert_eq!(bench.wait(Duration::from_secs(1)), [""; 0]);
}

#[test]
fn repeats_ignore_the_inhibit_time_and_changes_do_not() {
    let mut bench = Bench::with(0x11);
    bench.asks("10 05 04 11 E8 03", "90 E803");
    bench.hears("42C#0A100504090000");
    bench.collect();
    let start = bench.now;
    let repeats = bench.log(Duration::from_millis(20));
    assert_eq!(repeats, [(start + Duration::from_millis(16), "345#02000000".to_owned())]);
    bench.says("42A#", &[]);
    move_now(&mut bench);
    let next = bench.log(Duration::from_secs(2));
    let after_the_last = start + Duration::from_millis(1_016);
    assert_eq!(next[0], (after_the_last, "345#03000000".to_owned()));
}

#[test]
fn a_change_during_the_wait_is_produced_with_the_acknowledge() {
    let mut bench = acknowledged("0000");
    move_now(&mut bench);
    assert_eq!(bench.collect(), ["345#02000000"]);
    bench.node.toy.moved = true;
    assert_eq!(bench.wait(Duration::from_millis(5)), [""; 0]);
    bench.says("42A#", &["345#03000000"]);
    bench.says("42A#", &[]);
    assert_eq!(bench.wait(Duration::from_secs(1)), [""; 0]);
}

#[test]
fn the_first_interval_without_an_acknowledge_is_ten_seconds_or_four_rates() {
    for (rate, millis) in [("6400", 10_000), ("C409", 10_000), ("8813", 20_000), ("FFFF", 262_140)]
    {
        let mut bench = Bench::with(0x11);
        bench.hears(&format!("42C#0A10050409{rate}"));
        bench.collect();
        bench.wait(Duration::from_nanos(millis * 1_000_000 - 1));
        assert_eq!(state(&bench), Some(State::Established), "{rate}");
        bench.wait(Duration::from_nanos(1));
        assert_eq!(state(&bench), Some(State::TimedOut), "{rate}");
        assert_eq!(bench.node.server.status(), NetworkStatus::TimedOut);
        assert!(bench.node.toy.events.contains(&Event::TimedOut { instance: 4 }));
    }
}

#[test]
fn each_acknowledge_gives_four_rates_and_rate_zero_for_ever() {
    let mut bench = acknowledged("6400");
    bench.wait(Duration::from_nanos(399_999_999));
    bench.says("42A#", &[]);
    bench.wait(Duration::from_nanos(399_999_999));
    assert_eq!(state(&bench), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(state(&bench), Some(State::TimedOut));
    let mut endless = acknowledged("0000");
    move_now(&mut endless);
    endless.wait(Duration::from_secs(100_000));
    assert_eq!(state(&endless), Some(State::Established));
}

#[test]
fn a_later_rate_gives_four_of_it() {
    let mut bench = acknowledged("E803");
    bench.wait(Duration::from_millis(500));
    bench.asks("10 05 04 09 64 00", "90 6400");
    bench.wait(Duration::from_nanos(399_999_999));
    assert_eq!(state(&bench), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(state(&bench), Some(State::TimedOut));
}

#[test]
fn a_timed_out_connection_produces_and_consumes_nothing() {
    let mut bench = acknowledged("6400");
    bench.wait(Duration::from_millis(400));
    assert_eq!(state(&bench), Some(State::TimedOut));
    move_now(&mut bench);
    bench.says("42A#", &[]);
    assert_eq!(bench.wait(Duration::from_secs(30)), [""; 0]);
    bench.asks("10 05 04 0E 20 04 24 02", "94 0C FF");
    bench.asks("10 05 04 11 00 00", "94 0C FF");
    bench.asks("0D 05 04", "94 0C FF");
    // The rate is always writable, and revives nothing.
    bench.asks("10 05 04 09 C8 00", "90 C800");
    assert_eq!(bench.wait(Duration::from_secs(30)), [""; 0]);
    assert_eq!(state(&bench), Some(State::TimedOut));
}

#[test]
fn a_reset_of_a_timed_out_connection_produces_at_once_and_gives_four_rates() {
    let mut bench = acknowledged("6400");
    bench.wait(Duration::from_millis(400));
    let count = bench.node.toy.produced;
    bench.hears("42C#0A050504");
    let production = format!("345#{:02X}000000", count + 1);
    assert_eq!(bench.collect(), [production, "42B#0A85".to_owned()]);
    assert_eq!(bench.node.server.status(), NetworkStatus::Connected);
    bench.wait(Duration::from_nanos(399_999_999));
    assert_eq!(state(&bench), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(state(&bench), Some(State::TimedOut));
}

#[test]
fn a_reset_of_an_established_connection_starts_its_watchdog_anew_and_produces_nothing() {
    let mut bench = acknowledged("6400");
    bench.wait(Duration::from_millis(350));
    bench.asks("05 05 04", "85");
    bench.wait(Duration::from_nanos(399_999_999));
    assert_eq!(state(&bench), Some(State::Established));
    bench.wait(Duration::from_nanos(1));
    assert_eq!(state(&bench), Some(State::TimedOut));
}

#[test]
fn a_timed_out_connection_may_be_allocated_anew_either_way() {
    for (choice, transport) in [("10", "13"), ("20", "03"), ("50", "10"), ("60", "00")] {
        let mut bench = acknowledged("6400");
        bench.wait(Duration::from_millis(400));
        assert_eq!(bench.node.server.status(), NetworkStatus::TimedOut);
        bench.asks(&format!("4B 03 01 {choice} 0A"), "CB 00");
        assert_eq!(state(&bench), Some(State::Configuring));
        assert_eq!(bench.node.server.status(), NetworkStatus::Connected);
        bench.asks("0E 05 04 03", &format!("8E {transport}"));
        bench.asks("0E 05 04 09", "8E 0000");
    }
}

#[test]
fn watchdog_actions_delete_or_reset_the_connection() {
    let mut deleted = acknowledged("6400");
    deleted.asks("10 05 04 0C 01", "90");
    deleted.wait(Duration::from_millis(400));
    assert_eq!(state(&deleted), None);
    assert_eq!(deleted.wait(Duration::from_secs(5)), [""; 0]);
    assert_eq!(deleted.node.server.status(), NetworkStatus::Connected);
    let mut reset = acknowledged("6400");
    reset.asks("10 05 04 0C 02", "90");
    let frames = reset.wait(Duration::from_secs(4));
    assert_eq!(state(&reset), Some(State::Established));
    assert!(frames.len() > 40, "{} productions go on", frames.len());
}

#[test]
fn when_the_last_connection_times_out_the_set_is_free() {
    for action in ["00", "01"] {
        let mut bench = acknowledged("6400");
        bench.asks(&format!("10 05 04 0C {action}"), "90");
        bench.says("42E#0A4C030101", &["42B#0ACC"]);
        assert_eq!(state(&bench), Some(State::Established));
        bench.wait(Duration::from_millis(400));
        assert_eq!((state(&bench), bench.node.server.master()), (None, None));
        assert_eq!(bench.node.server.status(), NetworkStatus::OnLine);
        assert!(bench.node.toy.events.contains(&Event::Forgotten));
        bench.says("42E#3F4B0301113F", &["42B#3FCB00"]);
    }
}

#[test]
fn of_poll_and_change_of_state_each_times_out_by_itself() {
    let mut bench = Bench::with(0x13);
    bench.asks("10 05 02 09 64 00", "90 6400");
    bench.hears("42C#0A100504096400");
    bench.collect();
    bench.says("42A#", &[]);
    bench.hears("42D#");
    bench.collect();
    for _ in 0..10 {
        bench.wait(Duration::from_millis(100));
        bench.hears("42D#");
        bench.collect();
    }
    assert_eq!(state(&bench), Some(State::TimedOut));
    assert_eq!(bench.node.server.connection_state(2), Some(State::Established));
    assert_eq!(bench.node.server.status(), NetworkStatus::TimedOut);
    bench.asks("4C 03 01 10", "CC");
    assert_eq!(bench.node.server.status(), NetworkStatus::Connected);
}

#[test]
fn deferred_delete_lives_and_ends_with_an_established_change_of_state_connection() {
    let mut bench = Bench::with(0x11);
    bench.asks("10 05 01 0C 03", "90");
    bench.asks("10 05 01 09 C4 09", "90 C409");
    bench.hears("42C#0A10050409E803");
    bench.collect();
    for _ in 0..12 {
        bench.says("42A#", &[]);
        bench.wait(Duration::from_secs(1));
    }
    assert_eq!(bench.node.server.connection_state(1), Some(State::DeferredDelete));
    bench.asks("0E 05 01 01", "8E 03");
    for _ in 0..12 {
        bench.says("42A#", &[]);
        bench.wait(Duration::from_secs(1));
    }
    assert_eq!(bench.node.server.connection_state(1), Some(State::DeferredDelete));
    bench.wait(Duration::from_secs(4));
    assert_eq!(bench.node.server.connection_state(1), None);
    assert_eq!(bench.node.server.master(), None);
}
