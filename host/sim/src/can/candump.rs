//! Frames as text, in the notation of candump.

use codewheel_station::Instant;
use codewheel_station::can::{Frame, Identifier};

/// One line of a log as `candump -L` writes it: `(0000000002.000045) vcan0 3C5#00100000`.
#[must_use]
pub fn candump_line(at: Instant, channel: &str, frame: &Frame) -> String {
    let micros = at.as_nanos() / 1_000;
    format!("({:010}.{:06}) {channel} {frame}", micros / 1_000_000, micros % 1_000_000)
}

/// Why a text is no CAN frame.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "'{0}' is no CAN frame: write an identifier of 3 or 8 hex digits, '#', then up to 8 octets of \
     2 hex digits or R and a length, as in 3C5#00100000"
)]
pub struct FrameTextError(String);

/// The frame that `text` writes as candump does: `42D#`, `3C5#00100000`, `7FF#R4`, `00012345#AB`.
/// Dots between the octets are skipped.
///
/// # Errors
/// [`FrameTextError`] where the text is no CAN frame.
pub fn parse_frame(text: &str) -> Result<Frame, FrameTextError> {
    frame(text).ok_or_else(|| FrameTextError(text.to_owned()))
}

fn frame(text: &str) -> Option<Frame> {
    let (identifier, rest) = text.trim().split_once('#')?;
    let bits = hex(identifier)?;
    let identifier = match identifier.len() {
        3 => Identifier::Standard(u16::try_from(bits).ok()?),
        8 => Identifier::Extended(bits),
        _ => return None,
    };
    if let Some(length) = rest.strip_prefix('R') {
        let length = if length.is_empty() { 0 } else { hex(length)? as usize };
        return Frame::remote(identifier, length).ok();
    }
    let digits: Vec<u8> = rest.bytes().filter(|&octet| octet != b'.').collect();
    if !digits.len().is_multiple_of(2) {
        return None;
    }
    let octets: Option<Vec<u8>> = digits
        .chunks_exact(2)
        .map(|pair| hex(std::str::from_utf8(pair).ok()?).and_then(|octet| u8::try_from(octet).ok()))
        .collect();
    Frame::new(identifier, &octets?).ok()
}

/// Hex digits and nothing else: `from_str_radix` alone would take a sign.
fn hex(digits: &str) -> Option<u32> {
    if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    u32::from_str_radix(digits, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_reads_back_as_it_is_written() {
        for text in ["42D#", "3C5#00100000", "7FF#R4", "00012345#AB", "000#0102030405060708"] {
            assert_eq!(parse_frame(text).unwrap().to_string(), text);
        }
        assert_eq!(parse_frame("3C5#00.10.00.00").unwrap().to_string(), "3C5#00100000");
    }

    #[test]
    fn what_is_no_frame_is_refused_with_an_example() {
        for text in ["", "#", "3C5", "C5#", "800#", "+12#", "3C5#1", "3C5#ü0", "3C5#R9", "3C5#+1"]
        {
            let error = parse_frame(text).unwrap_err().to_string();
            assert!(error.contains("as in 3C5#00100000"), "{error}");
        }
        assert!(parse_frame("3C5#010203040506070809").is_err());
        assert!(parse_frame("20000000#").is_err());
    }

    #[test]
    fn a_line_is_one_that_candump_would_write() {
        let at = Instant::from_nanos(2_000_045_999);
        let frame = Frame::standard(0x3C5, &[0, 0x10, 0, 0]);
        assert_eq!(candump_line(at, "vcan0", &frame), "(0000000002.000045) vcan0 3C5#00100000");
    }
}
