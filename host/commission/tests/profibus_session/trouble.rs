//! What goes wrong on the way.

use codewheel_commission::{Kind, Name, Reading, Session};
use codewheel_station::Duration;

use crate::bench::{Bench, alone, with_others};

#[test]
fn where_nobody_answers_it_is_said_what_to_look_at() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let trouble = bench.open(8, &alone()).unwrap_err();
    assert_eq!((trouble.kind, trouble.came.as_str()), (Kind::TimeOut, "no answer at 1.5M"));
    let said = bench.said;
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.said, said, "and the master is gone");
}

#[test]
fn an_encoder_whose_master_is_gone_tells_how_it_gets_free() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]);
    bench.run(Duration::from_millis(500));
    bench.unplug_plc();
    // Its watchdog lets it go, so that it can be opened.
    let mut session = bench.open(7, &with_others()).unwrap();
    let steps = session.value(&Name::Key("steps-per-turn".to_owned())).unwrap();
    assert_eq!((steps.reading, steps.writable), (Reading::Number(3_600), true));
}

#[test]
fn an_encoder_that_dies_is_a_time_out_and_nothing_hangs() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    bench.unplug_after(Duration::from_secs(3), 7);
    let mut session = bench.open(7, &alone()).unwrap();
    let dies = session.now() + Duration::from_secs(3);
    while session.now() < dies {
        if session.sample().is_err() {
            break;
        }
    }
    let name = Name::Key("direction".to_owned());
    for trouble in [
        session.sample().unwrap_err(),
        session.values().unwrap_err(),
        session.write(&name, &Reading::Number(1)).unwrap_err(),
        session.preset(0).unwrap_err(),
    ] {
        assert_eq!(trouble.kind, Kind::TimeOut, "{trouble}");
    }
    assert!(session.take_notices().contains(&"slave 7 does not answer".to_owned()));
    session.release().unwrap();
    let said = bench.said;
    bench.run(Duration::from_secs(1));
    assert_eq!(bench.said, said);
}
