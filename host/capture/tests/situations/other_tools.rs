//! Files as other tools write them.

use codewheel_capture::{Damage, Direction, Format, ReadError, Reader, Timestamp};
use codewheel_station::can::{Frame, Identifier};

use crate::bench::{Said, read, read_whole};

#[track_caller]
fn frames(format: Format, text: &str) -> Vec<(u64, Direction, Frame)> {
    let frame = |said| match said {
        Said::Frame(frame) => frame,
        Said::Telegram(..) => panic!("a telegram"),
    };
    read_whole(format, text.as_bytes())
        .into_iter()
        .map(|kept| (kept.at.as_nanos(), kept.direction, frame(kept.content)))
        .collect()
}

#[test]
fn candump_with_directions_dots_remote_and_error_frames() {
    let text = "(1.5) vcan0 42B#0A.8E R\n\n(0000000002.000001) vcan0 42C# T\n\
                (3.0) vcan0 20000080#0000000000000000\n(4.0) vcan0 7FF#R\n";
    assert_eq!(
        frames(Format::Log, text),
        [
            (1_500_000_000, Direction::Received, Frame::standard(0x42B, &[0x0A, 0x8E])),
            (2_000_001_000, Direction::Sent, Frame::standard(0x42C, &[])),
            (
                4_000_000_000,
                Direction::Received,
                Frame::remote(Identifier::Standard(0x7FF), 0).unwrap()
            ),
        ]
    );
}

#[test]
fn can_fd_is_refused_by_name() {
    for (format, text) in [
        (Format::Log, "(1.0) vcan0 42B##10A\n"),
        (Format::Asc, "0.5 CANFD 1 Rx 42B 1 0 8 8 00\n"),
        (
            Format::Trc,
            ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n1 0.5 FD 1 042B Rx - 1 00\n",
        ),
    ] {
        let (_, errors, _) = read(format, text.as_bytes());
        let is_fd =
            |error: &ReadError| matches!(error, ReadError::Damage { damage: Damage::CanFd, .. });
        assert!(errors.len() == 1 && is_fd(&errors[0]), "{format}: {errors:?}");
    }
}

#[test]
fn an_asc_of_canoe_with_comments_events_and_twelve_hours() {
    let text = "date Sun Nov 22 08:00:00.000 am 2026\r\nbase hex  timestamps absolute\r\n\
                internal events logged\r\n// version 9.0.0\r\n\
                Begin Triggerblock Sun Nov 22 08:00:00.000 am 2026\r\n\
                   0.000000 Start of measurement\r\n   0.001000 1  Statistic: D 0 R 0\r\n\
                   0.015991 CAN 1 Status:chip status error active\r\n\
                   0.016000 1  ErrorFrame\r\n\
                   1.000500 2  42Bx            Rx   d 2 0A 8E  Length = 210000 BitCount = 108\r\n\
                   1.001000 1  123             Tx   r\r\nEnd TriggerBlock\r\n";
    let begin = 1_795_334_400_000_000_000;
    let extended = Frame::new(Identifier::Extended(0x42B), &[0x0A, 0x8E]).unwrap();
    let remote = Frame::remote(Identifier::Standard(0x123), 0).unwrap();
    assert_eq!(
        frames(Format::Asc, text),
        [
            (begin + 1_000_500_000, Direction::Received, extended),
            (begin + 1_001_000_000, Direction::Sent, remote)
        ]
    );
}

#[test]
fn an_asc_in_decimal_with_times_from_line_to_line() {
    let text = "base dec  timestamps relative\n0.5 1 291 Rx d 1 255\n0.25 1 291 Rx d 1 10\n";
    assert_eq!(
        frames(Format::Asc, text),
        [
            (500_000_000, Direction::Received, Frame::standard(0x123, &[0xFF])),
            (750_000_000, Direction::Received, Frame::standard(0x123, &[0x0A]))
        ]
    );
}

#[test]
fn trc_of_versions_1_1_to_2_0() {
    let frame = Frame::standard(0x123, &[1, 2]);
    // 25569 days after the end of 1899 the time of computers begins.
    let head = |version| format!(";$FILEVERSION={version}\n;$STARTTIME=25569.5\n");
    let half_a_day = 43_200_000_000_000;
    let files = [
        format!("{}     1)      1.5  Rx         0123  2  01 02\n", head("1.1")),
        format!("{}     1)     1.500 1  Rx        0123  2  01 02\n", head("1.2")),
        format!("{}     1)      1.500 1  Rx        0123 -  2    01 02\n", head("1.3")),
        format!(
            "{};$COLUMNS=N,O,T,I,d,l,D\n   1     1.500 DT    0123 Rx 2  01 02\n   2  2.0 ST   00 \
             00 00 00\n",
            head("2.0")
        ),
    ];
    for text in files {
        let expected = [(half_a_day + 1_500_000, Direction::Received, frame)];
        assert_eq!(frames(Format::Trc, &text), expected, "{text}");
    }
}

/// PCAN-Explorer 5 writes a semicolon behind the time, warnings in the place of a direction, and the
/// flag names of a warning behind its octets.
#[test]
fn a_trc_of_pcan_explorer_5_with_two_buses_and_a_warning() {
    let text = ";$FILEVERSION=1.2\r\n;$STARTTIME=25569.5;\r\n\
                \x20    1)      1.500 1 Rx           0123 2 01 02\r\n\
                \x20    2)      1.834 1 Warng FFFFFFFF 4 00 00 00 04 BUSLIGHT\r\n\
                \x20    3)      2.743 2 Tx           0100 3 RTR\r\n";
    let half_a_day = 43_200_000_000_000;
    let remote = Frame::remote(Identifier::Standard(0x100), 3).unwrap();
    assert_eq!(
        frames(Format::Trc, text),
        [
            (half_a_day + 1_500_000, Direction::Received, Frame::standard(0x123, &[1, 2])),
            (half_a_day + 2_743_000, Direction::Sent, remote),
        ]
    );
    let buses: Vec<u16> =
        read_whole(Format::Trc, text.as_bytes()).iter().map(|kept| kept.bus).collect();
    assert_eq!(buses, [0, 1]);
}

#[test]
fn a_text_that_an_editor_of_windows_has_saved_with_its_mark_before_it() {
    let log = "(1.0) can0 123#01\r\n";
    let asc = "date Sun Nov 22 08:00:00.000 2026\r\nbase hex timestamps absolute\r\n\
               0.5 1 123 Rx d 1 01\r\n";
    let trc = ";$FILEVERSION=1.1\r\n;$STARTTIME=25569.5\r\n 1) 1.5 Rx 0123 1 01\r\n";
    for (format, text) in [(Format::Log, log), (Format::Asc, asc), (Format::Trc, trc)] {
        let marked = frames(format, &format!("\u{FEFF}{text}"));
        assert_eq!(marked.len(), 1);
        assert_eq!(marked, frames(format, text), "{format}");
    }
}

#[test]
fn an_asc_with_a_comment_in_latin_letters_of_one_octet() {
    let text = b"base hex timestamps absolute\n// Gr\xF6\xDFe\n0.5 1 123 Rx d 1 01\n";
    let records = read_whole(Format::Asc, text);
    assert_eq!(records.len(), 1);
    assert_eq!(records[0].content, Said::Frame(Frame::standard(0x123, &[1])));
}

/// A long file of version 1.0 would else be complained of line by line.
#[test]
fn a_trc_without_a_version_is_over_at_its_first_line() {
    let text = "; a trace\n 1) 1841 0001 1 00\n 2) 1842 0001 1 00\n 3) 1843 0001 1 00\n";
    let (records, errors, _) = read(Format::Trc, text.as_bytes());
    assert!(records.is_empty());
    let [ReadError::Damage { damage: Damage::Head, .. }] = errors.as_slice() else {
        panic!("{errors:?}")
    };
    assert!(!errors[0].is_local());
}

#[test]
fn a_trc_of_an_unknown_version_is_refused_and_not_guessed() {
    let (records, errors, _) = read(Format::Trc, b";$FILEVERSION=9.9\n1 0.5 DT 1 0123 Rx - 0\n");
    assert!(records.is_empty());
    let damages: Vec<_> = errors
        .iter()
        .map(|error| match error {
            ReadError::Damage { damage, .. } => *damage,
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(damages, [Damage::Version, Damage::Head]);
}

#[test]
fn a_pcapng_in_the_other_octet_order_with_microseconds_and_foreign_interfaces() {
    let mut file = Vec::new();
    let mut block = |kind: u32, body: &[u8]| {
        let length = (body.len() as u32 + 12).to_be_bytes();
        file.extend([&kind.to_be_bytes()[..], &length, body, &length].concat());
    };
    block(
        0x0A0D_0D0A,
        &[0x1A, 0x2B, 0x3C, 0x4D, 0, 1, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255],
    );
    // Ethernet, then CAN without a resolution: microseconds.
    block(1, &[0, 1, 0, 0, 0, 0, 0, 0]);
    block(1, &[0, 227, 0, 0, 0, 0, 0, 0]);
    let packet = |interface: u8, octets: &[u8]| {
        let length = octets.len() as u8;
        let head =
            [0, 0, 0, interface, 0, 0, 0, 0, 0, 0x1E, 0x84, 0x80, 0, 0, 0, length, 0, 0, 0, length];
        let mut body = [&head[..], octets].concat();
        body.resize(body.len().next_multiple_of(4), 0);
        body
    };
    block(6, &packet(0, &[1, 2, 3]));
    block(6, &packet(1, &[0, 0, 1, 0x23, 1, 0, 0, 0, 0xAB]));
    block(0x0BAD, &[1, 2, 3, 4]);
    let records = read_whole(Format::Pcapng, &file);
    assert_eq!(records.len(), 1);
    assert_eq!(records[0].at, Timestamp::from_nanos(2_000_000_000));
    assert_eq!(records[0].content, Said::Frame(Frame::standard(0x123, &[0xAB])));
}

#[test]
fn packets_of_a_pcapng_that_have_no_time_are_counted_as_passed_over() {
    let mut file = Vec::new();
    let mut block = |kind: u32, body: &[u8]| {
        let length = (body.len() as u32 + 12).to_le_bytes();
        file.extend([&kind.to_le_bytes()[..], &length, body, &length].concat());
    };
    block(
        0x0A0D_0D0A,
        &[0x4D, 0x3C, 0x2B, 0x1A, 1, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255],
    );
    block(1, &[227, 0, 0, 0, 0, 0, 0, 0]);
    block(3, &[9, 0, 0, 0, 0, 0, 1, 0x23, 1, 0, 0, 0, 0xAB, 0, 0, 0]);
    let mut reader = Reader::new(file.as_slice(), Format::Pcapng);
    assert!(reader.read().unwrap().is_none());
    assert_eq!(reader.skipped(), 1);
}

/// A name may have been typed by anybody: it must neither colour a terminal nor split a bus in two.
#[test]
fn a_bus_whose_name_is_no_text_is_one_bus_and_harmless_to_a_terminal() {
    let text = b"(1.0) can\xFF\x1B[31m 123#01\n(2.0) can\xFF\x1B[31m 123#02\n";
    let mut reader = Reader::new(text.as_slice(), Format::Log);
    let mut places = Vec::new();
    while let Some((_, record)) = reader.read().unwrap() {
        places.push(record.bus);
    }
    assert_eq!(places, [0, 0]);
    let names: Vec<&str> = reader.buses().iter().map(|bus| bus.name.as_str()).collect();
    assert_eq!(names, ["can\u{FFFD}_[31m"]);
}
