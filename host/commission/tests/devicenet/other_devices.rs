//! Devices that nobody knows.

use codewheel_commission::{Kind, Name, Reading, Session};

use crate::toy::Toy;
use crate::wire_seat::{WireSeat, key, secs};

fn with(toy: Toy) -> WireSeat {
    let mut seat = WireSeat::new();
    seat.toy(toy);
    seat.run(secs(3));
    seat
}

#[test]
fn an_unknown_device_is_told_in_its_own_words() {
    let mut seat = with(Toy::new(9));
    let mut session = seat.open(9).unwrap();
    let identity = session.identify().unwrap();
    assert_eq!(identity.product_name.as_deref(), Some("Toy drive"));
    assert!(identity.models.is_empty(), "the product code of ours says nothing without its vendor");
    let values = session.values().unwrap();
    let [ramp, torque, mode, ..] = values.as_slice() else { panic!("{values:#?}") };
    assert_eq!((ramp.name.as_str(), ramp.title.as_str()), ("parameter/1", "Ramp"));
    assert_eq!((&ramp.reading, ramp.unit.as_str()), (&Reading::Number(200), "ms"));
    assert_eq!((ramp.range, ramp.setting, ramp.writable), (Some((10, 5_000)), true, true));
    assert_eq!((&torque.reading, torque.range), (&Reading::Number(-7), None));
    assert!(!torque.setting && !torque.writable);
    assert_eq!((&mode.reading, mode.label.as_deref()), (&Reading::Number(1), Some("Brake")));
    let names: Vec<&str> = values.iter().map(|value| value.name.as_str()).collect();
    assert!(names.contains(&"serial-number") && names.contains(&"bus-off-interrupt"));
    assert!(!names.contains(&"position") && !names.contains(&"poll-assembly"));
}

#[test]
fn a_device_that_tells_nothing_of_itself_still_has_an_identity() {
    let mut seat = with(Toy::taciturn(9));
    let mut session = seat.open(9).unwrap();
    let values = session.values().unwrap();
    assert_eq!(values[0].name, "vendor");
    let trouble = session.value(&Name::Parameter(1)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
}

#[test]
fn its_parameters_are_written_by_their_types() {
    let mut seat = with(Toy::new(9));
    let mut session = seat.open(9).unwrap();
    let ramp = Name::Parameter(1);
    assert_eq!(
        session.write(&ramp, &Reading::Number(1_000)).unwrap().reading,
        Reading::Number(1_000)
    );
    let trouble = session.write(&ramp, &Reading::Number(6_000)).unwrap_err();
    assert_eq!((trouble.kind, trouble.remedy.as_str()), (Kind::Refused, "it takes 10 to 5000"));
    assert_eq!(session.write(&ramp, &Reading::Number(70_000)).unwrap_err().kind, Kind::Usage);
    assert_eq!(
        session.write(&Name::Parameter(2), &Reading::Number(1)).unwrap_err().kind,
        Kind::Refused
    );
    let missing = session.value(&Name::Parameter(4)).unwrap_err();
    assert_eq!(missing.came, "it answers 16 object does not exist");
}

#[test]
fn what_only_encoders_can_do_is_not_tried_on_others() {
    let mut seat = with(Toy::new(9));
    let mut session = seat.open(9).unwrap();
    assert_eq!(session.sample().unwrap_err().kind, Kind::Refused);
    assert_eq!(session.preset(1).unwrap_err().kind, Kind::Refused);
    assert_eq!(session.value(&key("steps-per-turn")).unwrap_err().kind, Kind::Usage);
    let save = session.save().unwrap_err();
    assert_eq!(save.came, "it answers 08 service not supported");
}
