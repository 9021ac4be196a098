//! Resets by the Identity object, as the server sees them (devicenet clause 5).

use codewheel_devicenet::connection::State;
use codewheel_devicenet::explicit::GeneralStatus;
use codewheel_devicenet::{NetworkSettings, ProducedPath, Server};
use codewheel_station::can::Input;
use codewheel_station::{Duration, Station};

use crate::bench::Bench;

/// Everything that a peer may want of the node.
const REQUESTS: [&str; 6] =
    ["42C#0A0E010101", "42C#0A10050409E803", "42E#0B4B0301030B", "42E#0A4C030103", "42D#", "42A#"];

#[test]
fn between_the_answer_and_the_restart_requests_are_dropped() {
    let mut bench = Bench::polled();
    bench.hears("42C#0A050101");
    for request in REQUESTS {
        bench.hears(request);
    }
    assert!(!bench.node.server.power_cycle_due());
    assert_eq!(bench.collect(), ["42B#0A85"], "the answer, and nothing else");
    assert!(bench.node.server.power_cycle_due());
    for request in REQUESTS {
        bench.says(request, &[]);
    }
    assert_eq!(bench.wait(Duration::from_secs(100)), [""; 0]);
}

#[test]
fn an_answer_that_the_wire_does_not_take_is_waited_for() {
    let mut bench = Bench::polled();
    bench.hears("42C#0A050101");
    let answer = bench.hands_out().expect("the answer");
    bench.wait(Duration::from_secs(9));
    assert!(!bench.node.server.power_cycle_due());
    bench.is_sent(&answer);
    assert!(bench.node.server.power_cycle_due());
}

#[test]
fn with_nobody_left_to_hear_the_answer_an_accepted_reset_is_carried_out() {
    let mut bench = Bench::polled();
    bench.hears("42C#0A050101");
    bench.hands_out();
    bench.wait(Duration::from_secs(10));
    assert!(bench.node.server.power_cycle_due());
}

#[test]
fn an_answer_never_reported_as_sent_holds_the_restart_up_for_ten_seconds_at_most() {
    // Deferred delete beside a connection that never times out; then without any time-out at all.
    for prepare in [["10 05 01 0C 03", "10 05 02 09 00 00"], ["10 05 01 09 00 00", "0E 01 01 01"]] {
        let mut bench = Bench::allocated();
        for request in prepare {
            assert!(bench.ask(request).is_some());
        }
        bench.hears("42C#0A050101");
        bench.hands_out().expect("the answer");
        bench.wait(Duration::from_nanos(9_999_999_999));
        assert!(!bench.node.server.power_cycle_due());
        bench.wait(Duration::from_nanos(1));
        assert!(bench.node.server.power_cycle_due(), "{prepare:?}");
    }
}

#[test]
fn the_answer_to_another_service_05_does_not_count_as_that_of_the_reset() {
    let mut bench = Bench::polled();
    bench.hears("42C#0A050501");
    let earlier = bench.hands_out().expect("the answer to the reset of a connection");
    bench.hears("42C#4A050101");
    bench.is_sent(&earlier);
    assert!(!bench.node.server.power_cycle_due());
    assert_eq!(bench.collect(), ["42B#4A85"]);
    assert!(bench.node.server.power_cycle_due());
}

#[test]
fn a_reset_to_the_defaults_is_carried_out_also_when_its_connection_has_ended_meanwhile() {
    // By release, and by time-out; the poll connection takes no part.
    let mut released = Bench::polled();
    assert_eq!(released.ask("05 01 01 01"), None);
    released.says("42E#0A4C030101", &["42B#0ACC"]);
    let mut silent = Bench::polled();
    assert_eq!(silent.ask("05 01 01 01"), None);
    silent.wait(Duration::from_secs(10));
    for mut bench in [released, silent] {
        assert_eq!(bench.node.server.connection_state(1), None);
        assert!(!bench.node.server.power_cycle_due());
        bench.node.server.complete(Ok(()));
        assert!(bench.node.server.power_cycle_due());
        assert_eq!(bench.collect(), [""; 0]);
    }
}

#[test]
fn while_the_defaults_are_written_polls_go_on_and_no_other_frame_restarts_the_node() {
    let mut bench = Bench::polled();
    bench.asks("05 05 02", "85");
    assert_eq!(bench.ask("05 01 01 01"), None);
    bench.says("42D#", &["3C5#01000000"]);
    bench.asks("05 05 02", "94 10 FF");
    bench.asks("05 01 01", "94 10 FF");
    bench.says("42E#0B4B0301030B", &["42B#0B940C01"]);
    bench.says("42F#00D40178563412", &["42F#8034120DF0FECA"]);
    assert!(!bench.node.server.power_cycle_due());
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), ["42B#0A85"]);
    assert!(bench.node.server.power_cycle_due());
}

#[test]
fn a_reset_to_the_defaults_that_failed_is_off() {
    for released in [false, true] {
        let mut bench = Bench::polled();
        assert_eq!(bench.ask("05 01 01 01"), None);
        if released {
            bench.says("42E#0A4C030101", &["42B#0ACC"]);
        }
        bench.node.server.complete(Err(GeneralStatus::STORE_FAILED.into()));
        let answers: &[&str] = if released { &[] } else { &["42B#0A9419FF"] };
        assert_eq!(bench.collect(), answers);
        assert!(!bench.node.server.power_cycle_due());
        bench.says("42D#", &["3C5#01000000"]);
        bench.node.server.complete(Ok(()));
        assert!(!bench.node.server.power_cycle_due(), "a second completion means nothing");
    }
}

#[test]
fn a_fault_ends_a_reset_that_was_not_carried_out_yet() {
    for request in ["42C#0A050101", "42C#0A05010101"] {
        let mut bench = Bench::polled();
        bench.hears(request);
        bench.node.handle(bench.now, Input::BusOff);
        bench.node.server.complete(Ok(()));
        assert!(!bench.node.server.power_cycle_due(), "only a power cycle ends a fault");
        assert_eq!(bench.collect(), [""; 0]);
    }
}

#[test]
fn a_refused_reset_restarts_nothing() {
    let mut bench = Bench::polled();
    for request in ["05 01 01 02", "05 01 01 FF", "05 01 01 00 00", "05 01 01 01 00", "05 01 02"] {
        bench.ask(request).expect("a refusal");
        assert_eq!(bench.node.toy.reset, None, "{request}");
    }
    assert!(!bench.node.server.power_cycle_due());
    bench.says("42D#", &["3C5#01000000"]);
}

#[test]
fn a_kept_path_that_names_no_assembly_of_the_device_is_the_default() {
    for assembly in [0, 3, 255] {
        let path = ProducedPath { assembly, names_attribute: true };
        let settings =
            NetworkSettings { poll_path: path, change_path: path, ..NetworkSettings::default() };
        let mut bench = Bench::power_up();
        bench.node.server =
            Server::new(bench.node.server.mac(), bench.node.server.bit_rate(), settings);
        bench.collect();
        bench.wait(Duration::from_secs(2));
        bench.says("42E#0A4B0301530A", &["42B#0ACB00"]);
        for instance in ["02", "04"] {
            bench.asks(&format!("0E 05 {instance} 0E"), "8E 20042401");
            bench.asks(&format!("0E 05 {instance} 0D"), "8E 0400");
            bench.asks(&format!("0E 05 {instance} 07"), "8E 0400");
        }
        bench.hears("42C#0A100504090000");
        assert_eq!(bench.collect()[0], "345#01000000");
        assert_eq!(bench.node.server.connection_state(4), Some(State::Established));
    }
}
