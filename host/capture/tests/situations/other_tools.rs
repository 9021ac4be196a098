//! Files as other tools write them.

use codewheel_capture::{Damage, Direction, Format, ReadError, Timestamp};
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
fn trc_of_versions_1_1_1_3_and_2_0() {
    let frame = Frame::standard(0x123, &[1, 2]);
    // 25569 days after the end of 1899 the time of computers begins.
    let head = |version| format!(";$FILEVERSION={version}\n;$STARTTIME=25569.5\n");
    let half_a_day = 43_200_000_000_000;
    let files = [
        format!("{}     1)      1.5  Rx         0123  2  01 02\n", head("1.1")),
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
