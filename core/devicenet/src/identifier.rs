//! What the 11 bits of a DeviceNet identifier say (IEC 62026-3; CIP volume 3, chapter 3).
//!
//! | group | bits | range | |
//! |---|---|---|---|
//! | 1 | `0 mmmm ssssss` | 000–3FF | message, source MAC ID |
//! | 2 | `10 aaaaaa mmm` | 400–5FF | MAC ID, message |
//! | 3 | `11 mmm ssssss` | 600–7BF | message 0–6, source MAC ID |
//! | 4 | `11111 mmmmmm` | 7C0–7EF | message 00–2F |
//! | – | | 7F0–7FF | invalid |

use crate::MacId;

/// Group 1 message 13: a slave's change of state or cyclic production.
pub const CHANGE_OF_STATE_MESSAGE: u8 = 13;
/// Group 1 message 15: a slave's poll response, or its acknowledge of a master's change of state.
pub const POLL_RESPONSE: u8 = 15;
/// Group 2 message 2: the master's acknowledge of a change of state or cyclic production; the MAC
/// ID is the destination.
pub const CHANGE_ACKNOWLEDGE: u8 = 2;
/// Group 2 message 3: the slave's explicit or unconnected response; the MAC ID is the source.
pub const EXPLICIT_RESPONSE: u8 = 3;
/// Group 2 message 4: the master's explicit request; the MAC ID is the destination.
pub const EXPLICIT_REQUEST: u8 = 4;
/// Group 2 message 5: the master's poll command or change of state; the MAC ID is the destination.
pub const POLL_COMMAND: u8 = 5;
/// Group 2 message 6: an unconnected explicit request to a Group 2 Only Server, its destination.
pub const UNCONNECTED_REQUEST: u8 = 6;
/// Group 2 message 7: the duplicate MAC ID check.
pub const DUPLICATE_MAC_CHECK: u8 = 7;

/// A DeviceNet identifier taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Identifier {
    /// High-priority I/O and explicit messages of the source MAC ID.
    Group1 {
        /// Message number, 0 … 15.
        message: u8,
        /// Who sends.
        source: MacId,
    },
    /// The predefined master/slave connection set.
    Group2 {
        /// Source or destination, as the message number says.
        mac: MacId,
        /// Message number, 0 … 7.
        message: u8,
    },
    /// Low-priority messages of the source MAC ID.
    Group3 {
        /// Message number, 0 … 6.
        message: u8,
        /// Who sends.
        source: MacId,
    },
    /// Off-line connection set and communication-faulted nodes.
    Group4 {
        /// Message number, 00 … 2F.
        message: u8,
    },
    /// 7F0–7FF: no DeviceNet identifier.
    Invalid(u16),
}

impl Identifier {
    /// Takes the low 11 bits of `bits` apart. Every value has a meaning.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Self {
        let bits = bits & 0x7FF;
        let source = MacId::from_low_bits(bits);
        match bits {
            0x000..=0x3FF => Self::Group1 { message: (bits >> 6) as u8, source },
            0x400..=0x5FF => {
                Self::Group2 { mac: MacId::from_low_bits(bits >> 3), message: (bits & 7) as u8 }
            }
            0x600..=0x7BF => Self::Group3 { message: (bits >> 6 & 7) as u8, source },
            0x7C0..=0x7EF => Self::Group4 { message: (bits & 0x3F) as u8 },
            _ => Self::Invalid(bits),
        }
    }

    /// The 11 bits. Message numbers are cut to the bits their group has.
    #[must_use]
    pub const fn to_bits(self) -> u16 {
        match self {
            Self::Group1 { message, source } => group_1(message, source),
            Self::Group2 { mac, message } => group_2(mac, message),
            Self::Group3 { message, source } => {
                0x600 | (message as u16 & 7) << 6 | source.value() as u16
            }
            Self::Group4 { message } => 0x7C0 | message as u16 & 0x3F,
            Self::Invalid(bits) => bits,
        }
    }
}

/// The bits of a group 1 identifier: `0 mmmm ssssss`.
#[must_use]
pub const fn group_1(message: u8, source: MacId) -> u16 {
    (message as u16 & 0xF) << 6 | source.value() as u16
}

/// The bits of a group 2 identifier: `10 aaaaaa mmm`.
#[must_use]
pub const fn group_2(mac: MacId, message: u8) -> u16 {
    0x400 | (mac.value() as u16) << 3 | message as u16 & 7
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_identifier_survives_being_taken_apart() {
        for bits in 0..=0x7FF {
            assert_eq!(Identifier::from_bits(bits).to_bits(), bits);
        }
    }

    #[test]
    fn groups_begin_and_end_where_the_standard_says() {
        let mac = |value| MacId::new(value).unwrap();
        let id = Identifier::from_bits;
        assert_eq!(id(0x3C5), Identifier::Group1 { message: POLL_RESPONSE, source: mac(5) });
        assert_eq!(id(0x3FF), Identifier::Group1 { message: 15, source: mac(63) });
        assert_eq!(id(0x400), Identifier::Group2 { mac: mac(0), message: 0 });
        assert_eq!(id(0x42F), Identifier::Group2 { mac: mac(5), message: DUPLICATE_MAC_CHECK });
        assert_eq!(id(0x5FF), Identifier::Group2 { mac: mac(63), message: 7 });
        assert_eq!(id(0x600), Identifier::Group3 { message: 0, source: mac(0) });
        assert_eq!(id(0x7BF), Identifier::Group3 { message: 6, source: mac(63) });
        assert_eq!(id(0x7EC), Identifier::Group4 { message: 0x2C });
        assert_eq!(id(0x7EF), Identifier::Group4 { message: 0x2F });
        assert_eq!(id(0x7F0), Identifier::Invalid(0x7F0));
    }
}
