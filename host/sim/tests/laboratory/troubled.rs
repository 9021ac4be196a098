use codewheel_sim::can::{Drops, Script, Troubled};
use codewheel_station::Station;
use codewheel_station::can::Filter;

use super::*;

/// What reaches a listener of 200 frames that a station sends one millisecond apart.
fn heard(trouble: impl FnOnce(&mut Troubled<Script>), seed: u64) -> Vec<(u64, String)> {
    let mut script = Script::new();
    for tick in 0..200 {
        script.send(millis(tick), frame(&format!("3C5#{tick:02X}")));
    }
    let mut station = Troubled::new(script, seed);
    trouble(&mut station);
    let mut wire = Wire::new(BitRate::Kbit500, 1);
    let sender = wire.attach("sender", station, &[], true);
    let listener = Troubled::new(Script::new(), 0);
    let listener = wire.attach("listener", listener, &[Filter::ALL], true);
    let seen = events(&mut wire, millis(1_000));
    assert!(violations(&seen).is_empty(), "{seen:?}");
    let sender = wire.node(sender).unwrap();
    assert_eq!(sender.station().sent().len(), 200, "a dropped frame counts as sent");
    let received = wire.node(listener).unwrap().station().received();
    assert_eq!(received.len() as u64 + sender.dropped(), 200);
    received.iter().map(|(at, frame)| (at.as_nanos() / 1_000_000, frame.to_string())).collect()
}

fn dropping(probability: f64, count: Option<u32>) -> impl FnOnce(&mut Troubled<Script>) {
    move |station| station.set_drops(Some(Drops { probability, count }))
}

#[test]
fn without_trouble_a_station_is_what_it_is() {
    let heard = heard(|_| {}, 1);
    assert_eq!(heard.len(), 200);
    assert!((0..).zip(&heard).all(|(tick, (at, _))| *at == tick));
}

#[test]
fn dropped_frames_are_drawn_from_the_seed_or_counted() {
    let half = heard(dropping(0.5, None), 1);
    assert!((60..140).contains(&half.len()), "{}", half.len());
    assert_eq!(half, heard(dropping(0.5, None), 1));
    assert_ne!(half, heard(dropping(0.5, None), 2));
    let seven = heard(dropping(1.0, Some(7)), 1);
    assert_eq!(seven.len(), 193);
    assert_eq!(seven[0], (7, "3C5#07".to_owned()));
    assert!(heard(dropping(f64::NAN, None), 1).len() == 200);
}

#[test]
fn late_frames_keep_their_order_and_say_what_was_so_when_they_were_given() {
    let late = heard(|station| station.set_delay(Duration::from_millis(5)), 1);
    assert_eq!(late.len(), 200);
    assert!(
        (0..)
            .zip(&late)
            .all(|(tick, (at, text))| { *at == tick + 5 && *text == format!("3C5#{tick:02X}") })
    );
}

#[test]
fn a_station_that_never_falls_silent_is_dropped_without_end_and_holds_nobody_up() {
    let texts: Vec<String> = (0..100).map(|count| format!("3C5#{count:02X}")).collect();
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    let mut station = Troubled::new(saying(millis(0), &texts), 1);
    station.set_drops(Some(Drops { probability: 1.0, count: None }));
    assert_eq!(station.transmit(millis(0)), None);
    assert_eq!(station.dropped(), 64);
    assert_eq!(station.deadline(), Some(millis(0)), "the script is still overdue");
    assert_eq!(station.transmit(millis(1)), None);
    assert_eq!(station.dropped(), 100);
    assert_eq!(station.deadline(), None);
}
