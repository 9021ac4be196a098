//! Finding out who is there.

use codewheel_commission::devicenet::{Console, ScanSettings, scan};
use codewheel_commission::{Kind, Owner, Progress, Role, Seat};
use codewheel_devicenet::scanner::SlaveSettings;

use crate::toy::Toy;
use crate::wire_seat::{WireSeat, mac, secs, unheard};

#[test]
fn each_node_is_named_with_its_lamp() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    seat.encoder(63, "hmg11-d13", "still");
    seat.toy(Toy::new(9));
    seat.run(secs(3));
    let survey = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    let found: Vec<_> = survey
        .nodes
        .iter()
        .map(|node| {
            let identity = node.identity.as_ref().expect("an identity");
            let models: Vec<&str> = identity.models.iter().map(|it| it.model).collect();
            (node.address, identity.serial.unwrap(), identity.firmware.is_some(), models)
        })
        .collect();
    assert_eq!(
        found,
        [
            (5, 1_005, true, vec!["amg11-d29"]),
            (9, 42, false, vec![]),
            (63, 1_063, true, vec!["hmg11-d13"])
        ]
    );
    for node in &survey.nodes {
        assert_eq!((node.role, node.owner), (Role::Slave, Some(Owner::Nobody)));
        assert_eq!((node.lamp, node.state.as_str()), (Some("green flashing"), "on-line, free"));
    }
    assert!(survey.remarks.is_empty(), "{:?}", survey.remarks);
}

#[test]
fn a_full_segment_is_scanned_and_every_node_is_free_again() {
    let mut seat = WireSeat::new();
    let ids: Vec<_> = (0..64)
        .filter(|address| *address != 62)
        .map(|address| seat.encoder(address, "amg11-d29", "still"))
        .collect();
    seat.run(secs(4));
    let mut told: Vec<Progress> = Vec::new();
    let begun = seat.wire.now();
    let survey =
        scan(&mut seat, ScanSettings::default(), &mut |progress| told.push(progress)).unwrap();
    assert_eq!(survey.nodes.len(), 63);
    assert!(survey.nodes.iter().all(|node| node.identity.is_some()));
    let percents: Vec<u8> = told.iter().map(|progress| progress.percent).collect();
    assert!(percents.is_sorted() && percents.last() == Some(&100), "{percents:?}");
    assert!(told.iter().any(|progress| progress.doing == "asking MAC ID 17"));
    for id in ids {
        assert_eq!(seat.device(id).server().master(), None);
    }
    let took = seat.wire.now().since(begun);
    assert!(took < secs(15), "{took:?}");
}

#[test]
fn a_node_that_is_just_being_switched_on_is_told_as_such() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    // In the middle of its check when the last address is asked.
    seat.after(secs(4), |seat| {
        seat.encoder(6, "amg11-d29", "still");
    });
    let survey = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    let node = survey.nodes.iter().find(|node| node.address == 6).expect("it was heard");
    assert_eq!((node.lamp, node.state.as_str()), (Some("off"), "checks its MAC ID"));
    seat.run(secs(3));
    let survey = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    assert_eq!(survey.nodes.len(), 2);
    assert!(survey.nodes.iter().all(|node| node.identity.is_some()));
}

#[test]
fn a_node_that_goes_away_while_it_is_asked_does_not_end_the_scan() {
    let mut seat = WireSeat::new();
    let first = seat.encoder(5, "amg11-d29", "still");
    seat.encoder(6, "amg11-d29", "still");
    seat.run(secs(3));
    // It answers the search, and is unplugged before its turn comes.
    seat.after(secs(4), move |seat| drop(seat.wire.detach(first)));
    let survey = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    let states: Vec<_> =
        survey.nodes.iter().map(|node| (node.address, node.identity.is_some())).collect();
    assert_eq!(states, [(5, false), (6, true)]);
}

#[test]
fn a_damaged_memory_shows_in_the_state() {
    let mut seat = WireSeat::new();
    seat.damaged_encoder(5);
    seat.run(secs(3));
    let survey = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    assert_eq!(survey.nodes[0].state, "on-line, free, minor recoverable fault");
}

#[test]
fn a_scan_at_another_address_asks_all_the_others() {
    let mut seat = WireSeat::new();
    seat.encoder(62, "amg11-d29", "still");
    seat.run(secs(3));
    let settings = ScanSettings { mac: mac(1), ..ScanSettings::default() };
    let survey = scan(&mut seat, settings, &mut unheard).unwrap();
    assert_eq!(survey.nodes[0].address, 62);
    // With the default the address is taken, and no frame but the check is sent.
    let mut seat = WireSeat::new();
    seat.encoder(62, "amg11-d29", "still");
    seat.run(secs(3));
    let trouble = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus);
}

#[test]
fn a_forced_scan_finds_a_master_that_gives_no_address() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    let master = seat.master(1, SlaveSettings::poll(mac(5)));
    seat.run(secs(6));
    *seat.station() = Console::new();
    let gentle = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap();
    assert_eq!(gentle.nodes.iter().map(|node| node.address).collect::<Vec<_>>(), [5]);
    let settings = ScanSettings { forced: true, ..ScanSettings::default() };
    let forced = scan(&mut seat, settings, &mut unheard).unwrap();
    let [found, slave] = forced.nodes.as_slice() else { panic!("{forced:#?}") };
    assert_eq!((found.address, found.role), (1, Role::Unknown));
    assert!(found.state.contains("perhaps a master"), "{}", found.state);
    assert_eq!(slave.owner, Some(Owner::Somebody));
    let trouble = seat.open(5).unwrap_err();
    assert!(trouble.remedy.contains("which may be the node at 1"), "{}", trouble.remedy);
    assert_eq!(seat.scanner(master).slave(mac(5)).unwrap().losses, 0);
}
