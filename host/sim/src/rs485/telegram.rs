//! As much of a telegram as the rules of the line ask for (EN 50170-2).
//!
//! The stations have a reader of their own. This one is the judge's, and shares nothing with it.

/// Who speaks to whom. Addresses are 0 … 127, without the bit that announces service access points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Telegram {
    /// SD4: a master hands the token on.
    Token { to: u8, from: u8 },
    /// A master asks or commands.
    Request {
        to: u8,
        from: u8,
        /// Whether its service has an answer: not SDN.
        asks: bool,
    },
    /// A station answers.
    Answer { to: u8, from: u8 },
    /// SC: a station answers without a word.
    Acknowledge,
}

/// The address that all stations listen to.
const EVERYBODY: u8 = 127;
/// The bit of FC that makes a telegram a request.
const REQUEST: u8 = 0x40;

impl Telegram {
    /// Reads one whole telegram; `None` where the octets are anything else.
    pub(super) fn read(octets: &[u8]) -> Option<Self> {
        let body = match *octets {
            [0xE5] => return Some(Self::Acknowledge),
            [0xDC, to, from] => return Some(Self::Token { to: address(to), from: address(from) }),
            [0x10, ref body @ .., check, 0x16] if body.len() == 3 => checked(body, check)?,
            [0xA2, ref body @ .., check, 0x16] if body.len() == 11 => checked(body, check)?,
            [0x68, length, repeated, 0x68, ref body @ .., check, 0x16]
                if length == repeated && body.len() == usize::from(length) =>
            {
                checked(body, check)?
            }
            _ => return None,
        };
        let &[to, from, function, ..] = body else { return None };
        let (to, from) = (address(to), address(from));
        if function & REQUEST == 0 {
            return Some(Self::Answer { to, from });
        }
        let send_without_answer = matches!(function & 0x0F, 4 | 6);
        Some(Self::Request { to, from, asks: to != EVERYBODY && !send_without_answer })
    }
}

const fn address(octet: u8) -> u8 {
    octet & 0x7F
}

/// The octets from DA to the last of the data, where their sum is right.
fn checked(body: &[u8], check: u8) -> Option<&[u8]> {
    (body.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet)) == check).then_some(body)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rs485::parse_telegram;

    fn read(text: &str) -> Option<Telegram> {
        Telegram::read(parse_telegram(text).unwrap().octets())
    }

    #[test]
    fn each_kind_of_telegram_says_who_speaks_to_whom() {
        let (to, from) = (7, 2);
        assert_eq!(read("DC 07 02"), Some(Telegram::Token { to, from }));
        assert_eq!(read("10 07 02 49 52 16"), Some(Telegram::Request { to, from, asks: true }));
        assert_eq!(
            read("68 05 05 68 87 82 6C 3C 3E EF 16"),
            Some(Telegram::Request { to, from, asks: true }),
            "Slave_Diag"
        );
        assert_eq!(
            read("A2 07 02 7D 00 00 00 00 00 00 00 00 86 16"),
            Some(Telegram::Request { to, from, asks: true })
        );
        assert_eq!(
            read("68 07 07 68 FF 82 46 3A 3E 02 00 41 16"),
            Some(Telegram::Request { to: 127, from, asks: false }),
            "Global_Control"
        );
        assert_eq!(read("10 02 07 00 09 16"), Some(Telegram::Answer { to: 2, from: 7 }));
        assert_eq!(read("E5"), Some(Telegram::Acknowledge));
    }

    #[test]
    fn what_is_not_whole_is_no_telegram() {
        for text in [
            "",
            "E5 E5",
            "10 07 02 49 52",
            "10 07 02 49 53 16",
            "10 07 02 49 52 17",
            "68 05 06 68 87 82 6C 3C 3E EF 16",
            "68 05 05 68 87 82 6C 3C 3E EF",
            "68 02 02 68 07 02 09 16",
            "DC 02",
        ] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
