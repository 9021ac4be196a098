//! The poll cycle: what it waits for, and for how long.

use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::{PollSettings, Scanner, SlaveSettings, SlaveState};
use codewheel_station::can::Input;
use codewheel_station::{Duration, Station};

use crate::bench::frame;
use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

fn two_slaves() -> Bench {
    let poll = Some(PollSettings { expected_packet_rate: 1_000, assembly: None });
    let settings = [5, 6].map(|at| SlaveSettings { poll, ..SlaveSettings::poll(mac(at)) });
    let mut bench = Bench::new(&[Peer::new(5), Peer::new(6)], &settings);
    bench.run(millis(2_500));
    bench.log.clear();
    bench
}

fn polls_to(bench: &Bench, prefix: &str) -> usize {
    bench.log.iter().filter(|(_, sent)| sent.starts_with(prefix)).count()
}

/// Leaves the bench at the beginning of a cycle, both polls just handed out and not yet sent.
fn polls_in_the_mailbox() -> Bench {
    let mut bench = two_slaves();
    bench.reports = false;
    loop {
        bench.scanner.advance(bench.now);
        if !bench.collect().is_empty() {
            return bench;
        }
        bench.now = bench.scanner.deadline().unwrap();
    }
}

#[test]
fn the_time_for_responses_runs_from_when_the_last_poll_was_sent_not_handed_out() {
    let mut bench = polls_in_the_mailbox();
    bench.log.clear();
    // The bus is busy for 45 ms; then the polls go out one after the other.
    bench.now += millis(45);
    bench.scanner.handle(bench.now, Input::Sent(&frame("42D#")));
    bench.now += millis(40);
    bench.scanner.handle(bench.now, Input::Sent(&frame("435#")));
    assert_eq!(bench.collect(), [""; 0]);
    bench.now += millis(40);
    bench.scanner.handle(bench.now, Input::Frame(&frame("3C5#01020304")));
    bench.scanner.handle(bench.now, Input::Frame(&frame("3C6#01020304")));
    assert_eq!(bench.collect(), ["42D#", "435#"]);
    assert_eq!(bench.scanner.cycle_times().last, millis(125));
}

#[test]
fn a_slave_whose_poll_has_not_been_sent_is_not_polled_again() {
    let mut bench = polls_in_the_mailbox();
    bench.log.clear();
    // The poll for 5 goes out and is answered, the one for 6 stays in its mailbox.
    for _ in 0..10 {
        bench.scanner.handle(bench.now, Input::Sent(&frame("42D#")));
        bench.scanner.handle(bench.now, Input::Frame(&frame("3C5#01020304")));
        bench.wait(millis(70));
    }
    assert!(polls_to(&bench, "42D") >= 8);
    assert_eq!(polls_to(&bench, "435"), 0);
    // When nobody has reported it for a second, it is given up for lost.
    bench.wait(millis(400));
    assert_eq!(polls_to(&bench, "435"), 1);
}

#[test]
fn a_slave_that_still_may_answer_is_passed_over_in_the_next_cycle() {
    let mut bench = two_slaves();
    bench.peers[1].input = None;
    bench.run(millis(400));
    // 50 ms each, from the answer of 5 on; never two polls within that time.
    let times: Vec<_> = bench.log.iter().filter(|(_, sent)| sent == "435#").collect();
    assert!(times.windows(2).all(|two| two[1].0.since(two[0].0) >= millis(50)), "{times:?}");
    assert!(times.len() >= 6);
}

#[test]
fn a_silent_slave_slows_the_cycle_down_to_the_response_time_and_no_further() {
    let mut bench = two_slaves();
    bench.peers[1].input = None;
    bench.run(millis(500));
    let polls = polls_to(&bench, "42D");
    assert!((9..=11).contains(&polls), "{polls} polls in 500 ms");
}

#[test]
fn a_medium_that_reports_nothing_does_not_stop_the_polls() {
    let mut bench = two_slaves();
    bench.reports = false;
    bench.run(secs(1));
    let polls = polls_to(&bench, "42D");
    assert!((99..=101).contains(&polls), "{polls} polls in a second of 10 ms each");
    assert_eq!(bench.state(), SlaveState::Running);
}

#[test]
fn after_advance_and_transmit_no_deadline_lies_in_the_past() {
    let mut bench = two_slaves();
    // Nobody asks for frames: the pause falls due and stays so without a deadline in the past.
    bench.now = bench.scanner.deadline().unwrap();
    bench.scanner.advance(bench.now);
    assert!(bench.scanner.deadline().unwrap() > bench.now);
    // Both slaves are lost at once.
    bench.now += secs(11);
    bench.scanner.advance(bench.now);
    assert!(bench.scanner.deadline().is_none_or(|deadline| deadline > bench.now));
    assert_eq!(bench.collect(), ["42E#004B03010300", "436#004B03010300"]);
}

#[test]
fn as_fast_as_it_can_the_scanner_polls_each_slave_once_a_cycle() {
    let identity = codewheel_devicenet::scanner::ScannerIdentity { vendor: 1, serial: 99 };
    let mut bench = two_slaves();
    bench.scanner = Scanner::new(mac(0), identity, Duration::ZERO);
    for address in [5, 6] {
        bench.scanner.add(SlaveSettings::poll(mac(address))).unwrap();
    }
    bench.run(millis(2_500));
    bench.log.clear();
    bench.run(millis(100));
    let polls = (polls_to(&bench, "42D"), polls_to(&bench, "435"));
    assert_eq!(polls.0, polls.1);
    assert!(polls.0 > 200, "{polls:?}");
}

#[test]
fn a_scanner_has_room_for_every_other_address() {
    let identity = codewheel_devicenet::scanner::ScannerIdentity { vendor: 1, serial: 99 };
    let mut scanner: Box<Scanner> = Box::new(Scanner::new(mac(63), identity, Duration::ZERO));
    for address in (0..63).filter_map(MacId::new) {
        scanner.add(SlaveSettings::poll(address)).unwrap();
    }
    // What it takes is mostly room for input, output and responses.
    let size = size_of::<Scanner>();
    assert!(size <= 63 * 1_024, "{size} octets");
}
