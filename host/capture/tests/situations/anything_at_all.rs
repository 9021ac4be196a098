//! Any octets whatever: never a panic, never an endless loop, never a record that cannot be.

use codewheel_capture::{Assume, Condition, Decoder, Direction, Format, Output};
use codewheel_station::can::Frame;
use proptest::prelude::*;

use crate::bench::{BEGIN, Kept, Said, can0, file, pb0, read};

fn text_like() -> impl Strategy<Value = Vec<u8>> {
    let word = prop_oneof![
        Just("(1.5)".to_owned()),
        Just("0.5".to_owned()),
        Just("1)".to_owned()),
        Just("can0".to_owned()),
        Just("1".to_owned()),
        Just("42B#0A8E".to_owned()),
        Just("042B".to_owned()),
        Just("Rx".to_owned()),
        Just("Tx".to_owned()),
        Just("DT".to_owned()),
        Just("RR".to_owned()),
        Just("-".to_owned()),
        Just("d".to_owned()),
        Just("r".to_owned()),
        Just("8".to_owned()),
        Just("68".to_owned()),
        Just("!".to_owned()),
        Just("\n".to_owned()),
        Just(";$FILEVERSION=2.1\n".to_owned()),
        Just(";$FILEVERSION=1.1\n".to_owned()),
        Just(";$STARTTIME=99999999999999999999.9\n".to_owned()),
        Just(";$COLUMNS=N,O,T,B,I,d,R,L,D\n".to_owned()),
        Just("date Sun Nov 22 08:00:00.000 2026\n".to_owned()),
        Just("base hex timestamps relative\n".to_owned()),
        "[ -~]{0,12}",
    ];
    prop::collection::vec(word, 0..60).prop_map(|words| words.join(" ").into_bytes())
}

proptest! {
    #[test]
    fn readers_end_whatever_a_file_holds(
        octets in prop_oneof![prop::collection::vec(any::<u8>(), 0..600), text_like()],
    ) {
        for format in Format::ALL {
            let (records, errors, buses) = read(format, &octets);
            prop_assert!(records.len() + errors.len() <= octets.len() + 1);
            prop_assert!(records.iter().all(|record| usize::from(record.bus) < buses.len()));
        }
    }

    #[test]
    fn readers_bear_any_flipped_octet_of_a_good_file(
        place in any::<prop::sample::Index>(),
        octet in any::<u8>(),
    ) {
        let said = [
            Said::Frame(Frame::standard(0x42B, &[1, 2, 3])),
            Said::Telegram(vec![0xDC, 2, 2], Condition::Broken),
        ];
        let records: Vec<Kept> = (0..)
            .zip(said)
            .map(|(bus, content)| Kept { at: BEGIN, bus, direction: Direction::Sent, content })
            .collect();
        for format in [Format::Log, Format::Pcapng] {
            let mut file = file(format, vec![can0(), pb0()], &records);
            let place = place.index(file.len());
            file[place] = octet;
            let (records, errors, _) = read(format, &file);
            prop_assert!(records.len() + errors.len() <= 5, "{records:?} {errors:?}");
        }
    }

    #[test]
    fn every_frame_gets_one_line_and_one_object(
        frames in prop::collection::vec(
            (
                prop_oneof![
                    0_u16..0x800,
                    // The explicit and unconnected messages of two slaves.
                    prop::sample::select(vec![0x42B_u16, 0x42C, 0x42E, 0x433, 0x434]),
                ],
                prop::collection::vec(
                    prop_oneof![
                        any::<u8>(),
                        prop::sample::select(vec![0x0A_u8, 0x8A, 0x0E, 0x8E, 0x01, 0x2F, 0x0F, 0x03, 0x4B]),
                    ],
                    0..=8,
                ),
            ),
            1..40,
        ),
    ) {
        let contents: Vec<Said> = frames
            .iter()
            .map(|(identifier, data)| Said::Frame(Frame::standard(*identifier, data)))
            .collect();
        judge(&contents)?;
    }

    #[test]
    fn every_telegram_gets_one_line_and_one_object(
        telegrams in prop::collection::vec(telegram(), 1..40),
    ) {
        let contents: Vec<Said> = telegrams
            .into_iter()
            .map(|(octets, condition)| Said::Telegram(octets, condition))
            .collect();
        judge(&contents)?;
    }
}

/// Whole telegrams of any head and data, and any octets.
fn telegram() -> impl Strategy<Value = (Vec<u8>, Condition)> {
    let address = prop::sample::select(vec![2_u8, 7, 9, 127, 0x82, 0x87, 0xFF]);
    let code =
        prop_oneof![any::<u8>(), prop::sample::select(vec![0x6C_u8, 0x5D, 0x08, 0x0A, 0x46])];
    let sap = prop::sample::select(vec![55_u8, 56, 57, 58, 59, 60, 61, 62]);
    let data = prop::collection::vec(any::<u8>(), 0..60);
    let whole = (address.clone(), address, code, sap.clone(), sap, data).prop_map(
        |(to, from, code, destination, source, data)| {
            let body = [&[to, from, code, destination, source][..], &data].concat();
            let length = body.len() as u8;
            let sum = body.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet));
            [&[0x68, length, length, 0x68][..], &body, &[sum, 0x16]].concat()
        },
    );
    let octets = prop_oneof![
        4 => whole,
        1 => prop::collection::vec(any::<u8>(), 1..255),
        1 => Just(vec![0xE5]),
        1 => Just(vec![0xDC, 2, 2]),
    ];
    (octets, prop_oneof![9 => Just(Condition::Intact), 1 => Just(Condition::Broken)])
}

fn judge(contents: &[Said]) -> Result<(), TestCaseError> {
    for assume in [Assume::Encoders, Assume::Nothing] {
        let mut text = Decoder::new(Output::Text, assume);
        let mut json = Decoder::new(Output::Json, assume);
        for content in contents {
            let content = content.clone();
            let kept = Kept { at: BEGIN, bus: 0, direction: Direction::Received, content };
            let bus = if matches!(kept.content, Said::Frame(_)) { can0() } else { pb0() };
            let mut out = Vec::new();
            text.decode(&bus, &kept.record(), &mut out);
            let line = str::from_utf8(&out).expect("text");
            prop_assert!(line.ends_with('\n') && line.lines().count() == 1, "{:?}", line);
            prop_assert!(line.trim_end().chars().all(|letter| !letter.is_control()));
            out.clear();
            json.decode(&bus, &kept.record(), &mut out);
            let object = serde_json::from_slice::<serde_json::Value>(&out);
            prop_assert!(object.is_ok(), "{}", String::from_utf8_lossy(&out));
        }
    }
    Ok(())
}
