//! CAN 2.0 frames, what a controller reports, and acceptance filters.

use core::fmt;

/// The identifier of a CAN frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Identifier {
    /// 11 bits, 000–7FF: the only kind DeviceNet uses.
    Standard(u16),
    /// 29 bits, 00000000–1FFFFFFF.
    Extended(u32),
}

/// A CAN 2.0 data or remote frame with 0 … 8 data octets.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    identifier: Identifier,
    remote: bool,
    length: u8,
    data: [u8; 8],
}

/// Why octets do not make a CAN frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Invalid {
    /// The identifier needs more than 11 (standard) or 29 (extended) bits.
    Identifier,
    /// More than eight data octets.
    Length,
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Identifier => "the identifier is wider than 11 (standard) or 29 (extended) bits",
            Self::Length => "a CAN frame carries at most 8 data octets",
        })
    }
}

impl core::error::Error for Invalid {}

impl Frame {
    /// A data frame.
    ///
    /// # Errors
    /// [`Invalid`] where the identifier or the data do not fit a CAN frame.
    pub fn new(identifier: Identifier, data: &[u8]) -> Result<Self, Invalid> {
        let mut frame = Self::empty(identifier, data.len())?;
        if let Some(octets) = frame.data.get_mut(..data.len()) {
            octets.copy_from_slice(data);
        }
        Ok(frame)
    }

    /// A remote frame that asks for `length` octets.
    ///
    /// # Errors
    /// [`Invalid`] where the identifier or the length do not fit a CAN frame.
    pub fn remote(identifier: Identifier, length: usize) -> Result<Self, Invalid> {
        let mut frame = Self::empty(identifier, length)?;
        frame.remote = true;
        Ok(frame)
    }

    /// A data frame with an 11-bit identifier; only the low 11 bits of `identifier` and the first
    /// eight octets of `data` are taken.
    #[must_use]
    pub fn standard(identifier: u16, data: &[u8]) -> Self {
        let mut frame = Self {
            identifier: Identifier::Standard(identifier & 0x7FF),
            remote: false,
            length: data.len().min(8) as u8,
            data: [0; 8],
        };
        for (to, from) in frame.data.iter_mut().zip(data) {
            *to = *from;
        }
        frame
    }

    /// A data frame with an 11-bit identifier and the first `length` of `octets`; only the low 11
    /// bits of `identifier` are taken, and at most eight octets.
    #[inline]
    #[must_use]
    pub const fn of_octets(identifier: u16, octets: [u8; 8], length: usize) -> Self {
        let length = if length < 8 { length } else { 8 };
        // Whatever lies behind the length is none of the frame: equal frames are equal.
        let mask = match length {
            0 => 0,
            _ => u64::MAX >> (64 - 8 * length),
        };
        Self {
            identifier: Identifier::Standard(identifier & 0x7FF),
            remote: false,
            length: length as u8,
            data: (u64::from_le_bytes(octets) & mask).to_le_bytes(),
        }
    }

    fn empty(identifier: Identifier, length: usize) -> Result<Self, Invalid> {
        let fits = match identifier {
            Identifier::Standard(bits) => bits <= 0x7FF,
            Identifier::Extended(bits) => bits <= 0x1FFF_FFFF,
        };
        if !fits {
            return Err(Invalid::Identifier);
        }
        if length > 8 {
            return Err(Invalid::Length);
        }
        Ok(Self { identifier, remote: false, length: length as u8, data: [0; 8] })
    }

    /// The identifier.
    #[must_use]
    pub const fn identifier(&self) -> Identifier {
        self.identifier
    }

    /// Whether this is a remote frame, which asks for data and carries none.
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        self.remote
    }

    /// The data length code, 0 … 8: the octets carried, or asked for by a remote frame.
    #[must_use]
    pub const fn length(&self) -> usize {
        self.length as usize
    }

    /// The data octets; empty for a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        if self.remote {
            return &[];
        }
        self.data.get(..self.length as usize).unwrap_or_default()
    }
}

impl fmt::Debug for Frame {
    /// As `candump` writes it: `3C5#00100000`, `R` for remote frames, eight digits for extended
    /// identifiers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for Frame {
    /// As `candump -L` writes it: `3C5#00100000`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.identifier {
            Identifier::Standard(bits) => write!(f, "{bits:03X}#")?,
            Identifier::Extended(bits) => write!(f, "{bits:08X}#")?,
        }
        if self.remote {
            return write!(f, "R{}", self.length);
        }
        self.data().iter().try_for_each(|octet| write!(f, "{octet:02X}"))
    }
}

/// What a CAN controller reports to its station.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input<'a> {
    /// A frame of another node arrived.
    Frame(&'a Frame),
    /// Our frame went out and at least one node acknowledged it.
    Sent(&'a Frame),
    /// The controller has left the bus after too many errors. What was handed to it is gone.
    BusOff,
    /// The controller takes part again after a bus-off.
    Recovered,
    /// Nothing leads to the network any more: the plug is out, the adapter or the interface is gone.
    /// What was handed over is gone.
    Detached,
    /// The network is there again after [`Detached`](Self::Detached), with a controller that was
    /// started anew.
    Attached,
}

/// An acceptance filter for standard identifiers: a frame is taken when
/// `identifier & mask == value`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Filter {
    /// The bits that are compared, 000–7FF.
    pub mask: u16,
    /// What they must be.
    pub value: u16,
}

impl Filter {
    /// Takes every frame with a standard identifier.
    pub const ALL: Self = Self { mask: 0, value: 0 };

    /// Whether the filter lets `identifier` through.
    #[must_use]
    pub const fn accepts(self, identifier: u16) -> bool {
        identifier & self.mask == self.value
    }
}

/// The bit rate of a CAN segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BitRate {
    /// 125 kbit/s, the default of the switches (manual 9.1.2).
    #[default]
    Kbit125,
    /// 250 kbit/s.
    Kbit250,
    /// 500 kbit/s.
    Kbit500,
}

impl BitRate {
    /// All three, slowest first.
    pub const ALL: [Self; 3] = [Self::Kbit125, Self::Kbit250, Self::Kbit500];

    /// Bits per second.
    #[must_use]
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::Kbit125 => 125_000,
            Self::Kbit250 => 250_000,
            Self::Kbit500 => 500_000,
        }
    }

    /// The length of one bit in nanoseconds: 8000, 4000 or 2000.
    #[must_use]
    pub const fn bit_nanos(self) -> u64 {
        match self {
            Self::Kbit125 => 8_000,
            Self::Kbit250 => 4_000,
            Self::Kbit500 => 2_000,
        }
    }
}

impl fmt::Display for BitRate {
    /// `125k`, `250k` or `500k`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}k", self.bits_per_second() / 1_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn frames_read_as_candump_lines() {
        assert_eq!(Frame::standard(0x3C5, &[0, 0x10, 0, 0]).to_string(), "3C5#00100000");
        assert_eq!(Frame::standard(0x42D, &[]).to_string(), "42D#");
        let remote = Frame::remote(Identifier::Standard(0x7FF), 4).unwrap();
        assert_eq!(remote.to_string(), "7FF#R4");
        assert!(remote.data().is_empty());
        let wide = Frame::new(Identifier::Extended(0x12345), &[0xAB]).unwrap();
        assert_eq!(wide.to_string(), "00012345#AB");
    }

    #[test]
    fn what_is_no_can_frame_is_refused() {
        assert_eq!(Frame::new(Identifier::Standard(0x800), &[]), Err(Invalid::Identifier));
        assert_eq!(Frame::new(Identifier::Extended(1 << 29), &[]), Err(Invalid::Identifier));
        assert_eq!(Frame::new(Identifier::Standard(0), &[0; 9]), Err(Invalid::Length));
        assert_eq!(Frame::remote(Identifier::Standard(0), 9), Err(Invalid::Length));
    }

    #[test]
    fn equal_frames_are_equal_whatever_lies_behind_their_length() {
        let octets = [1, 2, 3, 4, 5, 6, 7, 8];
        for length in 0..12 {
            let frame = Frame::of_octets(0x7C5, octets, length);
            assert_eq!(frame, Frame::standard(0x7C5, &octets[..length.min(8)]));
        }
        assert_eq!(
            Frame::standard(1, &[1, 2]),
            Frame::new(Identifier::Standard(1), &[1, 2]).unwrap()
        );
    }

    #[test]
    fn a_filter_takes_what_agrees_in_the_masked_bits() {
        let group_2_of_mac_5 = Filter { mask: 0x7F8, value: 0x428 };
        assert!(group_2_of_mac_5.accepts(0x42F));
        assert!(!group_2_of_mac_5.accepts(0x430));
        assert!(Filter::ALL.accepts(0x7FF));
    }

    #[test]
    fn a_bit_lasts_as_long_as_the_rate_says() {
        for rate in BitRate::ALL {
            assert_eq!(rate.bit_nanos() * u64::from(rate.bits_per_second()), 1_000_000_000);
        }
        assert_eq!(BitRate::default().to_string(), "125k");
    }
}
