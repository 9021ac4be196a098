//! The live list: who is on the segment.

use codewheel_devicenet::scanner::{NotTaken, Presence, Probing, ScanProgress, SlaveSettings};
use codewheel_station::Station;
use codewheel_station::can::Input;

use crate::bench::{Node, frame};
use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

/// On-line, nobody added.
fn on_line() -> Bench {
    let mut bench = Bench::new(&[], &[]);
    bench.run(millis(2_100));
    bench.log.clear();
    bench
}

fn sent(bench: &Bench) -> Vec<&str> {
    bench.log.iter().map(|(_, sent)| sent.as_str()).collect()
}

fn complete(bench: &Bench) -> [Presence; 64] {
    let list = bench.scanner.live_list();
    assert_eq!(list.progress, ScanProgress::Complete);
    list.nodes
}

#[test]
fn a_scan_listens_then_asks_each_silent_address_twice_and_ends() {
    let mut bench = on_line();
    bench.scanner.scan(bench.now, Probing::Gentle).unwrap();
    assert_eq!(bench.scanner.live_list().progress, ScanProgress::Listening);
    bench.run(millis(1_090));
    assert_eq!(bench.log, []);
    bench.run(millis(700));
    let ScanProgress::Probing { percent } = bench.scanner.live_list().progress else { panic!() };
    assert!((45..=55).contains(&percent), "{percent} %");
    bench.run(millis(2_300));
    assert!(complete(&bench)[1..].iter().all(|node| *node == Presence::Silent));
    assert_eq!(complete(&bench)[0], Presence::Scanner);
    assert_eq!(bench.log.len(), 126);
    assert_eq!(sent(&bench)[..2], ["40E#000E010101", "416#000E010101"]);
    assert_eq!(sent(&bench)[63], "40E#400E010101");
    assert_eq!(bench.scanner.deadline(), None);
}

#[test]
fn a_server_answers_the_probe_whether_allocated_or_not() {
    let mut bench = on_line();
    let mut nodes = [Node::new(7), Node::new(63)];
    let now = bench.now;
    for node in &mut nodes {
        for step in 0..3 {
            let at = codewheel_station::Instant::from_nanos(step * 1_000_000_000);
            node.advance(at);
            while let Some(frame) = node.transmit(at) {
                node.handle(at, Input::Sent(&frame));
            }
        }
        node.advance(now);
    }
    // The first belongs to another master.
    nodes[0].handle(now, Input::Frame(&frame("43E#3F4B0301033F")));
    while nodes[0].transmit(now).is_some() {}
    bench.scanner.scan(now, Probing::Gentle).unwrap();
    let end = now + secs(5);
    while bench.now < end {
        bench.scanner.advance(bench.now);
        while let Some(frame) = bench.scanner.transmit(bench.now) {
            bench.scanner.handle(bench.now, Input::Sent(&frame));
            for node in &mut nodes {
                node.handle(bench.now, Input::Frame(&frame));
                while let Some(answer) = node.transmit(bench.now) {
                    bench.log.push((bench.now, answer.to_string()));
                    bench.scanner.handle(bench.now, Input::Frame(&answer));
                }
            }
        }
        bench.now = bench.scanner.deadline().unwrap_or(end).min(end);
    }
    let list = complete(&bench);
    assert_eq!(
        (list[7], list[63], list[8]),
        (Presence::Answers, Presence::Answers, Presence::Silent)
    );
    assert_eq!(sent(&bench), ["43B#00940203", "5FB#00940203"]);
}

#[test]
fn whoever_sends_anything_is_seen_and_whoever_checks_is_checking() {
    let mut bench = on_line();
    bench.scanner.scan(bench.now, Probing::Gentle).unwrap();
    for candump in [
        "3C3#01020304",         // 3 answers the poll of another master
        "345#01",               // 5 produces
        "43C#090E010101",       // 9 asks 7, which does not answer
        "45B#098E1234",         // 11 answers 9
        "60C#00",               // 12 is no Group 2 Only Server
        "46F#00 0100 01000000", // 13 checks its address
        "477#80 0100 01000000", // 14 defends its address
        "47F#00 0100",          // a frame that is none of 15's
        "7EC#00",               // nobody says who
    ] {
        bench.hears(candump);
    }
    bench.wait(secs(5));
    let list = complete(&bench);
    let expected = [
        (3, Presence::Seen),
        (5, Presence::Seen),
        (7, Presence::Silent),
        (9, Presence::Seen),
        (11, Presence::Seen),
        (12, Presence::Seen),
        (13, Presence::Checking),
        (14, Presence::Answers),
        (15, Presence::Silent),
    ];
    for (address, presence) in expected {
        assert_eq!(list[address], presence, "address {address}");
    }
}

#[test]
fn slaves_of_the_scan_list_are_known_without_a_probe() {
    let mut bench = Bench::polling(Peer::new(5));
    bench.scanner.add(SlaveSettings::poll(mac(6))).unwrap();
    bench.log.clear();
    bench.scanner.scan(bench.now, Probing::Forced).unwrap();
    bench.run(secs(6));
    let list = complete(&bench);
    assert_eq!((list[5], list[6]), (Presence::Answers, Presence::Silent));
    assert!(!bench.log.iter().any(|(_, sent)| sent.starts_with("42E") || sent.starts_with("42F")));
    assert!(
        !bench.log.iter().any(|(_, sent)| sent.contains("436#000E") || sent.starts_with("437"))
    );
    assert_eq!(bench.view().losses, 0, "polls went on");
}

#[test]
fn only_a_forced_scan_sends_check_requests_and_never_to_an_address_heard_checking() {
    let mut bench = on_line();
    bench.scanner.scan(bench.now, Probing::Forced).unwrap();
    bench.hears("46F#00 0100 01000000"); // 13 checks
    bench.hears("3C3#01020304"); // 3 is there
    let mut answered = false;
    let end = bench.now + secs(6);
    while bench.now < end {
        bench.run(millis(5));
        // 20 speaks no Group 2 Only, but defends its address.
        if !answered && bench.log.iter().any(|(_, sent)| sent == "4A7#00010063000000") {
            answered = true;
            bench.hears("4A7#80 0100 01000000");
        }
    }
    let checks: Vec<_> =
        sent(&bench).into_iter().filter(|sent| sent.contains("#00010063")).collect();
    assert_eq!(checks.len(), 61, "all but 0, 3 and 13");
    assert!(!checks.iter().any(|sent| sent.starts_with("46F") || sent.starts_with("41F")));
    assert_eq!(complete(&bench)[20], Presence::Answers);
    assert_eq!(complete(&bench)[13], Presence::Checking);
}

#[test]
fn a_scan_ends_within_ten_seconds_on_a_medium_that_takes_nothing() {
    let mut bench = on_line();
    bench.scanner.scan(bench.now, Probing::Gentle).unwrap();
    bench.now += millis(1_100);
    bench.scanner.advance(bench.now);
    bench.now = bench.scanner.deadline().unwrap();
    bench.scanner.advance(bench.now);
    assert_eq!(bench.scanner.live_list().progress, ScanProgress::Aborted);
    assert_eq!(bench.scanner.deadline(), None);
}

#[test]
fn a_scanner_that_is_not_on_line_hears_and_does_not_scan() {
    let mut bench = Bench::new(&[], &[]);
    assert_eq!(bench.scanner.scan(bench.now, Probing::Gentle), Err(NotTaken::OffLine));
    bench.hears("3C3#01020304");
    let list = bench.scanner.live_list();
    assert_eq!((list.nodes[3], list.progress), (Presence::Seen, ScanProgress::NotBegun));
}
