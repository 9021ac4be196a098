//! Two nodes with one address.

use codewheel_devicenet::{Fault, NetworkStatus};
use codewheel_sim::can::{Event, NodeId};
use codewheel_station::Duration;
use codewheel_station::can::{BitRate, Identifier};

use crate::segment::Segment;

const DUPLICATE: NetworkStatus = NetworkStatus::Faulted(Fault::DuplicateMac);

/// How many of `nodes` take part.
fn on_line(segment: &Segment, nodes: &[NodeId]) -> usize {
    let takes_part = |id: &&NodeId| {
        !matches!(segment.status(**id), NetworkStatus::NotOnLine | NetworkStatus::Faulted(_))
    };
    nodes.iter().filter(takes_part).count()
}

fn segment_with_scanner() -> (Segment, NodeId) {
    let mut segment = Segment::new(BitRate::Kbit500, 1);
    let scanner = segment.attach_scanner(&[5, 6], Duration::from_millis(1));
    segment.attach_encoder(6, 6);
    (segment, scanner)
}

#[test]
fn two_nodes_with_one_address_switched_on_together_both_stay_off() {
    let (mut segment, scanner) = segment_with_scanner();
    let both = [segment.attach_encoder(5, 50), segment.attach_encoder(5, 51)];
    for _ in 0..100 {
        segment.run(Duration::from_millis(100));
        assert_eq!(on_line(&segment, &both), 0);
    }
    assert_eq!(both.map(|id| segment.status(id)), [DUPLICATE; 2]);
    assert!(segment.is_running(scanner, 6), "the others do not mind");
    assert!(!segment.is_running(scanner, 5));
    // The wire names both: one identifier from two nodes.
    assert_eq!(segment.violations.len(), 2, "{:?}", segment.violations);

    // One of them gets another address: the other one is on-line after a power cycle.
    segment.wire.detach(both[0]);
    segment.wire.detach(both[1]);
    segment.attach_encoder(5, 51);
    let back = segment.run_until(Duration::from_secs(5), |segment| segment.is_running(scanner, 5));
    assert!(back.is_some());
}

#[test]
fn of_two_nodes_with_one_address_never_more_than_one_is_on_line_whatever_lies_between_them() {
    for offset in (1..3_000).step_by(37) {
        let mut segment = Segment::new(BitRate::Kbit125, offset);
        segment.attach_encoder(6, 6);
        let first = segment.attach_encoder(5, 50);
        segment.run(Duration::from_millis(offset));
        let second = segment.attach_encoder(5, 51);
        for _ in 0..100 {
            segment.run(Duration::from_millis(50));
            assert!(on_line(&segment, &[first, second]) <= 1, "{offset} ms apart");
        }
        let statuses = [segment.status(first), segment.status(second)];
        let expected = match offset {
            // The first one is still checking, hears the second one and gives way.
            ..2_000 => [DUPLICATE, NetworkStatus::OnLine],
            _ => [NetworkStatus::OnLine, DUPLICATE],
        };
        assert_eq!(statuses, expected, "{offset} ms apart");
    }
}

#[test]
fn who_comes_second_stays_off_and_the_first_keeps_its_address() {
    let (mut segment, scanner) = segment_with_scanner();
    let first = segment.attach_encoder(5, 50);
    segment.run(Duration::from_secs(5));
    assert!(segment.is_running(scanner, 5));
    let second = segment.attach_encoder(5, 51);
    let mut said_by_second = Vec::new();
    segment.watch(Duration::from_secs(20), |event| {
        if let Event::Frame { from, frame, .. } = event
            && *from == second
        {
            said_by_second.push(frame.to_string());
        }
    });
    assert_eq!(said_by_second, ["42F#00D40133000000"], "its first request, and then nothing more");
    assert_eq!(segment.status(second), DUPLICATE);
    assert_eq!(segment.status(first), NetworkStatus::Connected);
    for address in [5, 6] {
        assert!(segment.is_running(scanner, address));
        assert_eq!(segment.slave(scanner, address).losses, 0, "polled without a gap");
    }
}

#[test]
fn a_scanner_whose_address_is_taken_stays_off_and_polls_nobody() {
    let mut segment = Segment::new(BitRate::Kbit250, 1);
    let thief = segment.attach_encoder(0, 99);
    segment.attach_encoder(5, 5);
    segment.run(Duration::from_secs(3));
    let scanner = segment.attach_scanner(&[5], Duration::from_millis(1));
    let mut polls = 0;
    segment.watch(Duration::from_secs(20), |event| {
        if let Event::Frame { from, frame, .. } = event
            && *from == scanner
            && frame.identifier() != Identifier::Standard(0x407)
        {
            polls += 1;
        }
    });
    assert_eq!(polls, 0);
    assert_eq!(segment.scanner(scanner).faulted(), Some(Fault::DuplicateMac));
    assert_eq!(segment.status(thief), NetworkStatus::OnLine);

    // The thief leaves; the scanner needs its power cycled, and then polls.
    segment.wire.detach(thief);
    segment.wire.detach(scanner);
    let scanner = segment.attach_scanner(&[5], Duration::from_millis(1));
    let polled =
        segment.run_until(Duration::from_secs(5), |segment| segment.is_running(scanner, 5));
    assert!(polled.is_some());
}

#[test]
fn a_node_that_takes_the_address_of_a_polling_scanner_stays_off_and_disturbs_nobody() {
    let (mut segment, scanner) = segment_with_scanner();
    segment.run(Duration::from_secs(5));
    let thief = segment.attach_encoder(0, 99);
    for _ in 0..100 {
        segment.run(Duration::from_millis(50));
        assert!(segment.is_running(scanner, 6));
    }
    assert_eq!(segment.status(thief), DUPLICATE);
    assert!(segment.scanner(scanner).is_on_line());
    assert_eq!(segment.slave(scanner, 6).losses, 0);
    assert_eq!(segment.violations, [""; 0]);
}
