//! Reading and writing one encoder.

use codewheel_commission::{Kind, Name, Reading, Session};

use crate::wire_seat::{WireSeat, key, number, secs};

fn with_encoder() -> WireSeat {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still angle=123456");
    seat.run(secs(3));
    seat
}

#[test]
fn an_encoder_says_who_it_is() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let identity = session.identify().unwrap();
    assert_eq!(identity.vendor, Some(468));
    assert_eq!((identity.product_code, identity.revision), (0x0A, Some((1, 1))));
    assert_eq!(identity.serial, Some(1_005));
    assert_eq!(identity.firmware.as_deref(), Some("1.01"));
    let models: Vec<&str> = identity.models.iter().map(|product| product.model).collect();
    assert_eq!(models, ["amg11-d29"]);
}

#[test]
fn a_setting_is_written_and_read_back_with_its_side_effects() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let written = session.write(&key("steps-per-turn"), &Reading::Number(3_600)).unwrap();
    assert_eq!(written.reading, Reading::Number(3_600));
    assert_eq!(written.range, Some((1, 8_192)));
    assert_eq!(number(&mut session, "total-resolution"), 3_600 * 65_536);
    let turned = session.write(&key("direction"), &Reading::Text("ccw".to_owned())).unwrap();
    assert_eq!((turned.reading, turned.label.as_deref()), (Reading::Number(1), Some("CCW")));
}

#[test]
fn a_refused_value_comes_with_the_range_that_is_in_force() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let trouble = session.write(&key("steps-per-turn"), &Reading::Number(9_000)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert_eq!(
        trouble.to_string(),
        "cannot write steps-per-turn of the device at MAC ID 5: it answers 09 invalid attribute \
         value; it takes 1 to 8192"
    );
    session.write(&key("total-resolution"), &Reading::Number(10_000)).unwrap();
    for (name, value, remedy) in [
        ("preset", 10_000, "it takes 0 to 9999"),
        ("cos-delta", 10_001, "it takes 1 to 10000"),
        ("cos-delta", 0, "it takes 1 to 10000"),
    ] {
        let trouble = session.write(&key(name), &Reading::Number(value)).unwrap_err();
        assert_eq!((trouble.kind, trouble.remedy.as_str()), (Kind::Refused, remedy), "{name}");
    }
}

#[test]
fn what_cannot_be_written_by_its_nature_is_not_sent() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let before = session.now();
    for (name, reading, kind) in [
        (key("position"), Reading::Number(1), Kind::Refused),
        (key("steps-per-turn"), Reading::Number(-1), Kind::Usage),
        (key("steps-per-turn"), Reading::Number(1 << 32), Kind::Usage),
        (key("direction"), Reading::Text("left".to_owned()), Kind::Usage),
        (key("serial-number"), Reading::Number(1), Kind::Refused),
        (key("no-such-thing"), Reading::Number(1), Kind::Usage),
        (Name::Octet(32), Reading::Number(1), Kind::Usage),
        (Name::Parameter(0), Reading::Number(1), Kind::Usage),
    ] {
        assert_eq!(session.write(&name, &reading).unwrap_err().kind, kind, "{name:?}");
    }
    assert_eq!(session.now(), before, "no time has passed");
}

#[test]
fn a_preset_makes_the_position_what_it_says() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let sample = session.preset(4_711).unwrap();
    assert_eq!(sample.position, 4_711);
    assert_eq!((sample.alarm, sample.warning), (Some(false), Some(false)));
    assert_eq!(number(&mut session, "offset"), 4_711 - 123_456);
    let beyond = session.preset(1 << 29).unwrap_err();
    assert_eq!(beyond.remedy, "it takes 0 to 536870911");
}

#[test]
fn what_was_saved_outlasts_a_power_cycle_and_nothing_else_does() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    session.write(&key("steps-per-turn"), &Reading::Number(1_000)).unwrap();
    session.save().unwrap();
    session.write(&key("steps-per-turn"), &Reading::Number(2_000)).unwrap();
    drop(session);
    let now = seat.wire.now();
    seat.device(id).power_cycle(now);
    seat.run(secs(3));
    // The session before was dropped, not released: the console has brought its device back.
    let mut session = seat.open(5).unwrap();
    assert_eq!(number(&mut session, "steps-per-turn"), 1_000);
    session.reset().unwrap();
    assert_eq!(number(&mut session, "steps-per-turn"), 8_192);
    session.restore().unwrap();
    assert_eq!(number(&mut session, "steps-per-turn"), 1_000);
}

#[test]
fn a_session_goes_on_after_the_device_was_switched_off_and_on() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    seat.after(secs(5), move |seat| {
        let now = seat.wire.now();
        seat.device(id).power_cycle(now);
    });
    let mut session = seat.open(5).unwrap();
    let end = session.now() + secs(6);
    let mut troubles = Vec::new();
    while session.now() < end {
        troubles.extend(session.value(&key("position")).err());
    }
    // The question of that moment waits until it is there again, and is asked anew then.
    assert_eq!(troubles, []);
    assert_eq!(number(&mut session, "steps-per-turn"), 8_192);
}

#[test]
fn a_memory_that_fails_is_a_refusal_with_what_to_do() {
    let mut seat = with_encoder();
    seat.has_memory = false;
    let mut session = seat.open(5).unwrap();
    let trouble = session.save().unwrap_err();
    assert_eq!(trouble.kind, Kind::Refused);
    assert_eq!(trouble.came, "it answers 19 store operation failed");
    assert!(trouble.remedy.contains("last until power-off"), "{}", trouble.remedy);
}

#[test]
fn a_memory_that_takes_too_long_is_told_to_be_busy() {
    let mut seat = with_encoder();
    seat.memory_time = secs(20);
    let mut session = seat.open(5).unwrap();
    // After five seconds the device gives up waiting for its memory.
    assert_eq!(session.save().unwrap_err().came, "it answers 19 store operation failed");
    let busy = session.save().unwrap_err();
    assert_eq!(busy.came, "it answers 10 device state conflict");
    assert!(busy.remedy.contains("wait five seconds"), "{}", busy.remedy);
}

#[test]
fn a_save_takes_the_time_that_a_memory_takes() {
    let mut seat = with_encoder();
    seat.memory_time = secs(4);
    let mut session = seat.open(5).unwrap();
    let before = session.now();
    session.save().unwrap();
    assert!(session.now().since(before) >= secs(4));
}

#[test]
fn everything_is_told_in_an_order_in_which_it_can_be_written_again() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let values = session.values().unwrap();
    let settings: Vec<&str> =
        values.iter().filter(|value| value.setting).map(|value| value.name.as_str()).collect();
    assert_eq!(
        settings,
        [
            "direction",
            "steps-per-turn",
            "total-resolution",
            "cos-delta",
            "heartbeat-interval",
            "bus-off-interrupt",
            "poll-assembly",
            "change-assembly",
        ]
    );
    assert_eq!(values.len(), 24 + 21, "all rows, and all that the bus has names for");
    assert!(values.iter().all(|value| !value.setting || value.range.is_some()));
    let again: Vec<_> = values
        .iter()
        .filter(|value| value.setting)
        .map(|value| {
            session.write(&Name::Key(value.name.clone()), &value.reading).unwrap().reading
                == value.reading
        })
        .collect();
    assert_eq!(again, vec![true; 8]);
}

#[test]
fn the_produced_paths_are_settings_that_need_no_save() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    let value = session.value(&key("poll-assembly")).unwrap();
    assert_eq!((value.reading, value.label.as_deref()), (Reading::Number(1), Some("position")));
    for name in ["poll-assembly", "change-assembly"] {
        let value = session.write(&key(name), &Reading::Number(2)).unwrap();
        assert_eq!(value.label.as_deref(), Some("position and flags"));
        let trouble = session.write(&key(name), &Reading::Number(7)).unwrap_err();
        assert_eq!(trouble.remedy, "it takes 1 to 2");
    }
    session.release().unwrap();
    drop(session);
    let now = seat.wire.now();
    seat.device(id).power_cycle(now);
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    assert_eq!(number(&mut session, "poll-assembly"), 2);
    assert_eq!(number(&mut session, "change-assembly"), 2);
}

#[test]
fn a_value_has_the_same_meaning_by_each_of_its_names() {
    let mut seat = with_encoder();
    let mut session = seat.open(5).unwrap();
    let path = |class, instance, attribute| Name::Path { class, instance, attribute };
    let by_key = session.value(&key("steps-per-turn")).unwrap();
    assert_eq!(by_key.place, "2Fh/1/7");
    assert_eq!(session.value(&path(0x2F, 1, 7)).unwrap(), by_key);
    let by_parameter = session.value(&Name::Parameter(5)).unwrap();
    assert_eq!(by_parameter.reading, by_key.reading);
    assert_eq!(by_parameter.place, "0Fh/5, which is 2Fh/1/7");
    assert_eq!(session.value(&path(0x0F, 5, 1)).unwrap(), by_parameter);
    let raw = session.value(&path(0x05, 1, 9)).unwrap();
    assert_eq!((raw.reading, raw.label.as_deref()), (Reading::Octets(vec![0xC4, 9]), Some("2500")));
    let given = Reading::Octets(vec![0x88, 0x13]);
    assert_eq!(session.write(&path(0x05, 1, 9), &given).unwrap().label.as_deref(), Some("5000"));
    let number = session.write(&path(0x05, 1, 9), &Reading::Number(1)).unwrap_err();
    assert_eq!(number.kind, Kind::Usage);
    let nothing = session.value(&path(0x77, 1, 1)).unwrap_err();
    assert_eq!(nothing.came, "it answers 16 object does not exist");
}

#[test]
fn a_released_encoder_is_free_for_its_own_master() {
    let mut seat = WireSeat::new();
    let id = seat.encoder(5, "amg11-d29", "still");
    seat.run(secs(3));
    let mut session = seat.open(5).unwrap();
    session.sample().unwrap();
    session.release().unwrap();
    assert_eq!(session.value(&key("position")).unwrap_err().kind, Kind::Usage);
    session.release().unwrap();
    drop(session);
    assert_eq!(seat.device(id).server().master(), None);
}

#[test]
fn two_encoders_are_told_apart() {
    let mut seat = WireSeat::new();
    seat.encoder(5, "amg11-d29", "still angle=100");
    seat.encoder(6, "hmg10-d13", "still angle=200");
    seat.run(secs(3));
    for (address, position, turns) in [(5, 100, 65_535), (6, 200, 0)] {
        let mut session = seat.open(address).unwrap();
        assert_eq!(number(&mut session, "position"), position);
        assert_eq!(number(&mut session, "revolutions"), turns);
        session.release().unwrap();
    }
}
