//! A poll cycle lasts as long as its frames, to the bit.

use codewheel_sim::can::{Either, Event, NodeId, candump_line, frame_bits, parse_frame};
use codewheel_station::Duration;
use codewheel_station::can::BitRate;

use crate::segment::Segment;

/// The worst case of a poll command and its response of four octets, interframe spaces included.
const EXCHANGE_BITS: u64 = 55 + 95;
/// Behind the last frame of a cycle; the scanner has the response before it.
const INTERFRAME_SPACE: u64 = 3;
const CYCLES: usize = 20;

/// A segment of 63 polled encoders whose scanner polls them without a pause.
fn full_segment(rate: BitRate) -> (Segment, NodeId) {
    let mut segment = Segment::new(rate, 1);
    let addresses: Vec<u8> = (1..=63).collect();
    let scanner = segment.attach_scanner(&addresses, Duration::from_millis(1));
    for address in &addresses {
        segment.attach_encoder(*address, u32::from(*address));
    }
    let all = |segment: &Segment| (1..=63).all(|address| segment.is_running(scanner, address));
    let took = segment.run_until(Duration::from_secs(15), all);
    assert!(took.is_some(), "not all of them exchange data at {rate}");
    // The explicit connections fall silent; then there are polls and responses and nothing else.
    segment.run(Duration::from_secs(1));
    if let Some(Either::Left(scanner)) = segment.wire.node_mut(scanner) {
        scanner.set_interscan_delay(Duration::ZERO);
    }
    segment.run(Duration::from_millis(200));
    (segment, scanner)
}

/// The candump of one whole cycle, and how long the scanner says that it took.
fn one_cycle(segment: &mut Segment, scanner: NodeId) -> (Vec<String>, Duration) {
    // Up to the end of a cycle: the frame on the wire by then is the first poll of the next one.
    let count = |segment: &Segment| segment.scanner(scanner).cycle_times().count;
    let now = count(segment);
    while count(segment) == now {
        step(segment);
    }
    let mut lines = Vec::new();
    while count(segment) == now + 1 {
        lines.extend(step(segment));
    }
    (lines, segment.scanner(scanner).cycle_times().last)
}

/// Runs to the next event on the wire, which may be the end of a frame.
fn step(segment: &mut Segment) -> Vec<String> {
    let mut lines = Vec::new();
    let next = segment.wire.next_event().expect("polls without end");
    segment.wire.run_until(next, &mut |event| {
        if let Event::Frame { at, frame, .. } = event {
            lines.push(candump_line(*at, "can0", frame));
        }
    });
    lines
}

fn bits_of(line: &str) -> u64 {
    let frame = line.rsplit(' ').next().expect("a frame at the end of the line");
    u64::from(frame_bits(&parse_frame(frame).expect("candump notation")))
}

#[test]
fn a_cycle_of_63_slaves_lasts_as_long_as_its_frames_and_less_than_the_worst_case() {
    for rate in BitRate::ALL {
        let (mut segment, scanner) = full_segment(rate);
        let mut shares = Vec::new();
        for _ in 0..CYCLES {
            let (candump, cycle) = one_cycle(&mut segment, scanner);
            assert_eq!(candump.len(), 2 * 63, "polls and responses:\n{}", candump.join("\n"));
            let bits: u64 = candump.iter().map(|line| bits_of(line)).sum();
            let expected = Duration::from_nanos((bits - INTERFRAME_SPACE) * rate.bit_nanos());
            assert_eq!(cycle, expected, "at {rate}:\n{}", candump.join("\n"));
            let share = bits as f64 / (63 * EXCHANGE_BITS) as f64;
            assert!((0.80..=1.00).contains(&share), "{share:.3} of the worst case at {rate}");
            shares.push(share);
        }
        let worst = Duration::from_nanos(63 * EXCHANGE_BITS * rate.bit_nanos());
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        println!("{rate}: {mean:.3} of {worst}");
        assert_eq!(segment.violations, [""; 0]);
    }
}

#[test]
fn the_worst_case_of_63_slaves_is_the_one_of_the_table() {
    let worst = BitRate::ALL.map(|rate| 63 * EXCHANGE_BITS * rate.bit_nanos());
    assert_eq!(worst, [75_600_000, 37_800_000, 18_900_000]);
}
