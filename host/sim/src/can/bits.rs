//! How many bits a frame occupies, and which frame wins the wire (ISO 11898-1, 10.4 and 10.6).

use codewheel_station::can::{Frame, Identifier};

/// CRC delimiter, acknowledge slot, acknowledge delimiter and seven bits of end of frame.
const TAIL: u32 = 10;

/// The intermission after each frame, before which nobody may start.
pub(super) const INTERFRAME_SPACE: u32 = 3;

/// CRC delimiter and acknowledge slot: what a sender puts out before it misses the acknowledge.
const UNTIL_ACKNOWLEDGE: u32 = 2;

/// An error frame as all see it, with the interframe space: a flag of 6 … 12 bits, because the
/// flags of others follow the first by up to six bits, here their mean of 9; then 8 delimiter bits
/// and the intermission.
const ERROR_FRAME: u32 = 9 + 8 + INTERFRAME_SPACE;

/// An error frame of which nobody else takes notice: flag, delimiter, intermission.
const LONELY_ERROR_FRAME: u32 = 6 + 8 + INTERFRAME_SPACE;

/// How long `frame` occupies the wire, in bits, with its real stuff bits and the three bits of
/// interframe space: 47 … 135 with an 11-bit identifier, 67 … 160 with a 29-bit one.
#[must_use]
pub fn frame_bits(frame: &Frame) -> u32 {
    Sequence::of(frame).frame_bits()
}

/// The order of arbitration: the lower key keeps the wire.
///
/// The bits of the arbitration field as they follow each other on the wire, so a data frame beats
/// a remote frame and a standard frame an extended one with the same first 11 bits.
pub(super) fn arbitration_key(frame: &Frame) -> u32 {
    let remote = u32::from(frame.is_remote());
    match frame.identifier() {
        Identifier::Standard(bits) => u32::from(bits) << 21 | remote << 20,
        Identifier::Extended(bits) => {
            (bits >> 18) << 21 | 0b11 << 19 | (bits & 0x3_FFFF) << 1 | remote
        }
    }
}

/// The part of a frame that is subject to stuffing: start of frame to the end of the CRC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sequence {
    /// The bits in the order of the wire from the most significant bit down, before stuffing.
    bits: u128,
    /// How many of them there are, 34 … 118.
    length: u32,
}

impl Sequence {
    pub(super) fn of(frame: &Frame) -> Self {
        let remote = u64::from(frame.is_remote());
        let code = frame.length() as u64;
        let (header, header_length) = match frame.identifier() {
            Identifier::Standard(bits) => (u64::from(bits) << 7 | remote << 6 | code, 19),
            Identifier::Extended(bits) => {
                let (base, extension) = (u64::from(bits >> 18), u64::from(bits & 0x3_FFFF));
                (base << 27 | 0b11 << 25 | extension << 7 | remote << 6 | code, 39)
            }
        };
        // The register starts at zero, so zeros before the start of frame leave it alone and the
        // header can be taken in whole octets.
        let [.., a, b, c, d, e] = header.to_be_bytes();
        let mut crc = crc15(0, &[a, b, c, d, e]);
        let mut bits = u128::from(header);
        let mut length = header_length;
        for &octet in frame.data() {
            crc = crc15_octet(crc, octet);
            bits = bits << 8 | u128::from(octet);
            length += 8;
        }
        length += 15;
        Self { bits: (bits << 15 | u128::from(crc)) << (128 - length), length }
    }

    /// The whole frame with interframe space.
    pub(super) fn frame_bits(self) -> u32 {
        self.stuffed() + TAIL + INTERFRAME_SPACE
    }

    /// A try that nobody acknowledges, with error frame and interframe space.
    pub(super) fn unacknowledged_bits(self) -> u32 {
        self.stuffed() + UNTIL_ACKNOWLEDGE + LONELY_ERROR_FRAME
    }

    /// A frame destroyed in bit `broken`, with error frame and interframe space.
    pub(super) const fn destroyed_bits(broken: u32) -> u32 {
        broken + ERROR_FRAME
    }

    /// The bits from start of frame to the end of the CRC, stuff bits included.
    pub(super) fn stuffed(self) -> u32 {
        self.length + stuff_bits(self.bits, self.length)
    }

    /// How many bits two frames with one arbitration field have been on the wire when the first
    /// difference shows; `None` where they are the same frame.
    pub(super) fn differs_after(self, other: Self) -> Option<u32> {
        let same = (self.bits ^ other.bits).leading_zeros();
        (same < self.length).then(|| same + 1 + stuff_bits(self.bits, same))
    }
}

/// The stuff bits in the first `length` bits of `bits`, counted from the most significant one.
///
/// One turn of the loop per stuff bit rather than per bit: this runs for every frame.
fn stuff_bits(mut bits: u128, mut length: u32) -> u32 {
    let mut count = 0;
    loop {
        let like_next = !(bits ^ (bits << 1));
        let five_alike = like_next & (like_next << 1) & (like_next << 2) & (like_next << 3);
        let at = five_alike.leading_zeros();
        if at + 5 > length {
            return count;
        }
        count += 1;
        // The stuff bit opens the next run. It is the opposite of the fifth bit, whose place it
        // takes here, because that one has been counted.
        bits = (bits << (at + 4)) ^ (1 << 127);
        length -= at + 4;
    }
}

fn crc15(crc: u16, octets: &[u8]) -> u16 {
    octets.iter().fold(crc, |crc, &octet| crc15_octet(crc, octet))
}

fn crc15_octet(crc: u16, octet: u8) -> u16 {
    let index = (crc >> 7) as u8 ^ octet;
    (crc << 8 ^ CRC15[usize::from(index)]) & 0x7FFF
}

/// CRC-15 of CAN, polynomial 4599h, one entry per octet.
static CRC15: [u16; 256] = {
    let mut table = [0; 256];
    let mut index = 0;
    while index < 256 {
        let mut crc = (index as u16) << 7;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x4000 == 0 { crc << 1 } else { crc << 1 ^ 0x4599 };
            bit += 1;
        }
        table[index] = crc & 0x7FFF;
        index += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crc_is_the_catalogued_one() {
        assert_eq!(crc15(0, b"123456789"), 0x059E);
    }

    #[test]
    fn stuff_bits_count_towards_the_next_run() {
        let all_zero = |length| stuff_bits(0, length);
        assert_eq!(all_zero(4), 0);
        assert_eq!(all_zero(5), 1);
        assert_eq!(all_zero(9), 1, "four zeros behind the stuff bit and no run of five");
        assert_eq!(all_zero(10), 2);
        let alternating_fours = 0b0000_0111_1000_0111_1000_0111_1000_0111_u128 << 96;
        assert_eq!(stuff_bits(alternating_fours, 29), 7, "each stuff bit begins the next five");
    }

    #[test]
    fn arbitration_prefers_data_to_remote_and_standard_to_extended() {
        let key = |frame: Result<Frame, _>| arbitration_key(&frame.unwrap());
        let standard = key(Frame::new(Identifier::Standard(0x123), &[]));
        let remote = key(Frame::remote(Identifier::Standard(0x123), 0));
        let extended = key(Frame::new(Identifier::Extended(0x123 << 18), &[]));
        let extended_remote = key(Frame::remote(Identifier::Extended(0x123 << 18), 0));
        let next = key(Frame::new(Identifier::Standard(0x124), &[]));
        let order = [standard, remote, extended, extended_remote, next];
        assert!(order.is_sorted_by(|a, b| a < b), "{order:X?}");
    }

    #[test]
    fn two_frames_with_one_identifier_part_in_the_first_different_bit() {
        let frame = |data: &[u8]| Sequence::of(&Frame::standard(0x555, data));
        assert_eq!(frame(&[1]).differs_after(frame(&[1])), None);
        // 19 bits of header with one stuff bit after 1000001 000 0.
        assert_eq!(frame(&[0x80]).differs_after(frame(&[0x00])), Some(19 + 1 + stuffed_header()));
    }

    fn stuffed_header() -> u32 {
        let header = 0x555_u128 << 7 | 1;
        stuff_bits(header << 109, 19)
    }
}
