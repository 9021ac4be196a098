//! The same with real encoders on both buses, in virtual time.

use codewheel_commission::passport::{self, Passport, Positioning, Verdict, compare};
use codewheel_commission::{Reading, Session};
use codewheel_station::Duration;

use crate::buses::{Bench, DeviceNetBench, ProfibusBench};
use crate::toy::{circumstances, key};

fn write(session: &mut dyn Session, settings: &[(&str, i64)]) {
    for (name, value) in settings {
        session.write(&key(name), &Reading::Number(*value)).expect("a legal setting");
    }
}

fn take(session: &mut dyn Session) -> Passport {
    passport::take(session, &circumstances()).expect("a passport")
}

fn apply(session: &mut dyn Session, passport: &Passport) -> passport::Report {
    let plan = passport::plan(passport, session, &circumstances(), None).expect("a plan");
    plan.carry_out(session, &circumstances(), &mut |_| ())
}

fn near(a: u32, b: u32, total: u32) -> bool {
    let apart = a.abs_diff(b);
    apart.min(total - apart) <= 1
}

#[test]
fn on_devicenet_a_replacement_gives_the_same_positions_also_after_power_off() {
    let mut bench = DeviceNetBench::new();
    bench.attach(5, "amg11-d29", 123_456);
    bench.attach(6, "pmg10-d29", 77);
    bench.run(Duration::from_secs(3));
    bench.turn(4_000_000);
    let total = 3_600 * 256;
    let passport = bench.with_session(5, |session| {
        let settings = [("direction", 1), ("steps-per-turn", 3_600)];
        write(session, &settings);
        write(session, &[("total-resolution", total.into()), ("cos-delta", 12)]);
        write(session, &[("poll-assembly", 2), ("bus-off-interrupt", 1)]);
        session.preset(total - 1).expect("a preset");
        session.save().expect("it saves");
        take(session)
    });
    let passport = Passport::parse(&passport.to_toml()).expect("our own file");
    let report = bench.with_session(6, |session| apply(session, &passport));
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    bench.power_cycle(6);
    for codes in [0, 8_192, -3, 100_000_000, -250_000_000, 1] {
        bench.turn(codes);
        let (old, new) = (bench.position(5), bench.position(6));
        assert!(near(old, new, total), "{old} {new}");
    }
    let replaced = bench.with_session(6, take);
    assert!(compare(&passport, &replaced).iter().all(|difference| {
        // Another family has another name.
        !difference.counts() || difference.name == "product-name"
    }));
    assert_eq!(replaced.setting("poll-assembly"), Some(&Reading::Number(2)));
}

#[test]
fn on_devicenet_the_same_unit_gets_its_offset_back_after_a_reset() {
    let mut bench = DeviceNetBench::new();
    bench.attach(5, "amg11-d13", 5_000);
    bench.run(Duration::from_secs(3));
    let passport = bench.with_session(5, |session| {
        write(session, &[("steps-per-turn", 361)]);
        session.preset(7).expect("a preset");
        take(session)
    });
    bench.turn(-100);
    let stands_at = bench.position(5);
    bench.with_session(5, |session| session.reset().expect("it resets"));
    assert_ne!(bench.position(5), stands_at);
    let report = bench.with_session(5, |session| {
        let plan = passport::plan(&passport, session, &circumstances(), None).expect("a plan");
        assert!(matches!(plan.positioning(), Positioning::Offset { .. }), "{plan}");
        plan.carry_out(session, &circumstances(), &mut |_| ())
    });
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    assert_eq!(bench.position(5), stands_at);
    bench.power_cycle(5);
    let now = bench.with_session(5, take);
    assert_eq!(compare(&passport, &now), []);
}

#[test]
fn on_profibus_a_replacement_gives_the_same_positions_while_the_session_lasts() {
    for (steps, total) in [(3_600, 921_600), (360, 777), (8_192, 1 << 29)] {
        let mut bench = ProfibusBench::new();
        bench.attach(5, "amg11-p29", 123_456);
        bench.attach(6, "hmg10-p29", 8_190);
        bench.run(Duration::from_secs(1));
        let mut told = Vec::new();
        let passport = bench.with_session(5, |session| {
            write(session, &[("direction", 1), ("total-resolution", 1)]);
            write(session, &[("steps-per-turn", steps), ("total-resolution", total)]);
            session.preset(5).expect("a preset");
            take(session)
        });
        let machine = bench.machine().clone();
        let walk = [0, 8_192, -3, 1_000_000, 77_777_777, -55_555_555];
        let follow = |session: &mut dyn Session| {
            let mut positions = Vec::new();
            for codes in walk {
                machine.set(machine.get() + codes);
                for _ in 0..3 {
                    session.sample().expect("a sample");
                }
                positions.push(session.sample().expect("a sample").position);
            }
            machine.set(machine.get() - walk.iter().sum::<i64>());
            for _ in 0..3 {
                session.sample().expect("a sample");
            }
            positions
        };
        let report = bench.with_session(6, |session| {
            let report = apply(session, &passport);
            told.push(follow(session));
            report
        });
        assert_eq!(report.verdict, Verdict::Done, "{report}");
        assert!(report.project.user_parameters.is_some());
        // What the old one tells under the same parameters.
        let again = bench.with_session(5, |session| {
            told.push(follow(session));
            take(session)
        });
        assert_eq!(compare(&passport, &again), []);
        let total = u32::try_from(total).unwrap();
        for (new, old) in told[0].iter().zip(&told[1]) {
            assert!(near(*old, *new, total), "{told:?} of {total}");
        }
    }
}

#[test]
fn on_profibus_parameters_come_from_class_1_to_those_of_the_passport() {
    let mut bench = ProfibusBench::new();
    bench.attach(5, "amg11-p29", 1_234);
    bench.attach(6, "amg11-p29", 99);
    bench.run(Duration::from_secs(1));
    let passport = bench.with_session(5, |session| {
        write(session, &[("total-resolution", 921_600), ("steps-per-turn", 3_600)]);
        session.preset(42).expect("a preset");
        take(session)
    });
    let report = bench.with_session(6, |session| {
        write(session, &[("class-2", 0)]);
        apply(session, &passport)
    });
    assert_eq!(report.verdict, Verdict::Done, "{report}");
    assert_eq!(report.after.and_then(|after| after.position.steps), Some(42));
}
