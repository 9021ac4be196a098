//! Any octets whatever from a client into the channel of an adapter. The first octet says where the
//! rest is cut into pieces.

use codewheel_link::slcan::{Answer, AnswerDecoder, Channel, CommandDecoder, Effect, Line};
use codewheel_station::can::{Frame, Identifier};

/// Does what `octets` say and fails where the adapter says or does what it must not.
pub(crate) fn body(octets: &[u8]) {
    let Some((&cut, octets)) = octets.split_first() else { return };
    let mut whole = Channel::default();
    let mut effects = Vec::new();
    whole.receive(octets, |effect| effects.push(effect));

    let mut pieces = Channel::default();
    let mut others = Vec::new();
    for piece in octets.chunks(usize::from(cut % 32) + 1) {
        pieces.receive(piece, |effect| others.push(effect));
    }
    assert_eq!(effects, others, "cut after every {} octets", cut % 32 + 1);

    let lines = octets.iter().filter(|octet| **octet == b'\r').count();
    judge(&effects, lines);

    let mut decoder = CommandDecoder::default();
    let commands = octets.iter().filter_map(|octet| decoder.push(*octet)).count();
    assert_eq!(commands, lines, "one command a line");

    let is_open = effects.iter().rev().find_map(|effect| match effect {
        Effect::Opened { .. } => Some(true),
        Effect::Closed => Some(false),
        _ => None,
    });
    let delivered = whole.deliver(&Frame::standard(0x3C5, &[1, 2]), u64::from(cut) << 56);
    assert_eq!(delivered.is_some(), is_open == Some(true));
    if let Some(line) = delivered {
        arrives(&line, &Frame::standard(0x3C5, &[1, 2]));
    }
}

fn judge(effects: &[Effect], lines: usize) {
    let mut answers = 0;
    // Closed, or open with or without the right to speak.
    let mut access = None;
    let mut spoken = None;
    for effect in effects {
        match effect {
            Effect::Answer(line) => {
                answers += 1;
                assert!(matches!(line.as_octets(), [.., b'\r' | 0x07]), "{line:?} has no end");
                let expected: Option<&[u8]> =
                    spoken.take().map(|frame: Frame| match frame.identifier() {
                        Identifier::Standard(_) => &b"z\r"[..],
                        Identifier::Extended(_) => b"Z\r",
                    });
                assert!(expected.is_none_or(|expected| expected == line.as_octets()));
            }
            Effect::Transmit(frame) => {
                assert_eq!(access, Some(false), "{frame} from a channel that may not speak");
                spoken = Some(*frame);
                arrives(&Line::frame(frame, None), frame);
                arrives(&Line::frame(frame, Some(59_999)), frame);
            }
            Effect::Opened { listen_only, bit_rate } => {
                assert_eq!(access.replace(*listen_only), None, "opened twice");
                assert!(bit_rate.is_none_or(|rate| (10_000..=1_000_000).contains(&rate)));
            }
            Effect::Closed => assert!(access.take().is_some(), "closed twice"),
        }
    }
    assert_eq!(answers, lines, "one answer a line");
}

/// What the other side reads in `line` is `frame`.
fn arrives(line: &Line, frame: &Frame) {
    let mut decoder = AnswerDecoder::default();
    let mut answers = line.as_octets().iter().filter_map(|octet| decoder.push(*octet));
    assert_eq!(answers.next(), Some(Answer::Frame(*frame)));
    assert_eq!(answers.next(), None);
}
