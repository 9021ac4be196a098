use codewheel_sim::rs485::Faults;

use super::toys::Toy;
use super::*;

/// What `listeners` stations hear of one telegram of 100 zeros on a bad line, and what happened.
fn hundred_zeros(seed: u64, faults: Faults) -> (Vec<Script>, Vec<Event>) {
    let mut wire = Wire::new(seed);
    wire.set_faults(faults);
    let said = Transmission::new(&[0; 100]).unwrap();
    wire.attach("sender", listener().sending(micros(0), said), Attachment::default());
    let ids = [(); 3].map(|()| wire.attach("listener", listener(), Attachment::default()));
    let events = events(&mut wire, millis(5));
    (ids.iter().map(|&id| wire.node(id).unwrap().clone()).collect(), events)
}

#[test]
fn a_broken_character_is_broken_for_all_and_the_others_are_not() {
    let (scripts, events) = hundred_zeros(1, Faults { broken: 0.3, ..Faults::default() });
    let count = broken(&scripts[0]);
    assert!((15..45).contains(&count), "{count}");
    assert_eq!(scripts[0].octets(), vec![0; 100 - count]);
    assert!(scripts.iter().all(|script| script.heard() == scripts[0].heard()));
    let told = |event: &&Event| matches!(event, Event::BrokenCharacter { .. });
    assert_eq!(events.iter().filter(told).count(), count);
    assert!(matches!(events.last(), Some(Event::Telegram { intact: false, .. })));
}

#[test]
fn two_bits_turned_over_leave_the_parity_good_and_are_shown() {
    let (scripts, events) = hundred_zeros(1, Faults { flipped: 1.0, ..Faults::default() });
    let heard = scripts[0].octets();
    assert_eq!(heard.len(), 100);
    assert!(heard.iter().all(|octet| octet.count_ones() == 2), "{heard:02X?}");
    let carried = |event: &Event| match event {
        Event::Flipped { sent: 0, carried, .. } => Some(*carried),
        _ => None,
    };
    assert_eq!(events.iter().filter_map(carried).collect::<Vec<_>>(), heard);
    assert!(matches!(events.last(), Some(Event::Telegram { intact: false, .. })));
}

#[test]
fn a_pause_falls_between_two_characters_and_shifts_all_that_follow() {
    for seed in 0..50 {
        let (scripts, events) = hundred_zeros(seed, Faults { pause: 1.0, ..Faults::default() });
        let [at, bits] = events
            .iter()
            .find_map(|event| match event {
                Event::Pause { at, bits, .. } => Some([at.as_nanos(), u64::from(*bits)]),
                _ => None,
            })
            .unwrap();
        assert!((11..=66).contains(&bits));
        let heard = scripts[0].heard();
        assert_eq!(heard.len(), 100);
        let before = heard.iter().filter(|(end, _)| end.as_nanos() <= at).count() as u64;
        assert!((1..100).contains(&before));
        for ((end, _), place) in heard.iter().zip(1..) {
            let pause = if place > before { bits } else { 0 };
            assert_eq!(*end, bits_after(micros(0), (11 * place + pause) as u32));
        }
    }
}

#[test]
fn a_telegram_of_one_character_has_no_room_for_a_pause() {
    let (mut wire, [_, ears]) = line([("sender", saying(micros(0), "E5")), ("ears", listener())]);
    wire.set_faults(Faults { pause: 1.0, ..Faults::default() });
    let seen = events(&mut wire, millis(1));
    assert!(matches!(seen.last(), Some(Event::Telegram { intact: true, .. })), "{seen:?}");
    assert_eq!(wire.node(ears).unwrap().octets(), [0xE5]);
}

#[test]
fn who_hears_telegrams_hears_a_pause_as_others_do() {
    let mut wire = Wire::new(4);
    wire.set_faults(Faults { pause: 1.0, ..Faults::default() });
    wire.attach("sender", saying(micros(0), ASK_7), Attachment::default());
    let id = wire.attach("listener", listener(), by_telegrams());
    let seen = events(&mut wire, millis(1));
    let pause = seen.iter().find(|event| matches!(event, Event::Pause { .. })).unwrap().at();
    let script = wire.node(id).unwrap();
    assert_eq!(script.octets(), octets(ASK_7));
    assert!(script.heard().iter().any(|(at, _)| *at == pause), "up to the pause, at its begin");
}

#[test]
fn a_lost_telegram_is_lost_for_one_station_and_whole() {
    let (scripts, events) = hundred_zeros(3, Faults { loss: 0.5, ..Faults::default() });
    let heard: Vec<usize> = scripts.iter().map(|script| script.octets().len()).collect();
    assert!(heard.iter().all(|count| [0, 100].contains(count)), "{heard:?}");
    let lost = events.iter().filter(|event| matches!(event, Event::Lost { .. })).count();
    // The sender has nothing to lose.
    assert_eq!(heard.iter().filter(|&&count| count == 0).count(), lost);
    assert!((1..=2).contains(&lost), "{heard:?}");
    assert!(matches!(events.last(), Some(Event::Telegram { intact: true, .. })));
}

#[test]
fn one_station_can_be_deaf_while_the_others_hear() {
    let twice = saying(micros(0), ASK_7).sending(millis(1), telegram(ASK_7));
    let (mut wire, [_, deaf, sound]) =
        line([("sender", twice), ("deaf", listener()), ("sound", listener())]);
    wire.set_loss_at(deaf, Some(1.0));
    events(&mut wire, micros(500));
    assert!(wire.node(deaf).unwrap().heard().is_empty());
    assert_eq!(wire.node(sound).unwrap().octets().len(), 6);
    assert_eq!(wire.statistics().lost, 1);
    wire.set_loss_at(deaf, None);
    events(&mut wire, millis(2));
    assert_eq!(wire.node(deaf).unwrap().octets().len(), 6);
}

#[test]
fn what_a_station_with_a_bad_driver_says_is_destroyed_from_some_character_on() {
    let (mut wire, [bad, _, ears]) = line([
        ("bad", saying(micros(0), ASK_7)),
        ("good", saying(millis(1), ASK_7)),
        ("ears", listener()),
    ]);
    wire.set_corruption_at(bad, Some(1.0));
    let seen = events(&mut wire, micros(500));
    let script = wire.node_mut(ears).unwrap();
    let heard = script.take_heard();
    let first = heard.iter().position(|(_, heard)| *heard == Heard::Broken).unwrap();
    assert!(heard[first..].iter().all(|(_, heard)| *heard == Heard::Broken), "{heard:?}");
    assert_eq!(heard.len(), 6);
    assert!(matches!(seen.last(), Some(Event::Telegram { intact: false, .. })));
    events(&mut wire, millis(2));
    assert_eq!(wire.node(ears).unwrap().octets(), octets(ASK_7), "of the good one");
}

/// A tenth of a second of polling on a bad line.
fn polling(seed: u64, faults: Faults) -> (Vec<String>, u64, usize) {
    let mut wire = Wire::new(seed);
    wire.set_faults(faults);
    // It does not take a pause and the character behind it for the end of an answer.
    let master =
        wire.attach("master", Toy::master(RATE, 3, 66 + 11 + 3, 300), Attachment::default());
    wire.attach("3", Toy::slave(RATE, 3, 11), Attachment::default());
    wire.attach("4", Toy::slave(RATE, 4, 150), by_telegrams());
    wire.attach("5", Toy::slave(RATE, 5, 80), Attachment::default());
    let events = events(&mut wire, millis(100));
    let lines = events.iter().map(ToString::to_string).collect();
    (lines, wire.node(master).unwrap().answers(), violations(&events).len())
}

#[test]
fn the_same_seed_gives_the_same_log_and_another_seed_another() {
    let faults = Faults { loss: 0.02, corruption: 0.1, broken: 0.01, flipped: 0.01, pause: 0.1 };
    assert_eq!(polling(1, faults), polling(1, faults));
    assert_ne!(polling(1, faults), polling(2, faults));
    assert_eq!(polling(1, Faults::default()), polling(2, Faults::default()), "nothing is drawn");
}

#[test]
fn whatever_the_line_does_stations_that_keep_the_rules_are_not_accused() {
    let good = polling(1, Faults::default());
    assert!(good.1 > 350 && good.2 == 0, "{} {}", good.1, good.2);
    for seed in 0..40 {
        let faults =
            Faults { loss: 0.0, corruption: 0.05, broken: 0.01, flipped: 0.01, pause: 0.05 };
        let (lines, answers, accused) = polling(seed, faults);
        assert_eq!(accused, 0, "{lines:#?}");
        assert!((100..good.1).contains(&answers), "{answers}");
    }
}

#[test]
fn nonsense_probabilities_mean_the_nearest_sense() {
    let wild =
        Faults { loss: f64::NAN, corruption: -3.0, broken: -0.0, flipped: -1.0, pause: f64::NAN };
    assert_eq!(polling(1, wild), polling(1, Faults::default()));
    let (scripts, _) = hundred_zeros(1, Faults { broken: 7.0, ..Faults::default() });
    assert_eq!(broken(&scripts[0]), 100);
}
