//! What cannot give the same positions is refused before anything is written.

use codewheel_commission::passport::{Passport, Verdict};
use codewheel_commission::{Kind, Trouble};

use crate::toy::{self, Toy};

/// What is said; and nothing may have been written.
fn refused(new: &mut Toy, plan: Result<impl std::fmt::Debug, Trouble>) -> Trouble {
    let trouble = plan.expect_err("it cannot be");
    assert!(new.written.is_empty());
    assert!(!trouble.remedy.is_empty(), "{trouble}");
    trouble
}

#[test]
fn thirteen_bits_do_not_replace_twentynine() {
    for [old, new] in [["amg11-d29", "amg11-d13"], ["amg11-p29", "heag162-p18"]] {
        let passport = toy::new(old, 1, 100).preset_at(0).take();
        let mut new = toy::new(new, 2, 100);
        let plan = new.plan(&passport, None);
        let trouble = refused(&mut new, plan);
        assert_eq!(trouble.kind, Kind::Refused);
        assert!(trouble.to_string().contains("multiturn"), "{trouble}");
    }
}

#[test]
fn finer_steps_than_the_disc_has_are_refused_with_what_is_needed() {
    let passport = toy::new("heag162-p18", 1, 0).take();
    let mut new = toy::new("amg11-p13", 2, 0);
    let plan = new.plan(&passport, None);
    let trouble = refused(&mut new, plan);
    assert!(trouble.came.contains("262144") && trouble.came.contains("8192"), "{trouble}");
}

#[test]
fn a_multiturn_encoder_replaces_a_singleturn_one() {
    let mut old = toy::new("amg11-d13", 1, 100).with(&[("steps-per-turn", 720)]).preset_at(300);
    let passport = old.take();
    let mut new = toy::new("amg11-d29", 2, 99_999);
    let plan = new.plan(&passport, None).unwrap();
    assert!(plan.warnings().iter().any(|warning| warning.contains("product-code")), "{plan}");
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    for _ in 0..50 {
        old.turn(333);
        new.turn(333);
        assert!(old.position().abs_diff(new.position()) % 719 <= 1);
    }
}

#[test]
fn another_bus_is_refused() {
    let passport = toy::new("amg11-p29", 1, 0).take();
    let mut new = toy::new("amg11-d29", 2, 0);
    let plan = new.plan(&passport, None);
    let trouble = refused(&mut new, plan);
    assert!(trouble.to_string().contains("PROFIBUS"), "{trouble}");
}

#[test]
fn a_machine_that_turns_gets_no_preset() {
    let passport = toy::new("amg11-d29", 1, 0).preset_at(5).take();
    let mut new = toy::new("amg11-d29", 2, 900);
    new.speed = 40;
    let plan = new.plan(&passport, None);
    let trouble = refused(&mut new, plan);
    assert!(trouble.remedy.contains("stop the machine"), "{trouble}");
}

#[test]
fn a_passport_of_a_shaft_that_turned_needs_a_person_who_knows_the_position() {
    let mut old = toy::new("amg11-d29", 1, 0).preset_at(5);
    old.speed = 40;
    let passport = old.take();
    assert_eq!(passport.position.at_rest, Some(false));
    let mut new = toy::new("amg11-d29", 2, 900);
    let plan = new.plan(&passport, None);
    let trouble = refused(&mut new, plan);
    assert!(trouble.remedy.contains("where the machine stands"), "{trouble}");
    assert_eq!(new.apply(&passport, Some(1_234)).verdict, Verdict::Done);
    assert_eq!(new.position(), 1_234);
}

#[test]
fn a_position_beyond_the_range_is_a_slip_of_the_pen() {
    let passport = toy::new("amg11-d13", 1, 0).with(&[("steps-per-turn", 360)]).take();
    let mut new = toy::new("amg11-d13", 2, 0);
    let plan = new.plan(&passport, Some(360));
    let trouble = refused(&mut new, plan);
    assert_eq!(trouble.kind, Kind::Usage);
    assert!(trouble.remedy.contains("359"), "{trouble}");
}

#[test]
fn a_setting_out_of_range_is_refused_with_its_range() {
    let mut passport = toy::new("amg11-d29", 1, 0).with(&[("steps-per-turn", 360)]).take();
    for setting in &mut passport.settings {
        if setting.name == "cos-delta" {
            setting.reading = codewheel_commission::Reading::Number(0);
        }
    }
    let mut new = toy::new("amg11-d29", 2, 0);
    let plan = new.plan(&passport, None);
    let trouble = refused(&mut new, plan);
    let most = (360 << 16).to_string();
    assert!(trouble.remedy.contains(&most), "{trouble}");
}

#[test]
fn a_setting_that_the_replacement_does_not_have_is_refused() {
    let mut passport = toy::new("amg11-d29", 1, 0).take();
    passport.settings[0].name = "backlash".to_owned();
    let mut new = toy::new("amg11-d29", 2, 0);
    let plan = new.plan(&passport, None);
    assert!(refused(&mut new, plan).came.contains("backlash"));
}

#[test]
fn an_older_revision_and_another_serial_are_said_and_no_reason_to_refuse() {
    let passport = toy::new("amg11-d29", 1, 0).preset_at(5).take();
    let mut new = toy::new("amg11-d29", 2, 0);
    new.revision = (1, 0);
    let plan = new.plan(&passport, None).unwrap();
    for words in ["revision 1.0 is older", "another unit", "where it stood"] {
        assert!(plan.warnings().iter().any(|warning| warning.contains(words)), "{words}: {plan}");
    }
}

#[test]
fn without_class_2_no_replacement_gets_a_preset() {
    let passport = toy::new("amg11-p29", 1, 50).with(&[("class-2", 0)]).take();
    let mut new = toy::new("amg11-p29", 2, 900).with(&[("class-2", 0)]);
    new.written.clear();
    let plan = new.plan(&passport, None);
    let trouble = refused(&mut new, plan);
    assert!(trouble.remedy.contains("class 2"), "{trouble}");
    // Mounted at the same code it gives the same positions.
    let mut new = toy::new("amg11-p29", 2, 50).with(&[("class-2", 0)]);
    assert!(new.plan(&passport, None).unwrap().is_empty());
}

#[test]
fn what_a_person_wrote_and_no_passport_says_is_refused_before_anything_is_written() {
    let text = toy::new("amg11-d29", 1, 0).preset_at(5).take().to_toml();
    for (was, is, kind) in [
        ("[settings]", "[settings]\npreset = 7", Kind::Usage),
        ("[settings]", "[settings]\noffset = 7", Kind::Usage),
        ("[settings]", "[settings]\nposition = 7", Kind::Usage),
        ("steps-per-turn = 8192", "steps-per-turn = \"8192\"", Kind::Usage),
        ("cos-delta = 1", "cos-delta = [1, 0, 0, 0]", Kind::Usage),
        ("steps-per-turn = 8192", "steps-per-turn = 0", Kind::Refused),
        ("steps-per-turn = 8192", "steps-per-turn = -9223372036854775808", Kind::Refused),
        ("total-resolution = 536870912", "total-resolution = -1", Kind::Refused),
        ("total-resolution = 536870912", "total-resolution = 9223372036854775807", Kind::Refused),
        ("cos-delta = 1", "cos-delta = -1", Kind::Refused),
    ] {
        assert!(text.contains(was), "{was} in {text}");
        let passport = Passport::parse(&text.replacen(was, is, 1)).expect("a passport");
        let mut new = toy::new("amg11-d29", 1, 900);
        let plan = new.plan(&passport, None);
        let trouble = refused(&mut new, plan);
        assert_eq!(trouble.kind, kind, "{is}: {trouble}");
        assert!(!trouble.remedy.contains('-'), "{is}: {trouble}");
    }
}

#[test]
fn an_offset_beyond_all_bounds_is_taken_on_the_ring() {
    let text = toy::new("amg11-d29", 1, 0).take().to_toml();
    for offset in [i64::MAX, i64::MIN] {
        let text = text.replacen("offset = 0", &format!("offset = {offset}"), 1);
        let passport = Passport::parse(&text).expect("a passport");
        let mut new = toy::new("amg11-d29", 1, 900);
        assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
        assert_eq!(i64::from(new.offset()).rem_euclid(1 << 29), offset.rem_euclid(1 << 29));
    }
}
