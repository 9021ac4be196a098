//! Somebody wants an end, at any moment: what was allocated is released all the same.

use std::rc::Rc;

use codewheel_commission::devicenet::{ScanSettings, scan};
use codewheel_commission::{Kind, Session, Trouble};

use crate::wire_seat::{WireSeat, key, millis, secs, unheard};

/// Interrupts `act` after each number of turns it has, until it is done before. How often it was
/// interrupted, and in how many of these the slave was ours by then.
fn at_every_turn(mut act: impl FnMut(&mut WireSeat) -> Result<(), Trouble>) -> (u32, u32) {
    let mut ours = 0;
    for turns in 0..2_000 {
        let mut seat = WireSeat::new();
        seat.encoder(5, "amg11-d29", "still");
        seat.run(secs(3));
        seat.turns_left.set(Some(turns));
        let Err(trouble) = act(&mut seat) else { return (turns, ours) };
        assert_eq!((trouble.kind, trouble.came.as_str()), (Kind::Bus, "an end was wanted before"));
        let allocates = |frame: &String| frame.starts_with("42E#") && frame.contains("4B0301");
        ours += u32::from(seat.ours().iter().any(allocates));
        seat.turns_left.set(None);
        seat.run(millis(100));
        assert_eq!(seat.held(5), 0, "after {turns} turns: {:#?}", seat.ours());
    }
    panic!("it never ends");
}

#[test]
fn an_end_while_a_device_is_opened_releases_it() {
    let (interrupted, ours) = at_every_turn(|seat| seat.open(5).map(|_| ()));
    assert!(interrupted > ours && ours > 20, "{ours} of {interrupted}");
}

#[test]
fn an_end_while_the_bus_is_scanned_releases_who_is_asked() {
    let (interrupted, ours) =
        at_every_turn(|seat| scan(seat, ScanSettings::default(), &mut unheard).map(|_| ()));
    assert!(interrupted > ours && ours > 20, "{ours} of {interrupted}");
}

#[test]
fn an_end_while_a_device_is_read_leaves_nothing_but_what_its_release_gives_back() {
    let (interrupted, ours) = at_every_turn(|seat| {
        let end = Rc::clone(&seat.turns_left);
        let mut session = seat.open(5)?;
        let read = session.sample().and_then(|_| session.value(&key("poll-assembly")));
        end.set(None);
        session.release()?;
        read.map(|_| ())
    });
    assert!(interrupted > ours && ours > 60, "{ours} of {interrupted}");
}
