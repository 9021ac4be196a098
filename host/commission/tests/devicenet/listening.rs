//! What is heard before anything is said.

use codewheel_commission::devicenet::{Console, LISTEN_TIME, listen};
use codewheel_commission::{Owner, Role, Seat};
use codewheel_devicenet::scanner::{ChangeSettings, SlaveSettings, Trigger};
use codewheel_sim::can::parse_frame;
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Instant, Station};

use crate::wire_seat::{WireSeat, mac, millis, secs, unheard};

/// A console that hears `frames`, 10 ms from one to the next.
fn hearing(frames: &[&str]) -> (Console, Instant) {
    let mut console = Console::new();
    let mut now = Instant::ZERO;
    console.advance(now);
    for text in frames {
        now += millis(10);
        console.handle(now, Input::Frame(&frame(text)));
    }
    (console, now)
}

fn frame(text: &str) -> Frame {
    parse_frame(text).expect("a frame as candump writes it")
}

#[test]
fn nothing_is_sent_in_the_first_second_whatever_is_asked_for() {
    for wanted in ["scan", "open"] {
        let mut seat = WireSeat::new();
        seat.encoder(5, "amg11-d29", "still");
        match wanted {
            "scan" => {
                let settings = codewheel_commission::devicenet::ScanSettings::default();
                codewheel_commission::devicenet::scan(&mut seat, settings, &mut unheard).unwrap();
            }
            _ => drop(seat.open(5).unwrap()),
        }
        let ours = seat.frames.iter().filter(|(_, from, _)| *from == seat.console);
        let first = ours.map(|(at, _, _)| *at).min().expect("it spoke in the end");
        assert!(first >= Instant::ZERO + LISTEN_TIME, "{wanted}: {first}");
    }
}

#[test]
fn listening_alone_never_sends() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "turn rpm=60");
    seat.master(1, SlaveSettings::poll(mac(5)));
    let survey = listen(&mut seat, secs(10), &mut unheard).unwrap();
    assert_eq!(seat.ours(), [""; 0]);
    assert!(!survey.nodes.is_empty());
}

#[test]
fn a_master_and_its_slave_are_told_apart_with_their_cycle() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    seat.master(1, SlaveSettings::poll(mac(5)));
    let survey = listen(&mut seat, secs(8), &mut unheard).unwrap();
    let [master, slave] = survey.nodes.as_slice() else { panic!("{survey:#?}") };
    assert_eq!((master.address, master.role, master.owner), (1, Role::Master, None));
    assert_eq!((slave.address, slave.role), (5, Role::Slave));
    assert_eq!((slave.owner, slave.lamp), (Some(Owner::Master(1)), Some("green")));
    assert!(slave.state.starts_with("exchanges data, 20.0"), "{}", slave.state);
    let now = seat.now();
    let heard = seat.station().overheard().node(mac(5));
    assert!(heard.polls.goes_on(now) && heard.polls.count > 100);
    assert!(heard.polls.shortest <= heard.polls.last && heard.polls.last <= heard.polls.longest);
}

#[test]
fn a_master_that_was_there_before_us_has_no_address_and_candidates_are_named() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    seat.master(1, SlaveSettings::poll(mac(5)));
    seat.run(secs(6));
    // As if the console had just been plugged in.
    *seat.station() = Console::new();
    let survey = listen(&mut seat, secs(2), &mut unheard).unwrap();
    let [slave] = survey.nodes.as_slice() else { panic!("{survey:#?}") };
    assert_eq!((slave.address, slave.owner), (5, Some(Owner::Somebody)));
}

#[test]
fn an_allocation_that_was_heard_names_the_allocator() {
    // Master 1 allocates slave 5, which does it; master 2 would like to, and is refused.
    let (console, now) = hearing(&["42E#014B03010301", "42B#01CB00"]);
    assert_eq!(console.owner(now, mac(5)), Some(Owner::Master(1)));
    let (console, now) =
        hearing(&["42E#014B03010301", "42B#01CB00", "42E#024B03010302", "42B#02940C01"]);
    assert_eq!(console.owner(now, mac(5)), Some(Owner::Master(1)));
    assert_eq!(console.overheard().node(mac(2)).role(), Role::Master);
    // Nobody owns a slave that has refused.
    let (console, now) = hearing(&["42E#024B03010302", "42B#02940C01"]);
    assert_eq!(console.owner(now, mac(5)), None);
}

#[test]
fn a_slave_that_was_released_belongs_to_nobody() {
    let (console, now) = hearing(&["42E#014B03010301", "42B#01CB00", "42E#014C030103", "42B#01CC"]);
    assert_eq!(console.owner(now, mac(5)), None);
}

#[test]
fn an_owner_that_falls_silent_is_forgotten_in_time() {
    let (console, now) = hearing(&["42E#014B03010301", "42B#01CB00"]);
    assert_eq!(console.owner(now + secs(9), mac(5)), Some(Owner::Master(1)));
    assert_eq!(console.owner(now + secs(11), mac(5)), None);
    let (console, now) = hearing(&["42D#", "3C5#00100000", "42D#", "3C5#00100000"]);
    assert_eq!(console.owner(now + secs(1), mac(5)), Some(Owner::Somebody));
    assert_eq!(console.owner(now + secs(3), mac(5)), None);
}

#[test]
fn an_io_connection_that_has_ended_before_the_explicit_one_shows_in_the_lamp() {
    let mut seat = WireSeat::new();
    for text in ["42E#014B03010301", "42B#01CB00", "42D#", "3C5#00100000", "42D#", "3C5#00100000"] {
        let now = seat.now();
        seat.station().handle(now, Input::Frame(&frame(text)));
        seat.run(millis(10));
    }
    let lamp = |seat: &mut WireSeat| {
        let survey = listen(seat, millis(1), &mut unheard).unwrap();
        survey.nodes.iter().find(|node| node.address == 5).expect("the slave").lamp
    };
    assert_eq!(lamp(&mut seat), Some("green"));
    seat.run(secs(5));
    assert_eq!(lamp(&mut seat), Some("red flashing"));
}

#[test]
fn a_search_for_nodes_makes_nobody_a_slave() {
    // Another console asks the unconnected port of 5 for its vendor, and gets 02/03.
    let (console, now) = hearing(&["42E#3E0E010101", "42B#3E940203"]);
    assert_eq!(console.owner(now, mac(5)), None);
    assert_eq!(console.overheard().node(mac(5)).role(), Role::Slave);
}

#[test]
fn a_bit_strobe_names_its_master_and_a_heartbeat_its_sender() {
    let (console, _) = hearing(&["408#0000000000000000", "42B#05CD010003020000"]);
    assert_eq!(console.overheard().node(mac(1)).role(), Role::Master);
    let heartbeat = console.overheard().node(mac(5)).heartbeat.expect("a heartbeat");
    assert_eq!((heartbeat.state, heartbeat.flags), (3, 2));
    assert_eq!(console.overheard().node(mac(5)).role(), Role::Unknown, "it was not an answer");
}

#[test]
fn two_nodes_that_want_one_address_are_a_remark() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    seat.encoder(5, "amg11-d29", "still");
    let survey = listen(&mut seat, secs(2), &mut unheard).unwrap();
    assert_eq!(survey.remarks.len(), 1, "{:?}", survey.remarks);
    assert!(survey.remarks[0].starts_with("two nodes have MAC ID 5"), "{}", survey.remarks[0]);
}

#[test]
fn change_of_state_and_cyclic_slaves_are_heard_as_well() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    let change = ChangeSettings {
        trigger: Trigger::Cyclic,
        acknowledged: false,
        expected_packet_rate: 50,
        production_inhibit: 0,
        assembly: None,
    };
    let settings = SlaveSettings { change: Some(change), ..SlaveSettings::explicit(mac(5)) };
    seat.master(1, settings);
    let survey = listen(&mut seat, secs(6), &mut unheard).unwrap();
    let slave = survey.nodes.iter().find(|node| node.address == 5).expect("the encoder");
    assert_eq!(slave.owner, Some(Owner::Master(1)));
    assert!(slave.state.starts_with("exchanges data, 50.0"), "{}", slave.state);
}

#[test]
fn a_bus_on_which_nobody_speaks_is_said_to_be_such() {
    let mut seat = WireSeat::new();
    let mut told = Vec::new();
    let survey = listen(&mut seat, secs(1), &mut |progress| told.push(progress.percent)).unwrap();
    assert!(survey.nodes.is_empty() && survey.remarks.len() == 1);
    assert_eq!(told.last(), Some(&100));
    assert!(told.is_sorted());
}

#[test]
fn whatever_is_heard_harms_nobody() {
    let mut random = 1_u64;
    let mut next = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        random >> 33
    };
    let mut console = Console::new();
    let mut now = Instant::ZERO;
    for _ in 0..200_000 {
        now += millis(next() % 40);
        let octets: Vec<u8> = (0..next() % 9)
            .map(|_| {
                [0x4B, 0x4C, 3, 1, 0x94, 0xCB, 0xCC, 0xCD, 5, next() as u8][next() as usize % 10]
            })
            .collect();
        console.handle(now, Input::Frame(&Frame::standard(next() as u16, &octets)));
    }
    assert_eq!(console.overheard().frames(), 200_000);
    let listened = console.overheard().nodes().count();
    assert_eq!(listened, 64, "the noise has touched every address");
    assert_eq!(console.transmit(now), None);
}
