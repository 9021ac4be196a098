//! Files that are damaged or cut off: what is good of them is not lost, and the rest is named.

use codewheel_capture::{Condition, Damage, Direction, Format, Place, ReadError};
use codewheel_station::can::Frame;

use crate::bench::{BEGIN, Kept, Said, can0, file, pb0, read};

fn frames(count: u16) -> Vec<Kept> {
    let frame = |number| Said::Frame(Frame::standard(0x400 + number, &[number as u8; 8]));
    (0..count)
        .map(|number| Kept {
            at: BEGIN,
            bus: 0,
            direction: Direction::Received,
            content: frame(number),
        })
        .collect()
}

fn damage(error: &ReadError) -> (Place, Damage) {
    match error {
        ReadError::Damage { place, damage } => (*place, *damage),
        other => panic!("{other}"),
    }
}

#[test]
fn a_damaged_line_is_named_and_those_around_it_are_read() {
    for (format, good, bad, line) in [
        (Format::Log, "402#0202", "402#0Z02", 3),
        (Format::Asc, "d 8 02 02", "d 8 02 Z2", 8),
        (Format::Trc, "8    02 02", "8    02 Z2", 15),
    ] {
        let text = String::from_utf8(file(format, vec![can0()], &frames(5))).unwrap();
        let (back, errors, _) = read(format, text.replace(good, bad).as_bytes());
        let mut expected = frames(5);
        expected.remove(2);
        assert_eq!(back, expected, "{format}");
        assert_eq!(errors.len(), 1);
        assert_eq!(damage(&errors[0]), (Place::Line(line), Damage::Octet), "{format}");
        assert!(errors[0].is_local());
    }
}

#[test]
fn a_file_cut_anywhere_gives_what_was_whole_and_says_where_it_ends() {
    for format in Format::ALL {
        let whole = file(format, vec![can0()], &frames(3));
        let first = read(format, &whole).0;
        for end in 0..whole.len() {
            let (back, errors, _) = read(format, &whole[..end]);
            assert!(first.starts_with(&back), "{format} cut at {end}: {back:?}");
            assert!(errors.len() <= 1, "{format} cut at {end}: {errors:?}");
        }
    }
    let whole = file(Format::Pcapng, vec![can0()], &frames(3));
    let blocks: Vec<usize> = blocks(&whole).collect();
    let packets = &blocks[2..5];
    let (back, errors, _) = read(Format::Pcapng, &whole[..packets[2] + 20]);
    assert_eq!(back, frames(2));
    assert_eq!(damage(&errors[0]), (Place::Offset(packets[2] as u64), Damage::Truncated));
    assert!(errors[0].to_string().starts_with(&format!("octet {}: ", packets[2])));
}

/// Where the blocks of a pcapng begin.
fn blocks(file: &[u8]) -> impl Iterator<Item = usize> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let begin = next;
        let length = file.get(begin + 4..begin + 8)?;
        next += u32::from_le_bytes(length.try_into().unwrap()) as usize;
        Some(begin)
    })
}

#[test]
fn a_last_line_without_its_end_is_not_taken_for_a_shorter_frame() {
    let whole = file(Format::Log, vec![can0()], &frames(2));
    let (back, errors, _) = read(Format::Log, &whole[..whole.len() - 3]);
    assert_eq!(back, frames(1));
    assert_eq!(damage(&errors[0]), (Place::Line(2), Damage::Cut));
}

#[test]
fn a_block_with_lengths_that_contradict_each_other_ends_a_pcapng() {
    let whole = file(Format::Pcapng, vec![can0()], &frames(3));
    let at = blocks(&whole).nth(3).unwrap();
    let mut damaged = whole.clone();
    damaged[at + 4] += 4;
    let (back, errors, _) = read(Format::Pcapng, &damaged);
    assert_eq!(back, frames(1));
    assert_eq!(errors.len(), 1);
    assert_eq!(damage(&errors[0]), (Place::Offset(at as u64), Damage::Block));
    assert!(!errors[0].is_local());
}

#[test]
fn a_packet_that_holds_no_frame_is_named_and_the_next_one_is_read() {
    let whole = file(Format::Pcapng, vec![can0()], &frames(3));
    let at = blocks(&whole).nth(3).unwrap();
    let mut damaged = whole.clone();
    // The length octet of the frame: more than it has.
    damaged[at + 28 + 4] = 9;
    let (back, errors, _) = read(Format::Pcapng, &damaged);
    assert_eq!(back, [frames(3)[0].clone(), frames(3)[2].clone()]);
    assert_eq!(damage(&errors[0]), (Place::Offset(at as u64), Damage::Short));
    assert!(errors[0].is_local());
}

#[test]
fn what_is_no_pcapng_is_said_at_once() {
    let (back, errors, _) = read(Format::Pcapng, b"(1.0) can0 42B#00\nand more of it");
    assert!(back.is_empty());
    assert_eq!(damage(&errors[0]), (Place::Offset(0), Damage::NoPcapng));
}

#[test]
fn a_line_without_an_end_costs_no_memory_and_the_next_one_is_read() {
    let mut text = vec![b'x'; 1 << 20];
    text.push(b'\n');
    text.extend_from_slice(b"(1.0) can0 42B#00\n");
    let (back, errors, _) = read(Format::Log, &text);
    assert_eq!(back.len(), 1);
    assert_eq!(damage(&errors[0]), (Place::Line(1), Damage::Line));
}

#[test]
fn a_telegram_of_no_octets_or_of_too_many_is_refused() {
    for line in ["(1.0) pb0 T\n".to_owned(), format!("(1.0) pb0{}\n", " 00".repeat(256))] {
        let (back, errors, _) = read(Format::Log, line.as_bytes());
        assert!(back.is_empty());
        assert_eq!(damage(&errors[0]), (Place::Line(1), Damage::Length));
    }
    let longest = Kept {
        at: BEGIN,
        bus: 0,
        direction: Direction::Received,
        content: Said::Telegram(vec![0; 255], Condition::Broken),
    };
    let written = file(Format::Log, vec![pb0()], std::slice::from_ref(&longest));
    assert_eq!(read(Format::Log, &written).0, [longest]);
}
