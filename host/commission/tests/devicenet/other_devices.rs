//! Devices that nobody knows.

use codewheel_commission::{Kind, Name, Reading, Real, Session};

use crate::toy::Toy;
use crate::wire_seat::{WireSeat, key, millis, secs};

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
    let missing = session.value(&Name::Parameter(7)).unwrap_err();
    assert_eq!(missing.came, "it answers 16 object does not exist");
}

#[test]
fn texts_and_numbers_with_a_fraction_are_read_and_written_as_such() {
    let mut seat = with(Toy::new(9));
    let mut session = seat.open(9).unwrap();
    let (label, gain) = (Name::Parameter(4), Name::Parameter(5));
    assert_eq!(session.value(&label).unwrap().reading, Reading::Text("press 3".to_owned()));
    let text = Reading::Text("a longer text, in fragments".to_owned());
    assert_eq!(session.write(&label, &text).unwrap().reading, text);
    assert_eq!(session.value(&gain).unwrap().reading, Reading::Real(Real::Single(0.5)));
    let tenth = Reading::Real(Real::Double(0.1));
    assert_eq!(session.write(&gain, &tenth).unwrap().reading, tenth);
    let trouble = session.write(&gain, &Reading::Text("much".to_owned())).unwrap_err();
    assert_eq!((trouble.kind, trouble.remedy.contains("its 4 octets")), (Kind::Usage, true));
    let trouble = session.write(&label, &Reading::Text("\u{20AC}".to_owned())).unwrap_err();
    assert_eq!(trouble.kind, Kind::Usage);
}

#[test]
fn a_scaled_number_is_told_in_its_unit_and_written_as_it_lies_on_the_bus() {
    let mut seat = with(Toy::new(9));
    let mut session = seat.open(9).unwrap();
    let supply = session.value(&Name::Parameter(6)).unwrap();
    assert_eq!((supply.reading, supply.range), (Reading::Number(237), Some((0, 400))));
    assert_eq!((supply.label.as_deref(), supply.unit.as_str()), (Some("23.7 (raw 237)"), "V"));
    let written = session.write(&Name::Parameter(6), &Reading::Number(240)).unwrap();
    assert_eq!(written.label.as_deref(), Some("24.0 (raw 240)"));
    // The ramp has a scaling and does not say that it is scaled.
    assert_eq!(session.value(&Name::Parameter(1)).unwrap().label, None);
}

#[test]
fn a_device_that_takes_700_ms_for_each_answer_is_waited_for() {
    let mut toy = Toy::new(9);
    toy.takes = millis(700);
    let mut seat = with(toy);
    let mut session = seat.open(9).unwrap();
    assert_eq!(session.identify().unwrap().vendor, Some(0x0123));
    let begun = session.now();
    assert_eq!(session.value(&key("serial-number")).unwrap().reading, Reading::Number(42));
    assert!(session.now().since(begun) < millis(720));
}

#[test]
fn a_device_is_asked_in_the_message_body_format_that_it_gives() {
    for format in 0..=3 {
        let mut toy = Toy::new(9);
        toy.format = format;
        let mut seat = with(toy);
        let mut session = seat.open(9).unwrap();
        assert_eq!(session.identify().unwrap().vendor, Some(0x0123), "format {format}");
        let torque = session.value(&Name::Parameter(2)).unwrap();
        assert_eq!(torque.reading, Reading::Number(-7), "format {format}");
        session.release().unwrap();
        assert_eq!(seat.held(9), 0);
    }
}

#[test]
fn a_device_with_a_message_body_format_that_nobody_knows_is_released_and_asked_nothing() {
    let mut toy = Toy::new(9);
    toy.format = 4;
    let mut seat = with(toy);
    let trouble = seat.open(9).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert!(trouble.came.contains("message body format 4"), "{trouble}");
    assert!(seat.ours().iter().all(|frame| !frame.starts_with("44C")), "{:#?}", seat.ours());
    assert_eq!(seat.held(9), 0);
}

#[test]
fn what_was_written_and_cannot_be_read_back_is_said_to_be_written() {
    let mut seat = WireSeat::new();
    let id = seat.toy(Toy::encoder(9));
    seat.run(secs(3));
    let mut session = seat.open(9).unwrap();
    let trouble = session.preset(5).unwrap_err();
    assert_eq!(trouble.kind, Kind::Differs, "{trouble}");
    assert!(trouble.came.contains("5 was written and taken"), "{trouble}");
    assert!(trouble.came.contains("16 object does not exist"), "{trouble}");
    assert!(!trouble.remedy.is_empty());
    let trouble = session.write(&key("cos-delta"), &Reading::Number(7)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Differs, "{trouble}");
    drop(session);
    assert_eq!(seat.drive(id).preset, [7, 0, 0, 0]);
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
