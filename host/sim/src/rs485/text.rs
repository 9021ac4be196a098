//! Telegrams as people write them.

use codewheel_station::rs485::{TRANSMISSION_OCTETS, Transmission};
use thiserror::Error;

/// Why a text is no telegram.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum TelegramTextError {
    /// A word is not two hexadecimal digits.
    #[error("'{0}' is no octet: two hexadecimal digits, as in `10 07 02 49 52 16`")]
    NoOctet(String),
    /// More octets than leave at once.
    #[error("{0} octets; at most {TRANSMISSION_OCTETS} leave without a pause")]
    TooLong(usize),
}

/// Reads octets as the books print them, `10 07 02 49 52 16`. Whether they make a telegram is not
/// asked.
///
/// # Errors
/// A word that is not two hexadecimal digits, or more than 255 of them.
pub fn parse_telegram(text: &str) -> Result<Transmission, TelegramTextError> {
    let octet = |word: &str| match word.as_bytes() {
        [high, low] if high.is_ascii_hexdigit() && low.is_ascii_hexdigit() => {
            u8::from_str_radix(word, 16).ok()
        }
        _ => None,
    };
    let octets = text
        .split_whitespace()
        .map(|word| octet(word).ok_or_else(|| TelegramTextError::NoOctet(word.to_owned())))
        .collect::<Result<Vec<u8>, _>>()?;
    Transmission::new(&octets).ok_or(TelegramTextError::TooLong(octets.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_as_the_books_print_it_is_read_back() {
        for text in ["E5", "DC 02 02", "10 07 02 49 52 16", ""] {
            assert_eq!(format!("{:?}", parse_telegram(text).unwrap()), text);
        }
    }

    #[test]
    fn what_is_no_octet_is_shown() {
        for word in ["1", "100", "+1", "G0", "é"] {
            let error = parse_telegram(&format!("E5 {word}")).unwrap_err();
            assert_eq!(error, TelegramTextError::NoOctet(word.to_owned()));
        }
        let error = parse_telegram(&"00 ".repeat(256)).unwrap_err();
        assert_eq!(error.to_string(), "256 octets; at most 255 leave without a pause");
    }
}
