use super::*;

/// The end of a request of six characters that begins at the origin.
fn asked() -> Instant {
    bits_after(micros(0), 66)
}

/// Master 2 says `request`, and `bits` after its end the station says `answer`.
fn answering(request: &str, bits: u32, answer: &str) -> Vec<String> {
    let end = micros(0) + RATE.characters(octets(request).len() as u32);
    let (mut wire, _) = line([
        ("master", saying(micros(0), request)),
        ("slave", saying(bits_after(end, bits), answer)),
    ]);
    violations(&events(&mut wire, millis(5)))
}

/// The master says `first`, and `bits` after its end `second`.
fn going_on(first: &str, bits: u32, second: &str) -> Vec<String> {
    let end = micros(0) + RATE.characters(octets(first).len() as u32);
    let both = saying(micros(0), first).sending(bits_after(end, bits), telegram(second));
    let (mut wire, _) = line([("master", both)]);
    violations(&events(&mut wire, millis(5)))
}

#[test]
fn an_answer_before_min_t_sdr_is_named() {
    assert_eq!(answering(ASK_7, 11, ANSWER_OF_7), [""; 0]);
    assert_eq!(
        answering(ASK_7, 10, ANSWER_OF_7),
        ["slave answers 10 bits after the request: min T_SDR is 11"]
    );
}

#[test]
fn an_answer_after_max_t_sdr_of_the_rate_is_named() {
    let longest = [60, 60, 60, 60, 60, 100, 150, 250, 450, 800];
    for (rate, longest) in BaudRate::ALL.into_iter().zip(longest) {
        for (bits, late) in [(longest, false), (longest + 1, true)] {
            let mut wire = Wire::new(1);
            let master = Script::new(rate).sending(micros(0), telegram(ASK_7));
            wire.attach("master", master, Attachment::default());
            let at = micros(0) + rate.bits(66) + rate.bits(bits);
            let slave = Script::new(rate).sending(at, telegram(ANSWER_OF_7));
            wire.attach("slave", slave, Attachment::default());
            let expected = format!(
                "slave answers {bits} bits after the request: max T_SDR is {longest} at {rate}"
            );
            let found = violations(&events(&mut wire, millis(1_000)));
            assert_eq!(found, vec![expected; usize::from(late)]);
        }
    }
}

#[test]
fn a_short_acknowledge_is_an_answer_too() {
    let set_prm = "68 0C 0C 68 87 82 5C 3D 3E 88 01 14 0B 05 9B 00 28 16";
    assert_eq!(answering(set_prm, 11, "E5"), [""; 0]);
    assert_eq!(
        answering(set_prm, 5, "E5"),
        ["slave answers 5 bits after the request: min T_SDR is 11"]
    );
}

#[test]
fn a_request_with_fewer_than_33_idle_bits_before_it_is_named() {
    assert_eq!(going_on("DC 02 02", 33, ASK_7), [""; 0]);
    assert_eq!(
        going_on("DC 02 02", 32, ASK_7),
        ["master begins 10 07 02 49 52 16 after 32 idle bits: 33 precede a request or a token"]
    );
    assert_eq!(
        going_on(ASK_7, 20, "DC 02 02"),
        ["master begins DC 02 02 after 20 idle bits: 33 precede a request or a token"]
    );
}

#[test]
fn a_station_with_a_microsecond_clock_is_granted_two_microseconds() {
    for (short, granted) in [(2_000, true), (2_010, false)] {
        let end = micros(0) + RATE.characters(3);
        let at = end + RATE.bits(33) - Duration::from_nanos(short);
        let both = saying(micros(0), "DC 02 02").sending(at, telegram(ASK_7));
        let mut wire = Wire::new(1);
        let clock = Attachment { microsecond_clock: true, ..Attachment::default() };
        wire.attach("master", both, clock);
        assert_eq!(violations(&events(&mut wire, millis(1))).is_empty(), granted);
    }
}

#[test]
fn who_answers_without_having_been_asked_is_named() {
    let (mut wire, _) = line([("slave", saying(micros(0), ANSWER_OF_7))]);
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        ["slave answers 10 02 07 00 09 16 without having been asked"]
    );
    let global_control = "68 07 07 68 FF 82 46 3A 3E 02 00 41 16";
    assert_eq!(
        answering(global_control, 11, "E5"),
        ["slave answers E5 without having been asked"],
        "nobody answers SDN"
    );
    assert_eq!(answering("DC 02 02", 11, "E5"), ["slave answers E5 without having been asked"]);
}

#[test]
fn who_answers_twice_is_named() {
    let (mut wire, _) = line([
        ("master", saying(micros(0), ASK_7)),
        (
            "slave",
            saying(bits_after(asked(), 11), ANSWER_OF_7)
                .sending(bits_after(asked(), 100), telegram("E5")),
        ),
    ]);
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        ["slave answers E5 without having been asked"]
    );
}

#[test]
fn who_answers_for_another_or_to_another_is_named() {
    assert_eq!(
        answering(ASK_7, 11, "10 02 08 00 0A 16"),
        ["slave answers 10 02 08 00 0A 16 as address 8 to 2, but 2 has asked 7"]
    );
    assert_eq!(
        answering(ASK_7, 11, "10 03 07 00 0A 16"),
        ["slave answers 10 03 07 00 0A 16 as address 7 to 3, but 2 has asked 7"]
    );
}

#[test]
fn who_answers_a_request_that_was_broken_is_named() {
    let (mut wire, [master, _]) = line([
        ("master", saying(micros(0), ASK_7)),
        ("slave", saying(bits_after(asked(), 11), ANSWER_OF_7)),
    ]);
    wire.set_corruption_at(master, Some(1.0));
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        ["slave answers 10 02 07 00 09 16 without having been asked"]
    );
}

#[test]
fn a_master_that_speaks_while_another_has_the_token_is_named() {
    let of_three = "10 07 03 49 53 16";
    let (mut wire, _) = line([
        ("two", saying(micros(0), "DC 02 02")),
        ("three", saying(micros(100), of_three)),
        ("four", saying(micros(200), "DC 04 04")),
        ("still two", saying(micros(300), ASK_7)),
    ]);
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        [
            "three sends 10 07 03 49 53 16 as master 3, while master 2 has the line",
            "four sends DC 04 04 as master 4, while master 2 has the line",
        ]
    );
}

#[test]
fn a_token_that_is_handed_on_gives_the_line_to_the_next() {
    let of_three = "10 07 03 49 53 16";
    let (mut wire, _) = line([
        // The first token was not seen, so it is handed on once more.
        ("two", saying(micros(0), "DC 03 02").sending(micros(200), telegram("DC 03 02"))),
        ("three", saying(micros(300), of_three)),
        ("two again", saying(micros(400), "DC 03 02")),
    ]);
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        ["two again sends DC 03 02 as master 2, while master 3 has the line"]
    );
}

#[test]
fn a_master_that_knows_no_token_has_the_line_by_speaking_until_it_is_silent_for_long() {
    let of_three = "10 07 03 49 53 16";
    let silence = 6 * 150;
    let speaks = |bits| {
        let (mut wire, _) = line([
            ("two", saying(micros(0), ASK_7)),
            ("three", saying(bits_after(asked(), bits), of_three)),
        ]);
        violations(&events(&mut wire, millis(5)))
    };
    assert_eq!(speaks(silence - 1).len(), 1);
    assert_eq!(speaks(silence), [""; 0]);
}

#[test]
fn a_request_in_the_middle_of_another_telegram_is_named() {
    let (mut wire, _) = line([
        ("master", saying(micros(0), ASK_7)),
        ("slave", saying(bits_after(asked(), 11), ANSWER_OF_7)),
        ("stray", saying(bits_after(asked(), 30), ASK_7)),
    ]);
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        ["stray begins 10 07 02 49 52 16 after 0 idle bits: 33 precede a request or a token"]
    );
}

#[test]
fn a_pause_inside_a_telegram_is_named() {
    assert_eq!(
        going_on("10 07 02", 5, "49 52 16"),
        [
            "master sends 10 07 02, which is no whole telegram",
            "master pauses for 5 bits inside a telegram, before 49 52 16",
        ]
    );
}

#[test]
fn what_is_no_telegram_is_named() {
    let (mut wire, _) = line([("stranger", saying(micros(0), "10 07 02 49 53 16"))]);
    assert_eq!(
        violations(&events(&mut wire, millis(1))),
        ["stranger sends 10 07 02 49 53 16, which is no whole telegram"]
    );
    assert_eq!(wire.statistics().violations, 1);
}

#[test]
fn the_bring_up_of_a_real_master_breaks_no_rule() {
    let conversation = [
        ("68 05 05 68 87 82 6C 3C 3E EF 16", "68 0B 0B 68 82 87 08 3E 3C 02 05 00 FF 05 9B 31 16"),
        (
            "68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00 A2 16",
            "E5",
        ),
        ("68 06 06 68 87 82 7C 3E 3E F1 F2 16", "E5"),
        ("DC 02 02", ""),
        ("68 07 07 68 07 02 7D 00 00 00 00 86 16", "68 07 07 68 02 07 08 00 00 12 34 57 16"),
    ];
    let (mut master, mut slave) = (listener(), listener());
    let mut at = micros(10);
    for (request, answer) in conversation {
        let (request, answer) = (telegram(request), telegram(answer));
        master.send(at, request);
        let answers = at + RATE.characters(request.octets().len() as u32) + RATE.bits(11);
        slave.send(answers, answer);
        at = answers + RATE.characters(answer.octets().len() as u32) + RATE.bits(33);
    }
    let (mut wire, _) = line([("master", master), ("slave", slave)]);
    let seen = events(&mut wire, millis(5));
    assert_eq!(violations(&seen), [""; 0]);
    assert_eq!(telegrams(&seen).len(), 9);
}
