//! Any octets whatever from an adapter into the reader of its client.

use codewheel_link::slcan::{Answer, AnswerDecoder, Line};
use codewheel_station::can::Identifier;

/// Reads `octets` and fails where the client understands what was not said.
pub(crate) fn body(octets: &[u8]) {
    let mut decoder = AnswerDecoder::default();
    let mut begin = 0;
    for (index, octet) in octets.iter().enumerate() {
        let answer = decoder.push(*octet);
        let is_end = matches!(octet, b'\r' | 0x07);
        assert_eq!(answer.is_some(), is_end, "an answer at each end of a line and nowhere else");
        if let Some(answer) = answer {
            judge(answer, &octets[begin..=index]);
            begin = index + 1;
            let fresh = AnswerDecoder::default().push(b'\r');
            assert_eq!(decoder.clone().push(b'\r'), fresh, "something stayed behind");
        }
    }
}

/// Held against the line without its line feeds.
fn judge(answer: Answer, said: &[u8]) {
    let said: Vec<u8> = said.iter().copied().filter(|octet| *octet != b'\n').collect();
    match answer {
        Answer::Refused => assert_eq!(said.last(), Some(&0x07)),
        Answer::Done => assert_eq!(said, b"\r"),
        Answer::Taken => assert!(said == b"z\r" || said == b"Z\r"),
        Answer::About => assert!(matches!(said[0], b'V' | b'v' | b'N' | b'F')),
        Answer::Garbage => assert!(said.len() > 1),
        Answer::Frame(frame) => {
            let fits = match frame.identifier() {
                Identifier::Standard(bits) => bits <= 0x7FF,
                Identifier::Extended(bits) => bits <= 0x1FFF_FFFF,
            };
            assert!(fits && frame.data().len() <= 8);
            let line = Line::frame(&frame, None);
            let line = &line.as_octets()[..line.as_octets().len() - 1];
            let time = &said[line.len()..said.len() - 1];
            let head = &said[..line.len()];
            assert!(head[0] == line[0] && head.eq_ignore_ascii_case(line), "{frame} misread");
            assert!(matches!(time.len(), 0 | 4), "{frame} with a time of {} digits", time.len());
        }
    }
}
