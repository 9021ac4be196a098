use codewheel_sim::can::{Event, Faults, Script, Wire};
use codewheel_station::can::{BitRate, Filter};

use super::*;

/// A second of talk between three stations on a bad wire, as a log.
fn log(seed: u64, faults: Faults) -> Vec<String> {
    let mut wire = Wire::new(BitRate::Kbit250, seed);
    wire.set_faults(faults);
    for identifier in [0x3C5_u16, 0x3C6, 0x3C7] {
        let mut script = Script::new();
        for tick in 0..100 {
            script.send(millis(10 * tick), frame(&format!("{identifier:03X}#{tick:02X}")));
        }
        wire.attach(format!("{identifier:X}"), script, &[Filter::ALL], false);
    }
    events(&mut wire, millis(1_000)).iter().map(ToString::to_string).collect()
}

#[test]
fn the_same_seed_gives_the_same_log_and_another_seed_another() {
    let faults = Faults { loss: 0.1, corruption: 0.1 };
    assert_eq!(log(1, faults), log(1, faults));
    assert_ne!(log(1, faults), log(2, faults));
    assert_eq!(log(1, Faults::default()), log(2, Faults::default()), "nothing is drawn");
}

#[test]
fn a_lost_frame_counts_as_sent_but_is_not_seen() {
    let mut wire = wire();
    wire.set_faults(Faults { loss: 1.0, corruption: 0.0 });
    let sender = wire.attach("sender", saying(millis(0), &["3C5#"]), &[], true);
    let receiver = wire.attach("receiver", Script::new(), &[Filter::ALL], true);
    let events = events(&mut wire, millis(1));
    assert_eq!(frames(&events), ["3C5#"]);
    let at = events[0].at();
    assert_eq!(events[1], Event::Lost { at, receiver, frame: frame("3C5#") });
    assert_eq!(wire.node(sender).unwrap().sent().len(), 1);
    assert!(wire.node(receiver).unwrap().received().is_empty());
    assert_eq!(wire.statistics().lost, 1);
}

#[test]
fn one_station_can_be_deaf_while_the_others_hear() {
    let mut wire = wire();
    let texts: Vec<String> = (0..20).map(|count| format!("3C5#{count:02X}")).collect();
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    wire.attach("sender", saying(millis(0), &texts), &[], true);
    let deaf = wire.attach("deaf", Script::new(), &[Filter::ALL], true);
    let sound = wire.attach("sound", Script::new(), &[Filter::ALL], true);
    wire.set_loss_at(deaf, Some(1.0));
    events(&mut wire, millis(10));
    assert!(wire.node(deaf).unwrap().received().is_empty());
    assert_eq!(wire.node(sound).unwrap().received().len(), 20);
    wire.set_loss_at(deaf, None);
    wire.attach("another", saying(millis(10), &["3C6#"]), &[], false);
    events(&mut wire, millis(11));
    assert_eq!(wire.node(deaf).unwrap().received().len(), 1);
}

#[test]
fn a_destroyed_frame_is_repeated_takes_time_and_reaches_everybody_in_the_end() {
    let mut wire = wire();
    wire.set_faults(Faults { loss: 0.0, corruption: 0.5 });
    let texts: Vec<String> = (0..50).map(|count| format!("3C5#{count:02X}")).collect();
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    wire.attach("sender", saying(millis(0), &texts), &[], true);
    let receiver = wire.attach("receiver", Script::new(), &[Filter::ALL], true);
    let events = events(&mut wire, millis(100));
    assert_eq!(frames(&events), texts, "each once, in order");
    assert_eq!(wire.node(receiver).unwrap().received().len(), 50);
    let statistics = wire.statistics();
    assert!((20..=100).contains(&statistics.corrupted), "{statistics:?}");
    let destroyed = events.windows(2).filter(|pair| matches!(pair[1], Event::Corrupted { .. }));
    for pair in destroyed {
        let lasted = pair[1].at().since(pair[0].at());
        assert!(lasted >= Duration::from_micros(2 * 21), "a bit and an error frame: {lasted}");
    }
}

#[test]
fn nonsense_probabilities_mean_the_nearest_sense() {
    let wild = Faults { loss: f64::NAN, corruption: -3.0 };
    assert_eq!(log(1, wild), log(1, Faults::default()));
    let all_lost = log(1, Faults { loss: 7.0, corruption: f64::NAN });
    assert!(all_lost.iter().any(|line| line.ends_with("lost by a receiver")));
}
