//! One SLCAN line: written from a frame, gathered from octets, read back into a frame.

use std::fmt;

use codewheel_station::can::{Frame, Identifier};

use crate::output::Portion;

/// Ends every line.
pub(crate) const CR: u8 = b'\r';
/// Says no, alone and without a CR after it.
pub(crate) const BEL: u8 = 0x07;

/// The longest line there is: `T`, 8 digits of identifier, 1 of length, 16 of data, 4 of time, CR.
const LONGEST: usize = 31;

/// A whole line of at most 31 octets, with its end (CR, or BEL for a refusal).
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Line {
    octets: [u8; LONGEST],
    length: u8,
}

impl Line {
    /// The refusal: a lone BEL (07h).
    pub const REFUSED: Self = Self::short(b"\x07");
    /// The plain agreement: a lone CR.
    pub const DONE: Self = Self::short(b"\r");

    /// A line from `text` with its end; what exceeds 31 octets is cut off.
    pub(crate) const fn short(text: &[u8]) -> Self {
        let mut line = Self { octets: [0; LONGEST], length: 0 };
        let mut index = 0;
        while index < text.len() && index < LONGEST {
            line.octets[index] = text[index];
            index += 1;
        }
        line.length = index as u8;
        line
    }

    /// The line for `frame`: `t`, `T`, `r` or `R`; `timestamp` in milliseconds, 0 … 59 999, is
    /// appended as four hexadecimal digits where the client asked for it (`Z1`).
    #[must_use]
    pub fn frame(frame: &Frame, timestamp: Option<u16>) -> Self {
        let mut line = Self { octets: [0; LONGEST], length: 0 };
        let remote = frame.is_remote();
        match frame.identifier() {
            Identifier::Standard(bits) => {
                line.push(if remote { b'r' } else { b't' });
                line.push_hex(u32::from(bits), 3);
            }
            Identifier::Extended(bits) => {
                line.push(if remote { b'R' } else { b'T' });
                line.push_hex(bits, 8);
            }
        }
        line.push_hex(frame.length() as u32, 1);
        for octet in frame.data() {
            line.push_hex(u32::from(*octet), 2);
        }
        if let Some(milliseconds) = timestamp {
            line.push_hex(u32::from(milliseconds), 4);
        }
        line.push(CR);
        line
    }

    /// The octets to write, with the end of the line.
    #[must_use]
    pub fn as_octets(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }

    fn push(&mut self, octet: u8) {
        if let Some(place) = self.octets.get_mut(usize::from(self.length)) {
            *place = octet;
            self.length += 1;
        }
    }

    fn push_hex(&mut self, value: u32, digits: u32) {
        for digit in (0..digits).rev() {
            let nibble = (value >> (4 * digit)) & 0xF;
            self.push(b"0123456789ABCDEF"[nibble as usize]);
        }
    }
}

impl Portion for Line {
    fn as_octets(&self) -> &[u8] {
        self.as_octets()
    }

    /// One frame, or none: a lost answer is nothing to a peer that does not read.
    fn loss(&self) -> u64 {
        u64::from(matches!(self.as_octets().first(), Some(b't' | b'T' | b'r' | b'R')))
    }
}

impl fmt::Debug for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\"", self.as_octets().escape_ascii())
    }
}

/// Gathers the octets of one line. Holds at most 31, however long the line is.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gatherer {
    octets: [u8; LONGEST],
    length: usize,
}

impl Gatherer {
    /// Appends an octet; one that no longer fits spoils the line until [`clear`](Self::clear).
    pub(crate) fn push(&mut self, octet: u8) {
        if let Some(place) = self.octets.get_mut(self.length) {
            *place = octet;
        }
        self.length = self.length.saturating_add(1);
    }

    /// The line so far without its end; `None` when it is longer than any line can be.
    pub(crate) fn line(&self) -> Option<&[u8]> {
        self.octets.get(..self.length)
    }

    /// Forgets the line.
    pub(crate) fn clear(&mut self) {
        self.length = 0;
    }
}

/// Reads a line without its end as a frame and what follows its data; `None` where it is none:
/// an unknown letter, an identifier above 7FF or 1FFFFFFF, a length above 8, digits missing.
pub(crate) fn parse_frame(line: &[u8]) -> Option<(Frame, &[u8])> {
    let (letter, rest) = line.split_first()?;
    let (digits, remote) = match letter {
        b't' => (3, false),
        b'T' => (8, false),
        b'r' => (3, true),
        b'R' => (8, true),
        _ => return None,
    };
    let (identifier, rest) = rest.split_at_checked(digits)?;
    let bits = hex(identifier)?;
    let identifier = match digits {
        3 => Identifier::Standard(bits as u16),
        _ => Identifier::Extended(bits),
    };
    let (length, rest) = rest.split_first()?;
    let length = hex(&[*length])? as usize;
    if remote {
        return Some((Frame::remote(identifier, length).ok()?, rest));
    }
    let mut data = [0; 8];
    let data = data.get_mut(..length)?;
    let (digits, rest) = rest.split_at_checked(2 * length)?;
    for (octet, pair) in data.iter_mut().zip(digits.chunks_exact(2)) {
        *octet = hex(pair)? as u8;
    }
    Some((Frame::new(identifier, data).ok()?, rest))
}

/// The value of at most eight hexadecimal digits, upper or lower case.
pub(crate) fn hex(digits: &[u8]) -> Option<u32> {
    digits
        .iter()
        .try_fold(0, |value: u32, digit| Some(value << 4 | char::from(*digit).to_digit(16)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(frame: &Frame, timestamp: Option<u16>) -> String {
        String::from_utf8(Line::frame(frame, timestamp).as_octets().to_vec()).unwrap()
    }

    #[test]
    fn frames_are_written_as_the_manual_prints_them() {
        // CAN232 manual, commands t, T, r and R.
        assert_eq!(line(&Frame::standard(0x100, &[0x11, 0x33]), None), "t10021133\r");
        let wide = Frame::new(Identifier::Extended(0x100), &[0x11, 0x33]).unwrap();
        assert_eq!(line(&wide, None), "T0000010021133\r");
        let asking = Frame::remote(Identifier::Standard(0x100), 2).unwrap();
        assert_eq!(line(&asking, None), "r1002\r");
        let asking = Frame::remote(Identifier::Extended(0x100), 2).unwrap();
        assert_eq!(line(&asking, None), "R000001002\r");
    }

    #[test]
    fn the_longest_frame_with_its_time_fits_a_line() {
        let frame = Frame::new(Identifier::Extended(0x1FFF_FFFF), &[0xAB; 8]).unwrap();
        assert_eq!(line(&frame, Some(59_999)), "T1FFFFFFF8ABABABABABABABABEA5F\r");
    }

    #[test]
    fn a_frame_is_read_in_either_case_and_what_follows_it_is_left() {
        let (frame, rest) = parse_frame(b"t3c52aBCd1234").unwrap();
        assert_eq!(frame.to_string(), "3C5#ABCD");
        assert_eq!(rest, b"1234");
    }

    #[test]
    fn what_is_no_frame_is_none() {
        for text in [
            "",
            "t",
            "t10",
            "t100",
            "t1009",
            "t1002112",
            "t800",
            "t8000",
            "T200000000",
            "tG000",
            "t10021G",
            "T000001002113",
            "r1009",
            "r100",
            "x1000",
            "t+100",
            "t100A",
            "t100 ",
        ] {
            assert_eq!(parse_frame(text.as_bytes()), None, "{text}");
        }
    }
}
