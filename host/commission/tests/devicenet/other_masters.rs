//! Slaves that belong to others.

use codewheel_commission::devicenet::{Console, Eavesdropper, ScanSettings, scan};
use codewheel_commission::{Kind, Owner, Role, Seat};
use codewheel_devicenet::scanner::{SlaveSettings, SlaveState};
use codewheel_sim::can::NodeId;

use crate::wire_seat::{WireSeat, mac, millis, secs, unheard};

/// Encoder 5, polled by master 1 since before the console listened, or not.
fn polled(is_known: bool) -> (WireSeat, NodeId) {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "turn rpm=60 angle=1000");
    let master = seat.master(1, SlaveSettings::poll(mac(5)));
    seat.run(secs(6));
    if !is_known {
        *seat.station() = Console::new();
    }
    (seat, master)
}

fn is_left_alone(seat: &mut WireSeat, master: NodeId) {
    let slave = seat.scanner(master).slave(mac(5)).expect("its slave");
    assert_eq!((slave.state, slave.losses), (SlaveState::Running, 0));
    assert!(slave.polls - slave.responses <= 1);
    let allocated =
        seat.ours().iter().any(|frame| frame.starts_with("42E#") && frame.contains("4B0301"));
    assert!(!allocated, "nobody may try to allocate it: {:#?}", seat.ours());
}

#[test]
fn a_slave_of_another_master_is_left_alone_and_its_master_is_named() {
    let (mut seat, master) = polled(true);
    let trouble = seat.open(5).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert_eq!(trouble.came, "the slave at MAC ID 5 belongs to the master at MAC ID 1");
    assert!(trouble.remedy.contains("let the master at 1 give it up"), "{}", trouble.remedy);
    assert_eq!(seat.ours(), [""; 0], "not a frame was needed for that");
    is_left_alone(&mut seat, master);
}

#[test]
fn a_master_whose_address_cannot_be_known_is_looked_for_among_those_who_are_no_slaves() {
    let (mut seat, master) = polled(false);
    let trouble = seat.open(5).unwrap_err();
    assert!(trouble.came.ends_with("belongs to another master, whose address was not heard"));
    assert!(trouble.remedy.contains("let its master give it up:"), "{}", trouble.remedy);
    // Now the master asks another slave something: it may be the one.
    seat.encoder(6, "amg11-d13", "still");
    seat.run(secs(3));
    seat.scanner(master).add(SlaveSettings::explicit(mac(6))).unwrap();
    seat.run(secs(3));
    let trouble = seat.open(5).unwrap_err();
    assert!(trouble.remedy.contains("which may be the node at 1"), "{}", trouble.remedy);
    is_left_alone(&mut seat, master);
}

#[test]
fn a_slave_whose_master_is_quiet_says_itself_that_it_is_not_free() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    // Cyclic at a minute: nothing is heard of it.
    let settings = SlaveSettings {
        change: SlaveSettings::cyclic(mac(5), 60_000).change,
        ..SlaveSettings::explicit(mac(5))
    };
    let master = seat.master(1, settings);
    seat.run(secs(20));
    *seat.station() = Console::new();
    let trouble = seat.open(5).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert!(trouble.came.contains("belongs to another master"), "{}", trouble.came);
    assert_eq!(seat.scanner(master).slave(mac(5)).unwrap().losses, 0);
}

#[test]
fn a_scan_names_owners_and_allocates_only_what_is_free() {
    let (mut seat, master) = polled(true);
    seat.encoder(9, "amg81-d13", "still");
    seat.run(secs(3));
    let survey = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    let addresses: Vec<u8> = survey.nodes.iter().map(|node| node.address).collect();
    assert_eq!(addresses, [1, 5, 9]);
    assert_eq!(survey.nodes[0].role, Role::Master);
    assert_eq!(survey.nodes[1].owner, Some(Owner::Master(1)));
    assert_eq!((&survey.nodes[1].identity, survey.nodes[1].lamp), (&None, Some("green")));
    assert_eq!(survey.nodes[2].owner, Some(Owner::Nobody));
    assert!(survey.nodes[2].identity.is_some());
    is_left_alone(&mut seat, master);
}

#[test]
fn what_another_master_polls_can_be_watched_without_a_word() {
    let (mut seat, master) = polled(false);
    let mut watch = Eavesdropper::new(&mut seat, mac(5));
    let first = watch.sample().unwrap();
    let second = watch.sample().unwrap();
    assert_eq!(watch.owner(), Some(Owner::Somebody));
    assert!(second.at > first.at);
    // 60 turns a minute are 8192 steps a second, and 164 in 20 ms.
    let moved = second.position - first.position;
    assert!((150..180).contains(&moved), "{moved}");
    let third = watch.sample().unwrap();
    let cycle = third.cycle.expect("a cycle");
    assert!(cycle.abs_diff(millis(20).as_nanos()) < 1_000_000, "{cycle} ns");
    assert_eq!(third.alarm, None, "four octets carry no flags");
    assert_eq!(seat.ours(), [""; 0]);
    is_left_alone(&mut seat, master);
}

#[test]
fn flags_are_heard_where_the_master_has_chosen_them() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still angle=77");
    let mut settings = SlaveSettings::poll(mac(5));
    settings.poll = settings
        .poll
        .map(|poll| codewheel_devicenet::scanner::PollSettings { assembly: Some(2), ..poll });
    seat.master(1, settings);
    seat.run(secs(6));
    let sample = Eavesdropper::new(&mut seat, mac(5)).sample().unwrap();
    assert_eq!((sample.position, sample.alarm, sample.warning), (77, Some(false), Some(false)));
}

#[test]
fn watching_ends_when_the_master_stops() {
    let (mut seat, master) = polled(true);
    seat.after(secs(2), move |seat| drop(seat.wire.detach(master)));
    let mut watch = Eavesdropper::new(&mut seat, mac(5));
    let trouble = loop {
        if let Err(trouble) = watch.sample() {
            break trouble;
        }
    };
    assert_eq!(trouble.kind, Kind::TimeOut);
    assert_eq!(watch.owner(), None);
}

#[test]
fn a_slave_is_free_once_its_master_has_gone() {
    let (mut seat, master) = polled(true);
    seat.wire.detach(master);
    seat.run(secs(12));
    seat.open(5).unwrap();
}
