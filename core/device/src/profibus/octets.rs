//! Where a value lies in a telegram.

use core::fmt;

/// Octets of Set_Prm or Slave_Diag, counted from 1 as the manual counts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Octets {
    /// The first.
    pub first: u8,
    /// The last.
    pub last: u8,
}

impl Octets {
    /// A single octet.
    #[must_use]
    pub const fn one(octet: u8) -> Self {
        Self { first: octet, last: octet }
    }

    /// From `first` to `last`.
    #[must_use]
    pub const fn span(first: u8, last: u8) -> Self {
        Self { first, last }
    }

    /// How many they are.
    #[must_use]
    pub const fn count(self) -> usize {
        (self.last - self.first) as usize + 1
    }

    /// These octets of a telegram whose first octet in `octets` is number `from`; `None` where it
    /// ends before they do.
    #[must_use]
    pub fn of(self, octets: &[u8], from: u8) -> Option<&[u8]> {
        let first = usize::from(self.first.checked_sub(from)?);
        octets.get(first..first + self.count())
    }
}

impl fmt::Display for Octets {
    /// `octet 9`, `octets 10–13`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { first, last } = self;
        if first == last {
            write!(f, "octet {first}")
        } else {
            write!(f, "octets {first}–{last}")
        }
    }
}

/// The number that `octets` are, the highest octet first; of more than eight the last ones.
pub(super) fn number(octets: &[u8]) -> u64 {
    octets.iter().fold(0, |number, octet| number << 8 | u64::from(*octet))
}
