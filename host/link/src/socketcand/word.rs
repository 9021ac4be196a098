//! What the server says.

use std::fmt;
use std::time::Duration;

use codewheel_station::can::{Frame, Identifier};

use crate::output::Portion;

/// One word of the server with its brackets, such as `< ok >`.
#[derive(Clone, PartialEq, Eq)]
pub struct Word {
    text: String,
    is_frame: bool,
}

impl Word {
    /// What a client is greeted with: `< hi >`.
    #[must_use]
    pub fn hi() -> Self {
        Self::plain("< hi >".to_owned())
    }

    /// `< ok >`.
    #[must_use]
    pub fn ok() -> Self {
        Self::plain("< ok >".to_owned())
    }

    /// `< echo >`.
    #[must_use]
    pub fn echo() -> Self {
        Self::plain("< echo >".to_owned())
    }

    /// The refusal: `< error unknown command >`.
    #[must_use]
    pub fn unknown() -> Self {
        Self::plain("< error unknown command >".to_owned())
    }

    /// `< stat rbytes rpackets tbytes tpackets >`: data octets and frames that the client was to
    /// receive and has sent.
    #[must_use]
    pub fn statistics(received: [u64; 2], sent: [u64; 2]) -> Self {
        let ([rbytes, rpackets], [tbytes, tpackets]) = (received, sent);
        Self::plain(format!("< stat {rbytes} {rpackets} {tbytes} {tpackets} >"))
    }

    /// A frame of the bus: `< frame 3C5 1.000002 0010 >`, for a remote frame `< rtr 3C5 1.000002 2 >`;
    /// `at` is the time since the beginning of 1970.
    #[must_use]
    pub fn frame(frame: &Frame, at: Duration) -> Self {
        let identifier = match frame.identifier() {
            Identifier::Standard(bits) => format!("{bits:03X}"),
            Identifier::Extended(bits) => format!("{bits:08X}"),
        };
        let (seconds, micros) = (at.as_secs(), at.subsec_micros());
        let text = if frame.is_remote() {
            format!("< rtr {identifier} {seconds}.{micros:06} {} >", frame.length())
        } else {
            let data: String = frame.data().iter().map(|octet| format!("{octet:02X}")).collect();
            format!("< frame {identifier} {seconds}.{micros:06} {data} >")
        };
        Self { text, is_frame: true }
    }

    /// The text to write.
    #[must_use]
    pub fn as_text(&self) -> &str {
        &self.text
    }

    const fn plain(text: String) -> Self {
        Self { text, is_frame: false }
    }
}

impl Portion for Word {
    fn as_octets(&self) -> &[u8] {
        self.text.as_bytes()
    }

    /// One frame, or none: a lost answer is nothing to a peer that does not read.
    fn loss(&self) -> u64 {
        self.is_frame.into()
    }
}

impl fmt::Debug for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.text, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_written_as_the_program_writes_them() {
        let at = Duration::from_micros(23_424_242);
        let word = |frame: &Frame| Word::frame(frame, at).as_text().to_owned();
        let frame = Frame::standard(0x123, &[0x11, 0x02]);
        assert_eq!(word(&frame), "< frame 123 23.424242 1102 >");
        // An empty frame has two blanks, as its reader counts them.
        assert_eq!(word(&Frame::standard(0x42D, &[])), "< frame 42D 23.424242  >");
        let wide = Frame::new(Identifier::Extended(0x42), &[0xAB]).unwrap();
        assert_eq!(word(&wide), "< frame 00000042 23.424242 AB >");
        let asking = Frame::remote(Identifier::Standard(0x123), 4).unwrap();
        assert_eq!(word(&asking), "< rtr 123 23.424242 4 >");
    }

    #[test]
    fn small_parts_of_a_second_keep_their_noughts() {
        let word = Word::frame(&Frame::standard(1, &[]), Duration::from_micros(1_000_002));
        assert_eq!(word.as_text(), "< frame 001 1.000002  >");
    }
}
