//! Watching an encoder that is ours to poll.

use codewheel_commission::{Kind, Reading, Session};

use crate::wire_seat::{WireSeat, key, number, secs};

fn turning(text: &str) -> WireSeat {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", text);
    seat.run(secs(3));
    seat
}

#[test]
fn each_position_is_newer_than_the_one_before() {
    let mut seat = turning("turn rpm=60");
    let mut session = seat.open(5).unwrap();
    let samples: Vec<_> = (0..50).map(|_| session.sample().unwrap()).collect();
    for pair in samples.windows(2) {
        assert!(pair[1].at > pair[0].at);
        // 8192 steps a second are 82 in 10 ms; flags that are asked for may cost a cycle.
        let moved = pair[1].position - pair[0].position;
        assert!((60..200).contains(&moved), "{moved}");
        assert_eq!(pair[1].cycle, Some(pair[1].at.since(pair[0].at).as_nanos()));
    }
}

#[test]
fn the_encoder_stays_ours_while_polls_begin_and_end() {
    let mut seat = turning("still");
    let mut session = seat.open(5).unwrap();
    session.sample().unwrap();
    session.value(&key("poll-assembly")).unwrap();
    session.sample().unwrap();
    drop(session);
    let ours = seat.ours();
    let of_explicit = |frame: &&String| {
        frame.starts_with("42E#") || frame.contains("4B030101") || frame.contains("4B030103")
    };
    let seen: Vec<&String> = ours.iter().filter(of_explicit).collect();
    // Allocated once; then polls are released, which it hears on either port.
    let [allocated, released] = seen.as_slice() else { panic!("{seen:#?}") };
    assert!(allocated.ends_with("4B0301013E") && released.ends_with("4C030102"), "{seen:#?}");
    assert_eq!(seat.held(5), 3);
}

#[test]
fn flags_are_asked_for_where_polls_do_not_bring_them() {
    let mut seat = turning("still");
    let mut session = seat.open(5).unwrap();
    for _ in 0..200 {
        let sample = session.sample().unwrap();
        assert_eq!((sample.alarm, sample.warning), (Some(false), Some(false)));
    }
    drop(session);
    let asked = seat.ours().iter().filter(|frame| frame.contains("0E040203")).count();
    assert!((2..8).contains(&asked), "twice a second, not with each position: {asked}");
}

#[test]
fn watching_changes_nothing_in_the_memory_of_the_device() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    session.sample().unwrap();
    session.release().unwrap();
    drop(session);
    let now = seat.wire.now();
    assert_eq!(seat.device(id).snapshot(now).writes, 0);
}

#[test]
fn flags_come_with_the_position_where_the_device_has_kept_that() {
    let mut seat = turning("still angle=9");
    let mut session = seat.open(5).unwrap();
    session.write(&key("poll-assembly"), &Reading::Number(2)).unwrap();
    let sample = session.sample().unwrap();
    assert_eq!((sample.position, sample.alarm), (9, Some(false)));
    drop(session);
    let asked = seat.ours().iter().filter(|frame| frame.contains("0E040203")).count();
    assert_eq!(asked, 0);
}

#[test]
fn no_position_from_before_a_change_is_given_after_it() {
    let mut seat = turning("still angle=500");
    let mut session = seat.open(5).unwrap();
    session.sample().unwrap();
    for position in 0..20 {
        session.preset(position).unwrap();
        assert_eq!(session.sample().unwrap().position, position);
        // Polls go on meanwhile, and what they bring last is from before the reset.
        for _ in 0..5 {
            session.identify().unwrap();
        }
        session.reset().unwrap();
        assert_eq!(session.sample().unwrap().position, 500);
    }
}

#[test]
fn values_are_read_and_written_while_it_is_watched() {
    let mut seat = turning("still angle=500");
    let mut session = seat.open(5).unwrap();
    assert_eq!(session.sample().unwrap().position, 500);
    session.preset(7).unwrap();
    assert_eq!(session.sample().unwrap().position, 7);
    session.write(&key("steps-per-turn"), &Reading::Number(4_096)).unwrap();
    assert_eq!(session.sample().unwrap().position, 250);
    // The produced path can be read and written only without the poll connection.
    session.write(&key("poll-assembly"), &Reading::Number(2)).unwrap();
    assert_eq!(session.sample().unwrap().position, 250);
    assert_eq!(number(&mut session, "poll-assembly"), 2);
}

#[test]
fn an_encoder_that_dies_while_it_is_watched_is_a_time_out() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.encoder(6, "amg11-d29", "still");
    seat.run(secs(3));
    seat.after(secs(5), move |seat| drop(seat.wire.detach(id)));
    let mut session = seat.open(5).unwrap();
    let trouble = loop {
        if let Err(trouble) = session.sample() {
            break trouble;
        }
    };
    assert_eq!(trouble.kind, Kind::TimeOut);
    assert!(session.now().as_nanos() < secs(20).as_nanos());
}
