//! Flipped bits: how many of them make another telegram of one.
//!
//! The model: characters stand in fixed cells of eleven bits, start (0), eight of data, even parity,
//! stop (1). A start or stop bit that flips, or an odd number of flips among data and parity, makes
//! a broken character, and the telegram is dropped. So only patterns with an even number of flips
//! in the nine bits of each character they touch are left for checksum, lengths and delimiters to
//! find; all others are counted, not walked. Bits that slip are `bit_slips`' business.

use crate::telegrams::{ACKNOWLEDGE, DIAGNOSIS, EXCHANGE, SHORT, TOKEN, all, is_mistaken};

/// The data of a character with an error of `flips` bits that its parity does not show: the data
/// masks of all such errors.
fn unseen(flips: u32) -> Vec<u8> {
    (0..1_u16 << 9).filter(|mask| mask.count_ones() == flips).map(|mask| mask as u8).collect()
}

/// How many of the patterns of `flips` bits pass all characters, and how many of those make
/// another telegram.
fn count(octets: &[u8], flips: u32) -> (u64, u64) {
    let (mut passed, mut mistaken) = (0, 0);
    let mut damaged = octets.to_vec();
    walk(octets, &mut damaged, 0, flips, &mut |damaged| {
        passed += 1;
        mistaken += u64::from(is_mistaken(damaged, octets));
    });
    (passed, mistaken)
}

fn walk(octets: &[u8], damaged: &mut [u8], from: usize, flips: u32, found: &mut impl FnMut(&[u8])) {
    if flips == 0 {
        found(damaged);
        return;
    }
    for place in from..octets.len() {
        for here in (2..=flips).step_by(2) {
            for mask in unseen(here) {
                damaged[place] = octets[place] ^ mask;
                walk(octets, damaged, place + 1, flips - here, found);
            }
        }
        damaged[place] = octets[place];
    }
}

/// The number of ways to choose `flips` of `bits`.
fn patterns(bits: usize, flips: u32) -> u64 {
    (0..u64::from(flips)).fold(1, |ways, flip| ways * (bits as u64 - flip) / (flip + 1))
}

/// Odd numbers of flips always break a character, so three bits are found wherever two are.
#[test]
fn up_to_three_flipped_bits_are_never_taken_for_another_telegram_but_in_a_token() {
    println!("| telegram | flipped bits | patterns | characters valid | taken for another |");
    println!("|---|---|---|---|---|");
    for sample in all() {
        let most = match sample.name {
            SHORT | EXCHANGE => 4,
            ACKNOWLEDGE | TOKEN | DIAGNOSIS => 3,
            _ => 2,
        };
        for flips in 1..=most {
            let (passed, mistaken) = count(&sample.octets, flips);
            let all = patterns(sample.octets.len() * 11, flips);
            println!("| {} | {flips} | {all} | {passed} | {mistaken} |", sample.name);
            match (sample.name, flips) {
                // DA and SA of a token have no checksum: 36 pairs of flips each.
                (TOKEN, 2) => assert_eq!(mistaken, 72),
                (SHORT | EXCHANGE, 4) => assert!(mistaken * 1_000 < all, "{}", sample.name),
                _ => assert_eq!(mistaken, 0, "{} with {flips} flips", sample.name),
            }
        }
    }
}

#[test]
fn what_is_counted_is_what_a_walk_over_single_bits_finds() {
    // SD1 once more, bit by bit, with a receiver that checks every character.
    let octets = [0x10, 0x07, 0x02, 0x49, 0x52, 0x16];
    let bits: Vec<bool> = octets.iter().flat_map(|octet| character(*octet)).collect();
    let (mut passed, mut mistaken) = (0, 0);
    for first in 0..bits.len() {
        for second in 0..first {
            let mut damaged = bits.clone();
            damaged[first] ^= true;
            damaged[second] ^= true;
            let characters: Option<Vec<u8>> = damaged.chunks(11).map(octet).collect();
            if let Some(damaged) = characters {
                passed += 1;
                mistaken += u64::from(is_mistaken(&damaged, &octets));
            }
        }
    }
    assert_eq!((passed, mistaken), count(&octets, 2));
}

/// The eleven bits of a character.
pub(crate) fn character(octet: u8) -> [bool; 11] {
    std::array::from_fn(|bit| match bit {
        0 => false,
        9 => octet.count_ones() % 2 == 1,
        10 => true,
        _ => octet >> (bit - 1) & 1 == 1,
    })
}

/// The octet of a character; `None` where it is broken.
pub(crate) fn octet(bits: &[bool]) -> Option<u8> {
    let octet = (1..=8).fold(0, |octet, bit| octet | u8::from(bits[bit]) << (bit - 1));
    (bits == character(octet)).then_some(octet)
}
