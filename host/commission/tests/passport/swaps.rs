//! One encoder is taken off a machine and another one put in its place: the positions stay.

use codewheel_commission::passport::{Passport, Positioning, Subject, Verdict, compare};
use codewheel_commission::{Reading, Session};

use crate::toy::{self, Toy};

/// How far the two are apart, the shorter way round.
fn apart(a: u32, b: u32, total: u32) -> u32 {
    let apart = a.abs_diff(b);
    apart.min(total - apart)
}

/// Both on one machine that turns: they must say the same, within a step, wherever it goes.
fn say_the_same(old: &mut Toy, new: &mut Toy, total: u32, turn: i64) {
    // Across the wrap of the range and of both codes, to and fro, and to every remainder of a step.
    for place in 0..400_i64 {
        let codes = if place % 3 == 2 { -turn / 2 - place } else { turn + place };
        old.turn(codes);
        new.turn(codes);
        let (was, is) = (old.position(), new.position());
        assert!(apart(was, is, total) <= 1, "after {place} moves {was} became {is} of {total}");
    }
}

#[test]
fn a_replacement_gives_the_positions_of_what_it_replaces() {
    let singleturn = [(8_192, 8_192), (3_600, 3_600), (361, 361), (1, 1)];
    let multiturn =
        [(8_192, 1 << 29), (3_600, 921_600), (3_600, 921_601), (360, 777), (8_192, 8_192), (7, 5)];
    let profibus_singleturn = [(8_192, 8_192), (3_600, 1_800), (3_600, 777), (1, 1)];
    type Scales<'a> = &'a [(i64, i64)];
    let families: [(&str, Scales<'_>, i64); 4] = [
        ("amg11-d13", &singleturn, 1_111),
        ("amg11-d29", &multiturn, 77_777_777),
        ("amg81-p13", &profibus_singleturn, 1_111),
        ("heag162-p29", &multiturn, 77_777_777),
    ];
    for (model, settings, turn) in families {
        for (direction, (steps, total)) in
            [0, 1].into_iter().flat_map(|direction| settings.iter().map(move |s| (direction, *s)))
        {
            // On PROFIBUS T comes first, since it must never exceed n × M.
            let mut order = [("steps-per-turn", steps), ("total-resolution", total)];
            if model.contains("-p") {
                order.reverse();
            }
            let settings = [&[("direction", direction)], &order[..]].concat();
            for (code, other_code, position) in
                [(0, 5_000, 0), (8_191, 0, total - 1), (4_096, 1, total / 2), (3, 8_190, 0)]
            {
                let mut old = toy::new(model, 1, code).with(&settings);
                old = old.preset_at(u32::try_from(position).unwrap());
                let passport = Passport::parse(&old.take().to_toml()).expect("our own file");
                let mut new = toy::new(model, 2, other_code);
                let report = new.apply(&passport, None);
                assert_eq!(report.verdict, Verdict::Done, "{model} {settings:?}\n{report}");
                let total = u32::try_from(total).unwrap();
                assert!(apart(old.position(), new.position(), total) <= 1, "{model} {settings:?}");
                say_the_same(&mut old, &mut new, total, turn);
            }
        }
    }
}

#[test]
fn a_replacement_takes_the_position_that_a_person_reads_off_the_machine() {
    let mut old = toy::new("amg11-d29", 1, 100).with(&[("steps-per-turn", 3_600)]).preset_at(5_000);
    let passport = old.take();
    // Before it breaks the machine goes on; somebody reads its scale.
    old.turn(8_192 * 3);
    let mut new = toy::new("amg11-d29", 2, 77_000);
    let report = new.apply(&passport, Some(old.position()));
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    assert_eq!(new.position(), old.position());
    say_the_same(&mut old, &mut new, 3_600 << 16, 77_777);
}

#[test]
fn the_same_unit_gets_its_offset_back_wherever_the_machine_stands() {
    for (steps, total) in [(8_192, 1 << 29), (3_600, 3_600 * 256), (360, 360 * 2)] {
        for direction in [0, 1] {
            let settings =
                [("direction", direction), ("steps-per-turn", steps), ("total-resolution", total)];
            let mut encoder =
                toy::new("amg11-d29", 7, 123_456).with(&settings).preset_at(42).saved();
            let passport = encoder.take();
            let mut twin = toy::new("amg11-d29", 7, 123_456).with(&settings).preset_at(42);
            encoder.reset().unwrap();
            for codes in [9_999_999, -31_000_000, 5] {
                encoder.turn(codes);
                twin.turn(codes);
            }
            assert_ne!(encoder.position(), twin.position());
            let plan = encoder.plan(&passport, None).unwrap();
            assert!(matches!(plan.positioning(), Positioning::Offset { .. }), "{plan}");
            let report = encoder.apply(&passport, None);
            assert_eq!(report.verdict, Verdict::Done, "{report}");
            assert_eq!(encoder.position(), twin.position());
            let wrapped = |offset: i32| i64::from(offset).rem_euclid(total);
            assert_eq!(wrapped(encoder.offset()), wrapped(twin.offset()));
            // It was saved as well.
            encoder.reset().unwrap();
            encoder.restore().unwrap();
            assert_eq!(encoder.position(), twin.position());
        }
    }
}

#[test]
fn the_same_unit_after_nothing_happened_needs_nothing() {
    for model in ["amg11-d29", "amg11-p29"] {
        let mut encoder = toy::new(model, 7, 4_711).with(&[("direction", 1)]).preset_at(99);
        let passport = encoder.take();
        encoder.written.clear();
        encoder.turn(100_000);
        let plan = encoder.plan(&passport, None).unwrap();
        assert!(plan.is_empty(), "{plan}");
        let report = encoder.apply(&passport, None);
        assert_eq!(report.verdict, Verdict::Done);
        assert!(encoder.written.is_empty(), "{:?}", encoder.written);
    }
}

#[test]
fn applying_twice_writes_once() {
    let mut old = toy::new("amg11-d13", 1, 100).with(&[("steps-per-turn", 1_000)]).preset_at(10);
    let passport = old.take();
    let mut new = toy::new("amg11-d13", 2, 5_000);
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    new.written.clear();
    assert!(new.plan(&passport, None).unwrap().is_empty());
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    assert!(new.written.is_empty());
}

#[test]
fn what_was_done_can_be_undone() {
    let mut old = toy::new("amg11-d29", 1, 100).with(&[("direction", 1)]).preset_at(10);
    let passport = old.take();
    let mut new = toy::new("amg11-d29", 2, 5_000).with(&[("steps-per-turn", 360)]).preset_at(7);
    let before = new.take();
    let plan = new.plan(&passport, None).unwrap();
    assert_eq!(*plan.undo(), before);
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    new.turn(8_192 * 11);
    let undone = new.apply(plan.undo(), None);
    assert_eq!(undone.verdict, Verdict::Done, "{undone}");
    new.turn(-8_192 * 11);
    assert_eq!(new.position(), 7);
    assert_eq!(new.take().setting("steps-per-turn"), Some(&Reading::Number(360)));
}

#[test]
fn another_model_with_the_same_serial_number_is_another_encoder() {
    let steps = [("steps-per-turn", 3_600), ("total-resolution", 3_600)];
    let passport = toy::new("amg11-d29", 7, 100).with(&steps).preset_at(300).take();
    let mut new = toy::new("amg11-d13", 7, 5_000).with(&steps[..1]);
    let plan = new.plan(&passport, None).unwrap();
    assert_eq!(plan.positioning(), Positioning::Preset { position: 300 }, "{plan}");
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    assert_eq!(new.position(), 300);
    // What a preset adds belongs to the disc, so it is no difference between two of them.
    let differences = compare(&passport, &new.take());
    assert!(differences.iter().all(|it| it.subject != Subject::Offset), "{differences:?}");
}
