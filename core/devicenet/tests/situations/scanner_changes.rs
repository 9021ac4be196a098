//! Change of state and cyclic connections as the scanner configures and acknowledges them.

use codewheel_devicenet::scanner::{
    ChangeSettings, PollSettings, SlaveSettings, SlaveState, Trigger,
};
use codewheel_station::Station;
use codewheel_station::can::Input;

use crate::bench::frame;
use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

#[test]
fn a_change_of_state_slave_is_allocated_and_configured_in_the_order_of_the_book() {
    let change = ChangeSettings {
        trigger: Trigger::ChangeOfState,
        acknowledged: true,
        expected_packet_rate: 500,
        production_inhibit: 10,
        assembly: Some(2),
    };
    let settings = SlaveSettings { change: Some(change), ..SlaveSettings::change_of_state(mac(5)) };
    let mut bench = Bench::running(Peer::new(5), settings);
    assert_eq!(
        bench.peer().asked,
        [
            "u4B03011100",
            "1005010C03",
            "1005040E20042402",
            "0E050407",
            "100504110A00",
            "10050409F401",
        ]
    );
    assert!(bench.peer().polls.is_empty());
}

#[test]
fn the_choice_octet_says_what_is_wanted() {
    let slave = mac(5);
    let unacknowledged = |settings: SlaveSettings| SlaveSettings {
        change: settings.change.map(|change| ChangeSettings { acknowledged: false, ..change }),
        ..settings
    };
    let poll = SlaveSettings::poll(slave).poll;
    assert_eq!(SlaveSettings::explicit(slave).choice(), 0x01);
    assert_eq!(SlaveSettings::poll(slave).choice(), 0x03);
    assert_eq!(SlaveSettings::change_of_state(slave).choice(), 0x11);
    assert_eq!(SlaveSettings::cyclic(slave, 100).choice(), 0x21);
    assert_eq!(unacknowledged(SlaveSettings::change_of_state(slave)).choice(), 0x51);
    assert_eq!(unacknowledged(SlaveSettings::cyclic(slave, 100)).choice(), 0x61);
    let both = SlaveSettings { poll, ..SlaveSettings::change_of_state(slave) };
    assert_eq!(both.choice(), 0x13);
}

#[test]
fn each_production_is_taken_and_acknowledged_with_an_empty_frame() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::change_of_state(mac(5)));
    bench.says("345#0A0B0C0D", &["42A#"]);
    assert_eq!(bench.view().change, [0x0A, 0x0B, 0x0C, 0x0D]);
    assert_eq!(bench.view().change_at, Some(bench.now));
    // Repeated, since the acknowledge got lost.
    bench.says("345#0A0B0C0D", &["42A#"]);
    assert_eq!(bench.view().changes, 2);
    // What is none of its productions is not acknowledged.
    bench.says("345#0A0B0C", &[]);
    bench.says("346#0A0B0C0D", &[]);
    assert_eq!(bench.view().latest().unwrap().1, [0x0A, 0x0B, 0x0C, 0x0D]);
}

#[test]
fn productions_without_acknowledge_get_none() {
    let change = SlaveSettings::cyclic(mac(5), 100).change;
    let change = change.map(|change| ChangeSettings { acknowledged: false, ..change });
    let settings = SlaveSettings { change, ..SlaveSettings::cyclic(mac(5), 100) };
    let mut bench = Bench::running(Peer::new(5), settings);
    assert_eq!(bench.peer().asked[0], "u4B03016100");
    bench.says("345#0A0B0C0D", &[]);
    assert_eq!(bench.view().changes, 1);
}

#[test]
fn the_first_production_may_overtake_the_response_to_the_rate() {
    let mut bench = Bench::new(&[Peer::new(5)], &[SlaveSettings::change_of_state(mac(5))]);
    bench.peers[0].rule("10050409", None);
    bench.run(millis(2_100));
    bench.says("345#0A0B0C0D", &["42A#"]);
    assert_eq!(bench.view().change, [0x0A, 0x0B, 0x0C, 0x0D]);
    assert_ne!(bench.state(), SlaveState::Running);
}

#[test]
fn a_slave_that_does_not_produce_for_four_times_its_rate_is_lost() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::change_of_state(mac(5)));
    // The first interval is ten seconds.
    bench.run(secs(9));
    assert_eq!(bench.view().losses, 0);
    for _ in 0..10 {
        bench.says("345#0A0B0C0D", &["42A#"]);
        bench.run(millis(3_900));
    }
    assert_eq!(bench.view().losses, 0);
    bench.run(millis(200));
    assert_eq!(bench.view().losses, 1);
}

#[test]
fn without_a_rate_the_slave_is_asked_whether_it_is_there() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::cyclic(mac(5), 0));
    bench.run(secs(20));
    assert_eq!(bench.view().losses, 0);
    assert!(bench.peer().was_asked("0E050101") >= 7);
    bench.peer().on = false;
    // It is asked twice after 2.5 s, and may take as long to answer.
    bench.run(millis(7_600));
    assert_eq!(bench.view().losses, 1);
}

#[test]
fn polled_and_change_of_state_data_are_told_apart() {
    let poll = Some(PollSettings { expected_packet_rate: 200, assembly: None });
    let settings = SlaveSettings { poll, ..SlaveSettings::change_of_state(mac(5)) };
    let mut bench = Bench::running(Peer::new(5), settings);
    assert_eq!(bench.peer().asked[0], "u4B03011300");
    let rates: Vec<_> = bench.peer().asked.iter().rev().take(2).cloned().collect();
    assert_eq!(rates, ["10050409E803", "10050209C800"]);
    bench.run(millis(50));
    bench.says("345#0A0B0C0D", &["42A#"]);
    assert_eq!(bench.view().input, [1, 2, 3, 4]);
    assert_eq!(bench.view().change, [0x0A, 0x0B, 0x0C, 0x0D]);
    assert_eq!(bench.view().latest().unwrap().1, [0x0A, 0x0B, 0x0C, 0x0D]);
    bench.run(millis(50));
    assert_eq!(bench.view().latest().unwrap().1, [1, 2, 3, 4]);
}

#[test]
fn a_fragmented_production_is_acknowledged_once_when_it_is_whole() {
    let peer = Peer::new(5).answers("0E050407", "8E 0A00");
    let mut bench = Bench::running(peer, SlaveSettings::change_of_state(mac(5)));
    bench.says("345#00 00010203040506", &[]);
    bench.says("345#81 070809", &["42A#"]);
    assert_eq!(bench.view().change, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
}

#[test]
fn an_acknowledge_goes_before_everything_else() {
    let poll = Some(PollSettings { expected_packet_rate: 200, assembly: None });
    let settings = SlaveSettings { poll, ..SlaveSettings::change_of_state(mac(5)) };
    let mut bench = Bench::running(Peer::new(5), settings);
    bench.request("0E640101").unwrap();
    bench.scanner.handle(bench.now, Input::Frame(&frame("345#0A0B0C0D")));
    assert_eq!(bench.collect()[0], "42A#");
}
