//! RS-485 as PROFIBUS uses it: characters of eleven bits, ten rates, octets without a pause.

use core::fmt;
use core::hash::{Hash, Hasher};

use crate::{Duration, Station};

/// The bits of a character on the line: start, eight data bits, low first, even parity, stop.
pub const CHARACTER_BITS: u32 = 11;

/// A rate of PROFIBUS.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BaudRate {
    /// 9.6 kbit/s.
    Kbit9_6,
    /// 19.2 kbit/s.
    Kbit19_2,
    /// 45.45 kbit/s.
    Kbit45_45,
    /// 93.75 kbit/s.
    Kbit93_75,
    /// 187.5 kbit/s.
    Kbit187_5,
    /// 500 kbit/s.
    Kbit500,
    /// 1.5 Mbit/s.
    Mbit1_5,
    /// 3 Mbit/s.
    Mbit3,
    /// 6 Mbit/s.
    Mbit6,
    /// 12 Mbit/s.
    Mbit12,
}

impl BaudRate {
    /// All of them, the slowest first.
    pub const ALL: [Self; 10] = [
        Self::Kbit9_6,
        Self::Kbit19_2,
        Self::Kbit45_45,
        Self::Kbit93_75,
        Self::Kbit187_5,
        Self::Kbit500,
        Self::Mbit1_5,
        Self::Mbit3,
        Self::Mbit6,
        Self::Mbit12,
    ];

    /// Bits per second.
    #[must_use]
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::Kbit9_6 => 9_600,
            Self::Kbit19_2 => 19_200,
            Self::Kbit45_45 => 45_450,
            Self::Kbit93_75 => 93_750,
            Self::Kbit187_5 => 187_500,
            Self::Kbit500 => 500_000,
            Self::Mbit1_5 => 1_500_000,
            Self::Mbit3 => 3_000_000,
            Self::Mbit6 => 6_000_000,
            Self::Mbit12 => 12_000_000,
        }
    }

    /// Max T_SDR: the longest time in bits that a slave may take until it answers (EN 50170-2, the
    /// vendor's GSD file; 45.45k as its neighbours, a decision).
    #[must_use]
    pub const fn longest_station_delay(self) -> u32 {
        match self {
            Self::Kbit9_6
            | Self::Kbit19_2
            | Self::Kbit45_45
            | Self::Kbit93_75
            | Self::Kbit187_5 => 60,
            Self::Kbit500 => 100,
            Self::Mbit1_5 => 150,
            Self::Mbit3 => 250,
            Self::Mbit6 => 450,
            Self::Mbit12 => 800,
        }
    }

    /// How long `count` bits last, rounded up to the nanosecond.
    #[inline]
    #[must_use]
    pub const fn bits(self, count: u32) -> Duration {
        // A constant divisor for each rate, so that no division is left at 64 bits.
        let count = count as u64;
        Duration::from_nanos(match self {
            Self::Kbit9_6 => (count * 312_500).div_ceil(3),
            Self::Kbit19_2 => (count * 156_250).div_ceil(3),
            Self::Kbit45_45 => (count * 20_000_000).div_ceil(909),
            Self::Kbit93_75 => (count * 32_000).div_ceil(3),
            Self::Kbit187_5 => (count * 16_000).div_ceil(3),
            Self::Kbit500 => count * 2_000,
            Self::Mbit1_5 => (count * 2_000).div_ceil(3),
            Self::Mbit3 => (count * 1_000).div_ceil(3),
            Self::Mbit6 => (count * 500).div_ceil(3),
            Self::Mbit12 => (count * 250).div_ceil(3),
        })
    }

    /// How long `count` characters last without a pause.
    #[inline]
    #[must_use]
    pub const fn characters(self, count: u32) -> Duration {
        self.bits(count.saturating_mul(CHARACTER_BITS))
    }
}

impl fmt::Display for BaudRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Kbit9_6 => "9.6k",
            Self::Kbit19_2 => "19.2k",
            Self::Kbit45_45 => "45.45k",
            Self::Kbit93_75 => "93.75k",
            Self::Kbit187_5 => "187.5k",
            Self::Kbit500 => "500k",
            Self::Mbit1_5 => "1.5M",
            Self::Mbit3 => "3M",
            Self::Mbit6 => "6M",
            Self::Mbit12 => "12M",
        })
    }
}

/// What the line brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input<'a> {
    /// Octets that came without a pause between them; the moment they are handed in is the end of
    /// the last one.
    Octets(&'a [u8]),
    /// A character with a parity, framing or overrun error ended at the moment it is handed in.
    BrokenCharacter,
}

/// The most octets that leave without a pause: an SD2 telegram with `LE` 249 (EN 50170-2).
pub const TRANSMISSION_OCTETS: usize = 255;

/// Octets to be sent without a pause: one telegram. Two are equal where their octets are.
#[derive(Clone, Copy)]
pub struct Transmission {
    length: u8,
    /// Behind `length` they are nobody's.
    octets: [u8; TRANSMISSION_OCTETS],
}

impl Transmission {
    /// No octets: one to be written.
    pub const EMPTY: Self = Self { length: 0, octets: [0; TRANSMISSION_OCTETS] };

    /// The octets, of which there are at most [`TRANSMISSION_OCTETS`]; `None` for more.
    #[inline]
    #[must_use]
    pub fn new(octets: &[u8]) -> Option<Self> {
        let mut transmission = Self::EMPTY;
        transmission.set(octets).then_some(transmission)
    }

    /// The octets in the order in which they are sent.
    #[inline]
    #[must_use]
    pub fn octets(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// Whether there are no octets.
    #[inline]
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Replaces the octets. Says whether they have room; none are left where they have not.
    #[inline]
    pub fn set(&mut self, octets: &[u8]) -> bool {
        let (Some(room), Ok(length)) =
            (self.octets.get_mut(..octets.len()), u8::try_from(octets.len()))
        else {
            self.length = 0;
            return false;
        };
        // Most telegrams have 8 to 16 octets: two words that overlap, and no call.
        match (octets.first_chunk::<8>(), octets.last_chunk::<8>()) {
            (Some(first), Some(last)) if octets.len() <= 16 => {
                if let Some(room) = room.first_chunk_mut() {
                    *room = *first;
                }
                if let Some(room) = room.last_chunk_mut() {
                    *room = *last;
                }
            }
            _ => room.copy_from_slice(octets),
        }
        self.length = length;
        true
    }

    /// Where octets are written in place, from the first one on; say with
    /// [`set_length`](Self::set_length) how many. What was sent before may still stand there.
    #[inline]
    #[must_use]
    pub const fn room(&mut self) -> &mut [u8; TRANSMISSION_OCTETS] {
        &mut self.octets
    }

    /// The first `length` octets of the [room](Self::room) are to be sent.
    #[inline]
    pub const fn set_length(&mut self, length: u8) {
        self.length = length;
    }
}

impl PartialEq for Transmission {
    fn eq(&self, other: &Self) -> bool {
        self.octets() == other.octets()
    }
}

impl Eq for Transmission {}

impl Hash for Transmission {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.octets().hash(state);
    }
}

impl fmt::Debug for Transmission {
    /// Hexadecimal, as the books print telegrams: `10 07 02 49 52 16`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, octet) in self.octets().iter().enumerate() {
            let space = if place == 0 { "" } else { " " };
            write!(f, "{space}{octet:02X}")?;
        }
        Ok(())
    }
}

/// A [`Station`] on an RS-485 line.
pub trait Node: for<'a> Station<Input<'a> = Input<'a>, Output = Transmission> {
    /// The rate at which the station listens and speaks from now on. A station that searches for
    /// the rate of its line changes it in [`advance`](Station::advance) and
    /// [`handle`](Station::handle); whoever drives it asks anew after each of them.
    fn baud_rate(&self) -> BaudRate;
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;
    use std::hash::DefaultHasher;
    use std::string::ToString;

    #[test]
    fn bits_last_as_long_as_the_rate_says_rounded_up() {
        for rate in BaudRate::ALL {
            for count in [0_u32, 1, 11, 33, 143, 16_383, 1_000_000] {
                let exact = u64::from(count) * 1_000_000_000;
                let nanos = exact.div_ceil(u64::from(rate.bits_per_second()));
                assert_eq!(rate.bits(count).as_nanos(), nanos, "{count} bits at {rate}");
            }
        }
        assert_eq!(BaudRate::Mbit12.characters(1).as_nanos(), 917);
    }

    #[test]
    fn a_transmission_holds_what_it_was_made_of_and_no_more_than_a_telegram() {
        let octets: [u8; 255] = core::array::from_fn(|place| place as u8);
        for length in 0..=255 {
            let transmission = Transmission::new(&octets[..length]).unwrap();
            assert_eq!(transmission.octets(), &octets[..length]);
        }
        assert_eq!(Transmission::new(&[0; 256]), None);
    }

    #[test]
    fn octets_behind_the_last_one_make_no_difference() {
        let hash = |transmission: &Transmission| {
            let mut hasher = DefaultHasher::new();
            transmission.hash(&mut hasher);
            hasher.finish()
        };
        let fresh = Transmission::new(&[0xE5]).unwrap();
        let mut used = Transmission::new(&[0xDC, 2, 2]).unwrap();
        assert_ne!(used, fresh);
        used.room()[0] = 0xE5;
        assert_ne!(used, fresh, "three octets");
        used.set_length(1);
        assert_eq!((used, used.octets(), hash(&used)), (fresh, &[0xE5][..], hash(&fresh)));
        assert!(used.set(&[]) && used.is_empty());
        assert_eq!(used, Transmission::EMPTY);
    }

    #[test]
    fn octets_are_replaced_whole_or_by_none() {
        let octets: [u8; 255] = core::array::from_fn(|place| place as u8);
        let mut transmission = Transmission::new(&[0xEE; 255]).unwrap();
        for length in 0..=255 {
            assert!(transmission.set(&octets[..length]));
            assert_eq!(transmission.octets(), &octets[..length]);
            let behind = &transmission.room()[length..];
            assert_eq!(behind, &[0xEE; 255][length..], "nothing behind {length} octets");
        }
        assert!(!transmission.set(&[0; 256]));
        assert!(transmission.is_empty());
    }

    #[test]
    fn rates_and_telegrams_are_written_as_in_the_books() {
        assert_eq!(BaudRate::Kbit187_5.to_string(), "187.5k");
        assert_eq!(format!("{:?}", Transmission::new(&[0xDC, 2, 2]).unwrap()), "DC 02 02");
    }
}
