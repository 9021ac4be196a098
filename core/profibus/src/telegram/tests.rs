use super::*;
use crate::function_code::{Function, Reply};
use proptest::prelude::*;
use std::string::ToString;
use std::vec::Vec;
use std::{format, vec};

fn octets(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|octet| u8::from_str_radix(octet, 16).unwrap()).collect()
}

#[track_caller]
fn data(octets: &[u8]) -> Data<'_> {
    match Telegram::decode(octets) {
        Ok(Some(Telegram::Data(data))) => data,
        other => panic!("{other:?}"),
    }
}

/// Telegrams of all formats, and their places in the books.
const TELEGRAMS: &[&str] = &[
    "10 07 02 49 52 16",
    "68 07 07 68 07 02 7D 00 00 00 00 86 16",
    "68 05 05 68 87 82 6C 3C 3E EF 16",
    "A2 07 02 7D 01 02 03 04 05 06 07 08 AA 16",
    "DC 02 02",
    "E5",
];

#[test]
fn the_formats_are_those_of_the_book() {
    let formats = TELEGRAMS[..4].iter().map(|hex| data(&octets(hex)).format());
    assert!(formats.eq([Format::Short, Format::Variable, Format::Variable, Format::Eight]));
    let token = octets(TELEGRAMS[4]);
    let expected = Telegram::Token { destination: 2, source: 2 };
    assert_eq!(Telegram::decode(&token), Ok(Some(expected)));
    assert_eq!(Telegram::decode(&[0xE5]), Ok(Some(Telegram::ShortAcknowledge)));
}

#[test]
fn a_request_with_service_access_points_is_taken_apart() {
    let octets = octets("68 06 06 68 87 82 7C 3E 3E F1 F2 16");
    let data = data(&octets);
    assert_eq!((data.destination(), data.source()), (7, 2));
    assert_eq!(data.saps(), Ok(Some(Saps { destination: 62, source: 62 })));
    assert_eq!((data.unit(), data.data()), (&[0x3E, 0x3E, 0xF1][..], &[0xF1][..]));
    assert_eq!(data.function_code().function(), Some(Function::SrdLow));
}

#[test]
fn half_an_address_extension_is_told_from_none() {
    for hex in [
        "68 05 05 68 87 02 6C 3C 3E 6F 16", // only DA says so
        "68 05 05 68 07 82 6C 3C 3E 6F 16", // only SA says so
        "68 04 04 68 87 82 6C 3C B1 16",    // both, and one octet
        "10 87 82 6C 75 16",                // both, and none
    ] {
        assert_eq!(data(&octets(hex)).saps(), Err(HalfExtended), "{hex}");
    }
    assert_eq!(data(&octets(TELEGRAMS[0])).saps(), Ok(None));
}

#[test]
fn what_follows_a_telegram_is_not_looked_at() {
    for hex in TELEGRAMS {
        let whole = octets(hex);
        let more = [&whole[..], &[0xFF, 0x00]].concat();
        assert_eq!(Telegram::decode(&more), Telegram::decode(&whole), "{hex}");
        assert_eq!(Telegram::decode(&whole).unwrap().unwrap().length(), whole.len());
    }
}

#[test]
fn each_damage_has_its_name() {
    let damage = |hex| Telegram::decode(&octets(hex)).unwrap_err();
    assert_eq!(damage("17"), Damage::StartDelimiter);
    assert_eq!(damage("68 05 05 69"), Damage::StartDelimiter);
    assert_eq!(damage("68 05 06"), Damage::Length);
    assert_eq!(damage("68 03"), Damage::Length);
    assert_eq!(damage("68 FA"), Damage::Length);
    assert_eq!(damage("10 07 02 49 53 16"), Damage::Checksum);
    assert_eq!(damage("10 07 02 49 52 17"), Damage::EndDelimiter);
}

#[test]
fn the_lengths_of_sd2_go_from_4_to_249() {
    for length in 0..=255_u8 {
        let expected = match length {
            4..=249 => Ok(Some(usize::from(length) + 6)),
            _ => Err(Damage::Length),
        };
        assert_eq!(length_of(&[SD2, length, length, SD2]), expected);
    }
    let code = FunctionCode::reply(Reply::DataLow);
    let unit = [0; 247];
    assert!(Data::new(2, 7, code, &unit[..246]).is_some());
    assert_eq!(Data::new(2, 7, code, &unit), None);
    let head = Head { destination: 2, source: 7, function_code: code, saps: None };
    assert_eq!(head.transmission(&unit[..246]).unwrap().octets().len(), 255);
    assert_eq!(head.transmission(&unit), None);
    let extended = Head { saps: Some(Saps { destination: 62, source: 60 }), ..head };
    assert_eq!(extended.transmission(&unit[..244]).unwrap().octets().len(), 255);
    assert_eq!(extended.transmission(&unit[..245]), None);
}

#[test]
fn a_head_and_data_make_the_telegrams_of_the_book() {
    let saps = Some(Saps { destination: 62, source: 62 });
    let function_code = FunctionCode(0x7C);
    let head = Head { destination: 7, source: 2, function_code, saps };
    let hex = |transmission: Option<Transmission>| format!("{:?}", transmission.unwrap());
    assert_eq!(hex(head.transmission(&[0xF1])), "68 06 06 68 87 82 7C 3E 3E F1 F2 16");
    let status = Head { function_code: FunctionCode(0x49), saps: None, ..head };
    assert_eq!(hex(status.transmission(&[])), TELEGRAMS[0].to_string());
}

#[test]
fn a_telegram_that_finds_no_room_writes_nothing() {
    for hex in TELEGRAMS {
        let whole = octets(hex);
        let telegram = Telegram::decode(&whole).unwrap().unwrap();
        for room in 0..whole.len() {
            let mut buffer = vec![0; room];
            let mut out = Writer::new(&mut buffer);
            assert_eq!(telegram.encode(&mut out), Err(Full), "{hex} in {room} octets");
            assert!(out.is_empty());
        }
    }
}

/// Any telegram's octets, by way of [`Data::new`] and [`Data::as_eight`].
fn any_telegram() -> impl Strategy<Value = Vec<u8>> {
    let unit = prop_oneof![
        2 => prop::collection::vec(any::<u8>(), 0..=246),
        1 => prop::collection::vec(any::<u8>(), 8),
    ];
    let data = (any::<[u8; 3]>(), unit, any::<bool>()).prop_map(|(head, unit, eight)| {
        let [destination, source, code] = head;
        let data = Data::new(destination, source, FunctionCode(code), &unit).unwrap();
        let data = if eight { data.as_eight().unwrap_or(data) } else { data };
        Telegram::Data(data).transmission().unwrap().octets().to_vec()
    });
    prop_oneof![
        8 => data,
        1 => any::<[u8; 2]>().prop_map(|[destination, source]| vec![SD4, destination, source]),
        1 => Just(vec![SC]),
    ]
}

proptest! {
    #[test]
    fn every_encoded_telegram_decodes_back(octets in any_telegram()) {
        let telegram = Telegram::decode(&octets).unwrap().unwrap();
        prop_assert_eq!(telegram.length(), octets.len());
        let transmission = telegram.transmission().unwrap();
        prop_assert_eq!(transmission.octets(), &octets[..]);
    }

    #[test]
    fn every_prefix_of_a_telegram_is_not_yet_one(octets in any_telegram()) {
        for end in 0..octets.len() {
            prop_assert_eq!(Telegram::decode(&octets[..end]), Ok(None), "{} octets", end);
        }
    }

    #[test]
    fn a_head_and_data_decode_back(
        addresses in any::<[u8; 2]>(), code: u8, saps: Option<[u8; 2]>,
        payload in prop::collection::vec(any::<u8>(), 0..=244)
    ) {
        let [destination, source] = addresses.map(|address| address & 0x7F);
        let saps = saps.map(|[destination, source]| Saps { destination, source });
        let head = Head { destination, source, function_code: FunctionCode(code), saps };
        let transmission = head.transmission(&payload).unwrap();
        let data = data(transmission.octets());
        prop_assert_eq!((data.destination(), data.source()), (destination, source));
        prop_assert_eq!((data.saps(), data.data()), (Ok(saps), &payload[..]));
        prop_assert_eq!(data.function_code(), head.function_code);
    }

    #[test]
    fn whatever_octets_come_a_telegram_that_is_found_is_made_of_them(
        start in prop::sample::select(vec![SD1, SD2, SD3, SD4, SC, 0x16]),
        rest in prop::collection::vec(any::<u8>(), 0..300)
    ) {
        let octets = [&[start][..], &rest].concat();
        if let Ok(Some(telegram)) = Telegram::decode(&octets) {
            let transmission = telegram.transmission().unwrap();
            prop_assert!(octets.starts_with(transmission.octets()));
        }
    }
}
