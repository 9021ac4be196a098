//! What an adapter says to its client.

use codewheel_station::can::Frame;

use super::line::{BEL, CR, Gatherer, hex, parse_frame};

/// A line of an adapter, as its client understands it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A frame from the bus; its time, if any, has been checked and left out.
    Frame(Frame),
    /// A lone CR: done.
    Done,
    /// `z` or `Z`: the frame was taken.
    Taken,
    /// BEL: refused.
    Refused,
    /// `V…`, `N…`, `F…` or `v…`: news about the adapter.
    About,
    /// No SLCAN.
    Garbage,
}

/// Reads an adapter's answers out of its octets, cut into pieces as the network likes.
#[derive(Clone, Debug, Default)]
pub struct AnswerDecoder {
    line: Gatherer,
}

impl AnswerDecoder {
    /// Takes the next octet and gives the answer that it completes, if any. Line feeds are passed
    /// over; what was begun before a BEL is dropped, since nothing complete precedes one.
    pub fn push(&mut self, octet: u8) -> Option<Answer> {
        let answer = match octet {
            b'\n' => return None,
            BEL => Answer::Refused,
            CR => self.line.line().map_or(Answer::Garbage, parse),
            octet => {
                self.line.push(octet);
                return None;
            }
        };
        self.line.clear();
        Some(answer)
    }
}

fn parse(line: &[u8]) -> Answer {
    match line {
        [] => Answer::Done,
        b"z" | b"Z" => Answer::Taken,
        [b'V' | b'v' | b'N' | b'F', ..] => Answer::About,
        line => match parse_frame(line) {
            Some((frame, [])) => Answer::Frame(frame),
            Some((frame, time)) if time.len() == 4 && hex(time).is_some() => Answer::Frame(frame),
            _ => Answer::Garbage,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(octets: &[u8]) -> Vec<Answer> {
        let mut decoder = AnswerDecoder::default();
        octets.iter().filter_map(|octet| decoder.push(*octet)).collect()
    }

    #[test]
    fn answers_and_frames_with_or_without_time_are_told_apart() {
        let frame = Answer::Frame(Frame::standard(0x3C5, &[1, 2]));
        assert_eq!(
            read(b"\x07\r\rt3C520102\rz\rt3C520102EA5F\rZ\rV1013\r"),
            [
                Answer::Refused,
                Answer::Done,
                Answer::Done,
                frame,
                Answer::Taken,
                frame,
                Answer::Taken,
                Answer::About,
            ]
        );
    }

    #[test]
    fn garbage_ends_with_its_line() {
        assert_eq!(
            read(b"hello\rt3C520102EA\rt3C\x07z\r"),
            [Answer::Garbage, Answer::Garbage, Answer::Refused, Answer::Taken]
        );
    }
}
