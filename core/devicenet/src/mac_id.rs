//! The address of a DeviceNet node.

use core::fmt;

/// A MAC ID, 0 … 63: a node's address on its DeviceNet segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MacId(u8);

impl MacId {
    /// The highest address, 63.
    pub const MAX: Self = Self(63);

    /// The MAC ID `value`, or `None` above 63.
    #[must_use]
    pub const fn new(value: u8) -> Option<Self> {
        if value <= 63 { Some(Self(value)) } else { None }
    }

    /// The MAC ID in the low six bits of `bits`, as identifiers and message headers carry it.
    #[must_use]
    pub const fn from_low_bits(bits: u16) -> Self {
        Self((bits & 0x3F) as u8)
    }

    /// The address, 0 … 63.
    #[must_use]
    pub const fn value(self) -> u8 {
        self.0
    }
}

impl fmt::Display for MacId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
