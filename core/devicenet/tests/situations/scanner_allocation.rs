//! How the scanner gets its slaves, gives them back, and notices that one is gone.

use codewheel_devicenet::scanner::{
    DeviceIdentity, IdentityCode, NotAdded, PollSettings, Refusal, SlaveSettings, SlaveState,
};
use codewheel_station::Station;
use codewheel_station::can::Input;

use crate::bench::frame;
use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

#[test]
fn a_slave_that_refuses_allocation_and_release_in_turn_is_left_for_two_seconds() {
    let peer = Peer::new(5).answers("4B0301", "94 0B 02").answers("4C0301", "94 0B 02");
    let mut bench = Bench::new(&[peer], &[SlaveSettings::poll(mac(5))]);
    bench.run(millis(2_500));
    let asked: Vec<&str> = bench.peers[0].asked.iter().map(String::as_str).collect();
    assert_eq!(
        asked,
        ["u4B03010300", "u4C030102", "u4C030110", "u4C030120", "u4C030101", "u4B03010300"]
    );
    let SlaveState::Refused(Refusal::Service(error)) = bench.state() else {
        panic!("{:?}", bench.state())
    };
    assert_eq!(error.general.0, 0x0B);
    bench.run(secs(2));
    assert_eq!(bench.peers[0].asked.len(), 12);
}

#[test]
fn everything_an_earlier_life_may_hold_is_released_before_the_slave_is_allocated_anew() {
    let mut bench =
        Bench::new(&[Peer::new(5).answers("4B0301", "94 0B 02")], &[SlaveSettings::poll(mac(5))]);
    let mut released = 0;
    bench.run_with(millis(2_002), |_, frame| {
        released += u32::from(frame.starts_with("42E") && frame.contains("4C0301"));
        true
    });
    assert_eq!(released, 4);
    bench.peer().rules.remove(0);
    bench.run(secs(3));
    assert_eq!(bench.state(), SlaveState::Running);
}

#[test]
fn the_wrong_device_is_released_and_the_refusal_says_which_code_differs() {
    for (identity, code, found, wanted) in [
        ((0x9999, 0x0B), IdentityCode::Vendor, 0x1234, 0x9999),
        ((0x1234, 0x0A), IdentityCode::ProductCode, 0x0B, 0x0A),
    ] {
        let identity = DeviceIdentity { vendor: identity.0, product_code: identity.1 };
        let settings = SlaveSettings { identity: Some(identity), ..SlaveSettings::poll(mac(5)) };
        let mut bench = Bench::new(&[Peer::new(5)], &[settings]);
        bench.run(millis(2_100));
        let refusal = Refusal::AnotherDevice { code, found, wanted };
        assert_eq!(bench.state(), SlaveState::Refused(refusal));
        let asked = &bench.peers[0].asked;
        assert_eq!(asked[asked.len() - 2..], ["u4C030102", "u4C030101"]);
    }
}

#[test]
fn a_slave_that_refuses_to_be_configured_is_released() {
    let mut bench =
        Bench::new(&[Peer::new(5).answers("10050209", "94 09 FF")], &[SlaveSettings::poll(mac(5))]);
    bench.run(millis(2_100));
    assert!(matches!(bench.state(), SlaveState::Refused(_)));
    assert_eq!(bench.peers[0].asked.last().unwrap(), "u4C030101");
}

#[test]
fn a_check_of_the_mac_id_by_a_second_node_does_not_lose_a_slave_that_answers_polls() {
    let mut bench = Bench::polling(Peer::new(5));
    for _ in 0..5 {
        bench.hears("42F#00 0200 01000000");
        bench.run(secs(1));
    }
    assert_eq!(bench.state(), SlaveState::Running);
    assert_eq!(bench.view().losses, 0);
    // Nor is it suspected any longer: some polls may stay without an answer.
    bench.peer().input = None;
    bench.run(millis(500));
    assert_eq!(bench.view().losses, 0);
}

#[test]
fn a_slave_that_was_switched_on_anew_is_missed_after_three_polls() {
    let mut bench = Bench::polling(Peer::new(5));
    bench.hears("42F#00 0200 01000000");
    bench.peer().input = None;
    bench.run(millis(190));
    assert_eq!(bench.view().losses, 1);
}

#[test]
fn a_slave_without_polls_that_was_switched_on_anew_is_asked() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::change_of_state(mac(5)));
    bench.hears("42F#00 0200 01000000");
    bench.run(millis(10));
    assert_eq!(bench.peer().was_asked("0E050101"), 1);
    assert_eq!(bench.state(), SlaveState::Running);
    bench.peer().on = false;
    bench.hears("42F#00 0200 01000000");
    bench.run(millis(1_200));
    assert_eq!(bench.view().losses, 1);
}

#[test]
fn an_absent_slave_heard_checking_its_mac_id_is_allocated_when_it_is_on_line() {
    let mut peer = Peer::new(5);
    peer.on = false;
    let mut bench = Bench::new(&[peer], &[SlaveSettings::poll(mac(5))]);
    bench.run(secs(3));
    assert_eq!(bench.state(), SlaveState::Absent);
    bench.hears("42F#00 0200 01000000");
    bench.log.clear();
    bench.peer().on = true;
    bench.run(millis(1_090));
    assert_eq!(bench.log, []);
    bench.run(millis(20));
    assert_eq!(bench.state(), SlaveState::Running);
}

#[test]
fn a_refusal_is_forgotten_when_the_slave_does_not_answer_any_more() {
    let peer = Peer::new(5).answers("4B0301", "94 0C 01");
    let mut bench = Bench::new(&[peer], &[SlaveSettings::poll(mac(5))]);
    bench.run(millis(2_100));
    assert!(matches!(bench.state(), SlaveState::Refused(_)));
    bench.peer().on = false;
    bench.run(secs(3));
    assert_eq!(bench.state(), SlaveState::Absent);
}

#[test]
fn without_a_rate_ten_polls_without_an_answer_lose_the_slave() {
    let poll = Some(PollSettings { expected_packet_rate: 0, assembly: None });
    let settings = SlaveSettings { poll, ..SlaveSettings::poll(mac(5)) };
    let mut bench = Bench::running(Peer::new(5), settings);
    bench.peer().on = false;
    bench.run(millis(470));
    assert_eq!(bench.view().losses, 0);
    bench.log.clear();
    bench.run(millis(150));
    assert_eq!(bench.view().losses, 1);
    let first = &bench.log[0].1;
    assert!(first.starts_with("42E") && first.ends_with("4B03010300"), "{first}");
}

#[test]
fn a_slave_that_grants_a_longer_rate_is_given_as_long() {
    let poll = Some(PollSettings { expected_packet_rate: 1, assembly: None });
    let settings = SlaveSettings { poll, ..SlaveSettings::poll(mac(5)) };
    let mut bench = Bench::running(Peer::new(5).answers("10050209", "90 6400"), settings);
    bench.peer().input = None;
    bench.run(millis(380));
    assert_eq!(bench.view().losses, 0);
    bench.run(millis(30));
    assert_eq!(bench.view().losses, 1);
}

#[test]
fn a_slave_that_grants_an_absurd_rate_is_not_waited_for_as_long() {
    for granted in ["90 FFFF", "90 0000", "90"] {
        let peer = Peer::new(5).answers("10050209", granted);
        let mut bench = Bench::polling(peer);
        bench.peer().input = None;
        bench.run(secs(5));
        assert_eq!(bench.view().losses, 1, "granted {granted}");
    }
}

#[test]
fn repeats_of_one_attempt_are_not_held_against_the_next() {
    let mut bench = Bench::new(&[Peer::new(5)], &[SlaveSettings::poll(mac(5))]);
    bench.peers[0].rule("0E050207", None);
    bench.run(secs(2) + millis(2_700));
    assert_eq!(bench.peer().was_asked("0E050207"), 2);
    bench.scanner.handle(bench.now, Input::BusOff);
    bench.scanner.handle(bench.now, Input::Recovered);
    bench.run(secs(2) + millis(5_400));
    assert_eq!(bench.peer().was_asked("0E050207"), 2 + 3);
}

#[test]
fn a_slave_taken_off_the_list_is_released_and_its_place_is_free() {
    let mut bench = Bench::polling(Peer::new(5));
    let ticket = bench.request("0E640101").unwrap();
    assert!(bench.scanner.remove(mac(5)));
    assert!(!bench.scanner.remove(mac(6)));
    assert_eq!(bench.scanner.add(SlaveSettings::poll(mac(5))), Err(NotAdded::AddressInUse));
    bench.run(millis(10));
    assert!(bench.scanner.slave(mac(5)).is_none());
    let asked = &bench.peers[0].asked;
    assert_eq!(asked[asked.len() - 2..], ["u4C030102", "u4C030101"]);
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
    bench.scanner.add(SlaveSettings::poll(mac(5))).unwrap();
    bench.run(millis(100));
    assert_eq!(bench.state(), SlaveState::Running);
}

#[test]
fn a_slave_that_does_not_hear_its_release_is_forgotten_all_the_same() {
    let mut bench = Bench::polling(Peer::new(5));
    bench.peer().on = false;
    bench.scanner.remove(mac(5));
    bench.run(secs(5));
    assert!(bench.scanner.slave(mac(5)).is_none());
    // One that was never there goes at once.
    bench.scanner.add(SlaveSettings::poll(mac(6))).unwrap();
    bench.scanner.remove(mac(6));
    assert!(bench.scanner.slave(mac(6)).is_none());
}

#[test]
fn an_explicit_connection_alone_is_kept_alive_and_its_loss_is_noticed() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    assert_eq!(bench.peer().asked, ["u4B03010100"]);
    bench.run(secs(30));
    let kept = bench.peer().was_asked("0E050101");
    assert!((11..=12).contains(&kept), "{kept} requests in 30 s");
    bench.peer().on = false;
    // It is asked twice after 2.5 s, and may take as long to answer.
    bench.run(millis(7_600));
    assert_eq!((bench.state(), bench.view().losses), (SlaveState::Absent, 1));
}

#[test]
fn a_slave_that_is_removed_while_its_allocation_is_under_way_is_released() {
    let mut peer = Peer::new(5);
    let mut bench = Bench::new(&[], &[SlaveSettings::explicit(mac(5))]);
    bench.run(secs(2) + millis(100));
    assert_eq!(bench.log.last().unwrap().1, "42E#404B03010100");
    peer.rule("4B0301", None);
    bench.peers.push(peer);
    bench.scanner.remove(mac(5));
    bench.run(millis(10));
    assert_eq!(bench.peer().asked, ["u4C030101"]);
    assert!(bench.scanner.slave(mac(5)).is_none());
}

#[test]
fn a_foreign_frame_with_an_extended_identifier_or_a_request_for_data_is_nothing() {
    use codewheel_station::can::{Frame, Identifier};
    let mut bench = Bench::polling(Peer::new(5));
    let before = bench.view().responses;
    let extended = Frame::new(Identifier::Extended(0x3C5), &[1, 2, 3, 4]).unwrap();
    let remote = Frame::remote(Identifier::Standard(0x3C5), 4).unwrap();
    for foreign in [extended, remote, frame("3C5#01")] {
        bench.scanner.handle(bench.now, Input::Frame(&foreign));
    }
    assert_eq!(bench.view().responses, before);
}
