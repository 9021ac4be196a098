//! What is written, in which order, and what is said when it goes wrong.

use codewheel_commission::passport::{Positioning, Verdict};
use codewheel_commission::{Kind, Reading, Session};

use crate::toy;

#[test]
fn what_clears_others_is_written_first_and_the_preset_last() {
    let settings = [
        ("direction", 1),
        ("steps-per-turn", 3_600),
        ("total-resolution", 7_200),
        ("cos-delta", 50),
    ];
    let passport = toy::new("amg11-d29", 1, 0).with(&settings).preset_at(5).take();
    let mut new = toy::new("amg11-d29", 2, 900);
    let mut doings = Vec::new();
    let plan = new.plan(&passport, None).unwrap();
    let report = plan.carry_out(&mut new, &toy::circumstances(), &mut |progress| {
        doings.push(progress);
    });
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    let order =
        ["direction", "steps-per-turn", "total-resolution", "cos-delta", "save", "preset", "save"];
    assert_eq!(new.written, order);
    assert!(doings.is_sorted_by_key(|progress| progress.percent));
    assert_eq!(doings.last().map(|progress| progress.percent), Some(100));
}

#[test]
fn a_total_that_the_steps_would_take_along_is_written_again() {
    let total = [("total-resolution", 921_600)];
    let passport = toy::new("amg11-d29", 1, 0)
        .with(&[("steps-per-turn", 3_600)])
        .with(&total)
        .preset_at(5)
        .take();
    // It has the total already, and would lose it by the steps per turn.
    let mut new = toy::new("amg11-d29", 2, 900).with(&total);
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    assert_eq!(new.take().setting("total-resolution"), Some(&Reading::Number(921_600)));
}

#[test]
fn a_delta_that_a_smaller_total_on_the_way_would_pull_down_is_written_again() {
    let few_turns = [("total-resolution", 8_192), ("cos-delta", 5_000)];
    let goal = [("steps-per-turn", 1_000), ("total-resolution", 65_536_000), ("cos-delta", 5_000)];
    let passport = toy::new("amg11-d29", 1, 0).with(&goal).preset_at(5).take();
    // One turn of 1000 steps stands between.
    let mut new = toy::new("amg11-d29", 2, 900).with(&few_turns);
    let report = new.apply(&passport, None);
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    assert_eq!(new.take().setting("cos-delta"), Some(&Reading::Number(5_000)));
}

#[test]
fn on_profibus_no_parameterization_on_the_way_is_refused() {
    let scales = [(8_192, 1 << 29), (3_600, 921_600), (100, 6_553_600), (1, 1)];
    for (steps, total) in scales {
        for (new_steps, new_total) in scales {
            let of = |serial, code, steps: i64, total: i64| {
                toy::new("amg11-p29", serial, code)
                    .with(&[("total-resolution", 1), ("steps-per-turn", steps)])
                    .with(&[("total-resolution", total)])
            };
            let passport = of(1, 10, new_steps, new_total).preset_at(0).take();
            let report = of(2, 90, steps, total).apply(&passport, None);
            assert_eq!(report.verdict, Verdict::Done, "{steps} {total}: {report}");
        }
    }
}

#[test]
fn on_profibus_nothing_is_saved_and_the_report_says_what_the_project_needs() {
    let passport =
        toy::new("amg11-p29", 1, 0).with(&[("total-resolution", 921_600)]).preset_at(5).take();
    assert_eq!(passport.project.data_sheet.as_deref(), Some("PB29DPV0.GSD"));
    let mut new = toy::new("amg11-p29", 2, 900);
    let report = new.apply(&passport, None);
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    assert_eq!(new.written, ["total-resolution", "preset"]);
    let text = report.to_string();
    for words in [
        "00 0A 00 00 20 00 00 0E 10 00",
        "octets 14–15: Total measuring range (units) hi = 14",
        "octets 16–17: Total measuring range (units) lo = 4096",
        "octet 9 bit 1: Class 2 functionality = ON",
        "last as long as this session",
    ] {
        assert!(text.contains(words), "{words} in\n{text}");
    }
}

#[test]
fn a_write_that_fails_midway_says_what_has_been_written_and_how_to_go_on() {
    let settings = [("direction", 1), ("steps-per-turn", 3_600), ("cos-delta", 50)];
    let passport = toy::new("amg11-d29", 1, 0).with(&settings).preset_at(5).take();
    let mut new = toy::new("amg11-d29", 2, 900);
    new.writes_left = 1;
    let report = new.apply(&passport, None);
    assert_eq!(report.kind(), Some(Kind::TimeOut));
    let names: Vec<&str> = report.steps.iter().map(|step| step.name.as_str()).collect();
    assert_eq!(names, ["direction"]);
    let text = report.to_string();
    for words in
        ["direction: 0 → 1", "no answer", "to go on", "to go back", "a power cycle undoes it"]
    {
        assert!(text.contains(words), "{words} in\n{text}");
    }
    // It answers again, and the same passport brings the rest.
    new.writes_left = usize::MAX;
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    assert_eq!(new.position(), 5);
}

#[test]
fn a_device_that_takes_a_write_and_does_nothing_is_found_out() {
    let passport = toy::new("amg11-d29", 1, 0).with(&[("direction", 1)]).take();
    let mut new = toy::new("amg11-d29", 2, 0);
    new.deaf = true;
    let report = new.apply(&passport, None);
    assert_eq!(report.kind(), Some(Kind::Differs));
    assert!(report.to_string().contains("1 was written, and 0 read back"), "{report}");
}

#[test]
fn a_machine_that_starts_before_the_preset_is_noticed() {
    let passport = toy::new("amg11-d29", 1, 0).preset_at(5).take();
    let mut new = toy::new("amg11-d29", 2, 900);
    let plan = new.plan(&passport, None).unwrap();
    new.speed = 3;
    let report = plan.carry_out(&mut new, &toy::circumstances(), &mut |_| ());
    assert_eq!(report.kind(), Some(Kind::Refused));
    assert!(new.written.is_empty());
}

#[test]
fn an_offset_cannot_be_restored_while_the_shaft_turns() {
    let mut encoder = toy::new("amg11-d29", 1, 0).preset_at(5_000);
    let passport = encoder.take();
    encoder = encoder.preset_at(0);
    let plan = encoder.plan(&passport, None).unwrap();
    encoder.speed = 3;
    encoder.written.clear();
    let report = plan.carry_out(&mut encoder, &toy::circumstances(), &mut |_| ());
    assert_eq!(report.kind(), Some(Kind::Refused));
    assert!(report.to_string().contains("stop the machine"), "{report}");
    assert!(encoder.written.is_empty());
    let trouble = encoder.plan(&passport, None).unwrap_err();
    assert!(trouble.to_string().contains("its shaft turns"), "{trouble}");
}

#[test]
fn an_offset_is_restored_exactly_although_the_shaft_stands_on_an_edge() {
    for delay in 0..7 {
        let mut encoder = toy::new("amg11-d29", 1, 70).preset_at(5_000);
        let passport = encoder.take();
        encoder = encoder.preset_at(0);
        encoder.trembles = true;
        (0..delay).for_each(|_| {
            encoder.sample().unwrap();
        });
        let report = encoder.apply(&passport, None);
        assert_eq!(report.verdict, Verdict::Done, "{report}");
        assert_eq!(Some(i64::from(encoder.offset())), passport.position.offset);
    }
}

#[test]
fn a_range_that_the_code_does_not_repeat_with_is_warned_of() {
    let mut encoder =
        toy::new("amg11-d29", 1, 0).with(&[("total-resolution", 777_777)]).preset_at(5_000);
    let passport = encoder.take();
    encoder = encoder.preset_at(0);
    let plan = encoder.plan(&passport, None).unwrap();
    assert!(matches!(plan.positioning(), Positioning::Offset { .. }));
    assert!(plan.warnings().iter().any(|warning| warning.contains("does not repeat")), "{plan}");
}

#[test]
fn where_nobody_knows_the_position_the_settings_are_written_and_that_is_said() {
    let mut passport = toy::new("amg11-d29", 1, 0).with(&[("direction", 1)]).preset_at(5).take();
    passport.position = Default::default();
    let mut new = toy::new("amg11-d29", 2, 900);
    let plan = new.plan(&passport, None).unwrap();
    assert_eq!(plan.positioning(), Positioning::Unknown);
    assert!(plan.warnings().iter().any(|warning| warning.contains("where the machine stood")));
    assert_eq!(new.apply(&passport, None).verdict, Verdict::Done);
    assert_eq!(new.written, ["direction", "save"]);
}
