//! What was written is read back, in every format.

use codewheel_capture::{Bus, Condition, Direction, Format, Medium, Timestamp};
use codewheel_station::can::{BitRate, Frame, Identifier};
use codewheel_station::rs485::BaudRate;

use crate::bench::{BEGIN, Kept, Said, can0, file, pb0, read, read_whole};

fn at(micros: u64) -> Timestamp {
    Timestamp::from_nanos(BEGIN.as_nanos() + micros * 1_000)
}

fn frames() -> Vec<Kept> {
    let frame = |identifier, data: &[u8]| Frame::new(identifier, data).unwrap();
    let all = [
        Frame::standard(0x42D, &[]),
        Frame::standard(0x3C5, &[0, 0x10, 0, 0]),
        Frame::standard(0x000, &[1, 2, 3, 4, 5, 6, 7, 8]),
        Frame::standard(0x7FF, &[0xFF; 8]),
        frame(Identifier::Extended(0), &[0xAB]),
        frame(Identifier::Extended(0x1FFF_FFFF), &[]),
        Frame::remote(Identifier::Standard(0x123), 0).unwrap(),
        Frame::remote(Identifier::Standard(0x123), 8).unwrap(),
        Frame::remote(Identifier::Extended(0x123), 4).unwrap(),
    ];
    (0..).zip(all).map(|(place, frame)| kept(place, Said::Frame(frame))).collect()
}

fn telegrams() -> Vec<Kept> {
    let all = [
        Said::Telegram(vec![0xE5], Condition::Intact),
        Said::Telegram(vec![0xDC, 2, 2], Condition::Intact),
        Said::Telegram(vec![0x10, 7, 2, 0x49, 0x52, 0x16], Condition::Broken),
        Said::Telegram(vec![0x55], Condition::Broken),
        Said::Telegram((1..=255).collect(), Condition::Intact),
    ];
    (0..).zip(all).map(|(place, said)| kept(place, said)).collect()
}

fn kept(place: u64, content: Said) -> Kept {
    let direction = if place.is_multiple_of(2) { Direction::Received } else { Direction::Sent };
    Kept { at: at(place * 1_234_567), bus: 0, direction, content }
}

#[test]
fn every_frame_comes_back_from_every_format_with_its_microsecond_and_its_direction() {
    for format in Format::ALL {
        let written = file(format, vec![can0()], &frames());
        assert_eq!(read_whole(format, &written), frames(), "{format}");
    }
}

#[test]
fn every_telegram_comes_back_from_both_formats_that_carry_telegrams() {
    for format in [Format::Log, Format::Pcapng] {
        let written = file(format, vec![pb0()], &telegrams());
        assert_eq!(read_whole(format, &written), telegrams(), "{format}");
    }
}

#[test]
fn several_buses_share_a_file_and_keep_their_names() {
    let buses = vec![can0(), pb0(), Bus::devicenet("can1", BitRate::Kbit125)];
    let mut records = vec![frames()[1].clone(), telegrams()[2].clone(), frames()[2].clone()];
    for (record, bus) in records.iter_mut().zip(0..) {
        record.bus = bus;
    }
    for format in [Format::Log, Format::Pcapng] {
        let (back, errors, found) = read(format, &file(format, buses.clone(), &records));
        assert!(errors.is_empty());
        assert_eq!(back, records, "{format}");
        let names: Vec<_> = found.iter().map(|bus| (bus.name.as_str(), bus.medium)).collect();
        let expected =
            [("can0", Medium::DeviceNet), ("pb0", Medium::Profibus), ("can1", Medium::DeviceNet)];
        assert_eq!(names, expected, "{format}");
    }
    let (_, _, found) = read(Format::Pcapng, &file(Format::Pcapng, buses.clone(), &[]));
    assert_eq!(found, buses, "pcapng also keeps the rates");
}

#[test]
fn numbered_formats_keep_several_can_buses_apart() {
    let buses = vec![can0(), Bus::devicenet("can1", BitRate::Kbit125)];
    let mut records = vec![frames()[1].clone(), frames()[2].clone()];
    records[1].bus = 1;
    for format in [Format::Asc, Format::Trc] {
        let (back, errors, found) = read(format, &file(format, buses.clone(), &records));
        assert!(errors.is_empty());
        assert_eq!(back, records, "{format}");
        assert_eq!(found.len(), 2);
    }
}

#[test]
fn pcapng_keeps_nanoseconds() {
    let moment = Timestamp::from_nanos(1_795_334_400_123_456_789);
    let record = Kept { at: moment, ..telegrams()[0].clone() };
    let bus = Bus::profibus("pb0", BaudRate::Mbit12);
    let written = file(Format::Pcapng, vec![bus], std::slice::from_ref(&record));
    assert_eq!(read_whole(Format::Pcapng, &written), [record]);
}
