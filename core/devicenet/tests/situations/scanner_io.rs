//! Input and output data that do not fit a frame.

use codewheel_devicenet::scanner::{NotSet, Refusal, SlaveSettings, SlaveState};

use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

/// A slave that produces `produced` and consumes `consumed` octets.
fn peer(produced: u8, consumed: u8) -> Peer {
    Peer::new(5)
        .answers("0E050207", &format!("8E {produced:02X}00"))
        .answers("0E050208", &format!("8E {consumed:02X}00"))
}

/// Lets the next cycle begin.
fn next_cycle(bench: &mut Bench) -> Vec<String> {
    let from = bench.log.len();
    bench.wait(millis(60));
    bench.log[from..].iter().map(|(_, sent)| sent.clone()).collect()
}

#[test]
fn a_fragmented_poll_response_is_put_together() {
    let mut bench = Bench::running(peer(16, 0), SlaveSettings::poll(mac(5)));
    next_cycle(&mut bench);
    let before = bench.view().responses;
    bench.hears("3C5#00 00010203040506");
    bench.hears("3C5#41 0708090A0B0C0D");
    assert_eq!(bench.view().responses, before);
    bench.hears("3C5#82 0E0F");
    assert_eq!(bench.view().responses, before + 1);
    let all: Vec<u8> = (0..16).collect();
    assert_eq!(bench.view().input, all);
    assert_eq!(bench.view().latest().unwrap().1, all);
}

#[test]
fn a_fragment_missing_or_too_much_loses_that_response_and_no_more() {
    let mut bench = Bench::running(peer(16, 0), SlaveSettings::poll(mac(5)));
    for wrong in [
        &["3C5#00 00010203040506", "3C5#82 0E0F"][..],
        &["3C5#00 00010203040506", "3C5#41 0708090A0B0C0D", "3C5#82 0E"],
        &["3C5#00 00010203040506", "3C5#41 0708090A0B0C0D", "3C5#82 0E0F10"],
        &["3C5#41 0708090A0B0C0D", "3C5#82 0E0F"],
        &["3C5#", "3C5#C0", "3C5#3F 00010203040506"],
    ] {
        next_cycle(&mut bench);
        for part in wrong {
            bench.hears(part);
        }
        assert!(bench.view().input_at.is_none(), "{wrong:?}");
    }
    for part in ["3C5#00 00010203040506", "3C5#41 0708090A0B0C0D", "3C5#82 0E0F"] {
        bench.hears(part);
    }
    assert_eq!(bench.view().input.len(), 16);
}

#[test]
fn the_longest_input_is_taken_and_a_longer_one_refused() {
    let bench = Bench::running(peer(64, 0), SlaveSettings::poll(mac(5)));
    assert_eq!(bench.state(), SlaveState::Running);
    let mut bench = Bench::new(&[peer(65, 0)], &[SlaveSettings::poll(mac(5))]);
    bench.run(millis(2_100));
    assert_eq!(bench.state(), SlaveState::Refused(Refusal::InputTooLong { octets: 65 }));
}

#[test]
fn output_that_fits_a_frame_goes_with_each_poll() {
    let mut bench = Bench::running(peer(4, 3), SlaveSettings::poll(mac(5)));
    bench.run(millis(10));
    assert_eq!(bench.peer().polls.last().unwrap(), "");
    bench.scanner.set_output(mac(5), &[7, 8, 9]).unwrap();
    assert_eq!(bench.view().output, [7, 8, 9]);
    bench.run(millis(20));
    assert_eq!(bench.peer().polls.last().unwrap(), "070809");
    bench.scanner.set_output(mac(5), &[]).unwrap();
    bench.run(millis(20));
    assert_eq!(bench.peer().polls.last().unwrap(), "");
}

#[test]
fn longer_output_goes_in_fragments_and_none_is_half_old_and_half_new() {
    let mut bench = Bench::running(peer(4, 16), SlaveSettings::poll(mac(5)));
    let old: Vec<u8> = (0..16).collect();
    bench.scanner.set_output(mac(5), &old).unwrap();
    let sent = next_cycle(&mut bench);
    let parts = ["42D#0000010203040506", "42D#410708090A0B0C0D", "42D#820E0F"];
    let begin = sent.iter().position(|frame| frame.starts_with("42D#00")).unwrap();
    assert_eq!(sent[begin..begin + 3], parts);
    // New data between two fragments wait for the next poll.
    bench.hears("3C5#01020304");
    let from = bench.log.len();
    loop {
        use codewheel_station::Station;
        bench.scanner.advance(bench.now);
        if let Some(first) = bench.scanner.transmit(bench.now) {
            assert_eq!(first.to_string(), parts[0]);
            break;
        }
        bench.now = bench.scanner.deadline().unwrap();
    }
    bench.scanner.set_output(mac(5), &[0xFF; 16]).unwrap();
    bench.collect();
    let rest: Vec<_> = bench.log[from..].iter().map(|(_, sent)| sent.as_str()).collect();
    assert_eq!(rest, parts[1..]);
    bench.hears("3C5#01020304");
    assert!(next_cycle(&mut bench).contains(&"42D#00FFFFFFFFFFFFFF".into()));
}

#[test]
fn output_of_another_length_than_the_slave_consumes_is_not_taken() {
    let mut bench = Bench::running(peer(4, 3), SlaveSettings::poll(mac(5)));
    assert_eq!(bench.scanner.set_output(mac(5), &[1, 2]), Err(NotSet::Length));
    assert_eq!(bench.scanner.set_output(mac(5), &[0; 65]), Err(NotSet::Length));
    assert_eq!(bench.scanner.set_output(mac(6), &[1]), Err(NotSet::UnknownSlave));
    let mut explicit = Bench::running(peer(4, 3), SlaveSettings::explicit(mac(5)));
    assert_eq!(explicit.scanner.set_output(mac(5), &[1, 2, 3]), Err(NotSet::UnknownSlave));
}

#[test]
fn a_slave_that_does_not_consume_the_output_set_for_it_is_refused() {
    let mut bench = Bench::new(&[peer(4, 3)], &[SlaveSettings::poll(mac(5))]);
    bench.scanner.set_output(mac(5), &[1, 2]).unwrap();
    bench.run(millis(2_100));
    let refusal = Refusal::OutputLength { consumes: 3, set: 2 };
    assert_eq!(bench.state(), SlaveState::Refused(refusal));
    bench.scanner.set_output(mac(5), &[1, 2, 3]).unwrap();
    bench.run(millis(2_100));
    assert_eq!(bench.state(), SlaveState::Running);
    bench.run(secs(1));
    assert_eq!(bench.peer().polls.last().unwrap(), "010203");
}

#[test]
fn a_slave_that_sends_first_fragments_without_end_does_not_keep_the_others_from_their_polls() {
    let settings = [SlaveSettings::poll(mac(5)), SlaveSettings::poll(mac(6))];
    let mut bench = Bench::new(&[peer(16, 0), Peer::new(6)], &settings);
    bench.run(millis(2_200));
    bench.peers.remove(0);
    let before = bench.scanner.slave(mac(6)).unwrap().polls;
    let end = bench.now + secs(5);
    while bench.now < end {
        bench.hears("3C5#00 00010203040506");
        bench.run(millis(20));
    }
    assert!(bench.scanner.slave(mac(6)).unwrap().polls - before >= 4);
}
