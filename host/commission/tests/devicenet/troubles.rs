//! All that can go wrong, and what people are told.

use codewheel_commission::devicenet::{ScanSettings, listen, scan};
use codewheel_commission::{Kind, Seat, Session, Trouble};
use codewheel_devicenet::scanner::SlaveSettings;
use codewheel_station::Station;
use codewheel_station::can::Input;

use crate::wire_seat::{WireSeat, key, mac, millis, secs, unheard};

fn with_encoder() -> WireSeat {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    seat
}

/// The trouble is of this kind, says this, and what to do.
fn is(trouble: &Trouble, kind: Kind, came: &str) {
    assert_eq!(trouble.kind, kind, "{trouble}");
    assert!(trouble.came.contains(came), "{trouble}");
    assert!(!trouble.remedy.is_empty(), "{trouble}");
}

#[test]
fn nobody_at_all_is_no_bus() {
    let mut seat = WireSeat::new();
    let trouble = seat.open(5).unwrap_err();
    is(&trouble, Kind::Bus, "nobody acknowledges our frames");
    assert!(seat.wire.now().as_nanos() < secs(10).as_nanos());
    let trouble = scan(&mut seat, ScanSettings::default(), &mut unheard).unwrap_err();
    is(&trouble, Kind::Bus, "nobody acknowledges our frames");
}

#[test]
fn no_node_at_the_address_is_a_time_out() {
    let mut seat = with_encoder();
    let trouble = seat.open(6).unwrap_err();
    is(&trouble, Kind::TimeOut, "no node answered at MAC ID 6");
    seat.open(5).unwrap();
}

#[test]
fn our_own_address_is_none_to_open() {
    let trouble = with_encoder().open(62).unwrap_err();
    is(&trouble, Kind::Usage, "MAC ID 62 is our own");
}

#[test]
fn a_node_at_our_own_address_keeps_it() {
    let mut seat = WireSeat::new();
    let other = seat.encoder(62, "amg11-d29", "still");
    seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let trouble = seat.open(5).unwrap_err();
    is(&trouble, Kind::Bus, "another node has the MAC ID 62");
    let now = seat.wire.now();
    assert_eq!(seat.device(other).snapshot(now).lamp, codewheel_device::Lamp::GreenFlashing);
    // The second time it is known, and nothing is sent.
    let sent = seat.ours().len();
    is(&seat.open(5).unwrap_err(), Kind::Bus, "another node has the MAC ID 62");
    assert_eq!(seat.ours().len(), sent);
}

#[test]
fn of_two_nodes_at_one_address_the_first_is_opened_and_people_are_told() {
    let mut seat = with_encoder();
    seat.encoder(5, "amg11-d13", "still");
    seat.run(secs(2));
    let mut session = seat.open(5).unwrap();
    assert_eq!(session.identify().unwrap().models[0].model, "amg11-d29");
    let notices = session.take_notices();
    assert!(notices[0].starts_with("two nodes have MAC ID 5"), "{notices:?}");
    assert!(session.take_notices().is_empty());
}

#[test]
fn a_node_that_comes_to_our_address_later_is_told_so_and_the_session_goes_on() {
    let mut seat = with_encoder();
    seat.after(secs(4), |seat| {
        seat.encoder(62, "amg11-d29", "still");
    });
    let mut session = seat.open(5).unwrap();
    let end = session.now() + secs(4);
    while session.now() < end {
        session.value(&key("position")).unwrap();
    }
}

#[test]
fn a_device_that_dies_in_the_middle_is_a_time_out() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    // Somebody must acknowledge what nobody answers.
    seat.encoder(6, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    session.values().unwrap();
    drop(session);
    seat.after(millis(10), move |seat| drop(seat.wire.detach(id)));
    let mut session = seat.open(5).unwrap();
    let begun = session.now();
    is(&session.values().unwrap_err(), Kind::TimeOut, "does not answer any more");
    // It may take 2.5 s to answer; then it is asked twice whether it is there.
    assert!(session.now().since(begun) < secs(4));
    is(&session.values().unwrap_err(), Kind::TimeOut, "does not answer any more");
    is(&session.sample().unwrap_err(), Kind::TimeOut, "");
    let begun = session.now();
    let _ = session.release();
    assert!(session.now().since(begun) < secs(10));
}

#[test]
fn the_last_node_that_dies_leaves_nobody_and_still_every_wait_ends() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    session.value(&key("position")).unwrap();
    drop(session);
    seat.wire.detach(id);
    // Its address is known to be good; nobody acknowledges a frame any more.
    let begun = seat.wire.now();
    is(&seat.open(5).unwrap_err(), Kind::TimeOut, "MAC ID 5");
    assert!(seat.wire.now().since(begun) < secs(60));
}

#[test]
fn a_bus_off_of_ours_is_told_once_and_then_it_goes_on() {
    let mut seat = with_encoder();
    seat.after(secs(5), |seat| {
        let console = seat.console;
        seat.wire.bus_off(console, &mut |_| {});
    });
    let mut session = seat.open(5).unwrap();
    let trouble = loop {
        if let Err(trouble) = session.value(&key("position")) {
            break trouble;
        }
    };
    is(&trouble, Kind::Bus, "bus-off");
    // It checks its MAC ID anew, allocates the slave again, and answers come.
    session.value(&key("position")).unwrap();
}

#[test]
fn an_adapter_that_is_gone_is_said_to_be_gone() {
    let mut seat = with_encoder();
    let now = seat.wire.now();
    seat.station().handle(now, Input::Detached);
    is(&seat.open(5).unwrap_err(), Kind::Bus, "the way to the bus is gone");
    let now = seat.wire.now();
    seat.station().handle(now, Input::Attached);
    seat.open(5).unwrap();
}

#[test]
fn a_plug_that_is_pulled_while_we_listen_is_told_at_once() {
    let mut seat = with_encoder();
    seat.after(millis(500), |seat| {
        let now = seat.wire.now();
        seat.station().handle(now, Input::Detached);
    });
    seat.after(millis(700), |seat| {
        let now = seat.wire.now();
        seat.station().handle(now, Input::Attached);
    });
    let begun = seat.wire.now();
    let trouble = listen(&mut seat, secs(5), &mut unheard).unwrap_err();
    is(&trouble, Kind::Bus, "the way to the bus is gone");
    assert!(seat.wire.now().since(begun) < millis(600));
    // What was heard before is not enough any more: it listens anew before it speaks.
    seat.run(secs(1));
    let back = seat.wire.now();
    seat.open(5).unwrap();
    let ours = seat.frames.iter().find(|(_, from, _)| *from == seat.console).expect("it spoke");
    assert!(ours.0.since(back) >= millis(200), "{} after {back}", ours.0);
}

#[test]
fn a_port_that_is_lost_for_good_is_told_with_what_was_tried() {
    let mut seat = with_encoder();
    seat.is_lost = true;
    let trouble = seat.open(5).unwrap_err();
    is(&trouble, Kind::Bus, "slcan:127.0.0.1:4001 was lost");
    assert_eq!(trouble.tried, "open the device at MAC ID 5");
}

#[test]
fn a_slave_that_another_master_takes_in_between_is_told_to_be_his() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    session.value(&key("position")).unwrap();
    drop(session);
    // It is switched off and on, and a master that has waited for it is quicker than we are.
    seat.master(1, SlaveSettings::poll(mac(5)));
    let now = seat.wire.now();
    let scanner = seat.station().scanner_mut().unwrap();
    scanner.remove(mac(5));
    seat.run(secs(1));
    seat.device(id).power_cycle(now);
    seat.run(secs(6));
    is(&seat.open(5).unwrap_err(), Kind::Refused, "belongs to the master at MAC ID 1");
}

#[test]
fn whoever_is_interrupted_leaves_no_slave_allocated() {
    // What is sent to MAC ID 5: 4B allocates, 4C releases.
    let count = |seat: &WireSeat, service: &str| {
        let to_five = |frame: &&String| frame.starts_with("42E#") || frame.starts_with("42C#");
        seat.ours().iter().filter(to_five).filter(|frame| frame.get(6..8) == Some(service)).count()
    };
    let scans = |seat: &mut WireSeat| {
        scan(seat, ScanSettings::default(), &mut unheard).map(drop).unwrap_err()
    };
    let opens = |seat: &mut WireSeat| seat.open(5).map(drop).unwrap_err();
    for attempt in [scans as fn(&mut WireSeat) -> Trouble, opens] {
        for late in [0, 2, 5] {
            let mut seat = with_encoder();
            seat.interrupt_after_allocation(5, late);
            let trouble = attempt(&mut seat);
            assert_eq!(trouble.kind, Kind::Bus, "{trouble}");
            assert_eq!(count(&seat, "4B"), 1);
            assert_eq!(count(&seat, "4C"), 1, "{:#?}", seat.ours());
        }
    }
}
