//! What two passports have not in common.

use codewheel_commission::passport::{Subject, compare};
use codewheel_commission::{Reading, Session};

use crate::toy;

#[test]
fn an_encoder_that_turned_and_was_switched_off_is_the_same() {
    let mut encoder = toy::new("amg11-d29", 1, 0).with(&[("direction", 1)]).preset_at(5).saved();
    let before = encoder.take();
    encoder.turn(99_999);
    encoder.reset().unwrap();
    encoder.restore().unwrap();
    assert_eq!(compare(&before, &encoder.take()), []);
}

#[test]
fn a_setting_and_the_offset_it_cleared_are_told_with_old_and_new() {
    let mut encoder = toy::new("amg11-d29", 1, 0).preset_at(5);
    let before = encoder.take();
    let after = encoder.with(&[("steps-per-turn", 3_600)]).take();
    let differences = compare(&before, &after);
    let told: Vec<String> = differences.iter().map(ToString::to_string).collect();
    let total = format!("total-resolution: {} → {}", 8_192 << 16, 3_600 << 16);
    let delta = "steps-per-turn: 8192 → 3600".to_owned();
    assert_eq!(told, [delta, total, "offset: 5 → 0".to_owned()]);
    assert!(differences.iter().all(codewheel_commission::passport::Difference::counts));
}

#[test]
fn another_unit_is_said_and_does_not_count_and_its_offset_is_its_own() {
    let before = toy::new("amg11-d29", 1, 0).preset_at(5).take();
    let after = toy::new("amg11-d29", 2, 900).preset_at(5).take();
    let differences = compare(&before, &after);
    assert_eq!(differences.len(), 1, "{differences:?}");
    assert_eq!(differences[0].subject, Subject::Unit);
    assert!(!differences[0].counts());
}

#[test]
fn offsets_on_opposite_sides_of_the_ring_are_the_same() {
    let mut encoder = toy::new("amg11-d13", 1, 0).preset_at(5);
    let before = encoder.take();
    let mut after = before.clone();
    after.position.offset = Some(5 - 8_192);
    assert_eq!(compare(&before, &after), []);
    after.position.offset = Some(6);
    assert_eq!(compare(&before, &after)[0].subject, Subject::Offset);
}

#[test]
fn another_product_counts_and_another_address_does_not() {
    let before = toy::new("amg11-d29", 1, 0).take();
    let mut after = before.clone();
    after.address = 9;
    after.nameplate.product_code = Some(0x0B);
    let differences = compare(&before, &after);
    let subjects: Vec<(Subject, bool)> =
        differences.iter().map(|difference| (difference.subject, difference.counts())).collect();
    assert_eq!(subjects, [(Subject::Bus, false), (Subject::Identity, true)]);
    assert_eq!(differences[1].was, Some(Reading::Number(0x0A)));
}
