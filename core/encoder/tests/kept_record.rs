//! The record: what is kept comes back, and nothing else is taken for it.

mod common;

use codewheel_encoder::{
    Block, Damage, Direction, Kept, RECORD_OCTETS, Reference, Settings, Slot, Start, choose,
    decode, encode,
};
use common::{cases, kept};
use proptest::prelude::*;

fn example() -> Kept {
    let settings = Settings {
        direction: Direction::Ccw,
        steps_per_turn: 3_600,
        total_resolution: 921_600,
        scaling: true,
    };
    Kept {
        fingerprint: 0x0A5E,
        saved: Block { settings, preset: 1_000, offset: -2, crossings_at_change: -3, cos_delta: 4 },
        reference: Some(Reference { crossings: 5, code: 6 }),
        serial: 0x0102_0304,
        writes: 7,
        bus: *b"the bus knows what it is",
    }
}

/// The layout of the module documentation, written out.
const EXAMPLE: &str = "43574B52 0100 5C00 0D000000 5E0A 01 03 100E0000 00100E00 E8030000 FEFFFFFF \
                       FDFFFFFFFFFFFFFF 04000000 0500000000000000 06000000 04030201 07000000 \
                       74686520627573206B6E6F777320776861742069742069730D0A";

#[test]
fn a_record_lies_in_memory_as_its_table_says() {
    let octets = encode(&example(), 13);
    let hex: String = octets.iter().map(|octet| format!("{octet:02X}")).collect();
    let expected: String = EXAMPLE.split_whitespace().collect();
    // Without the CRC, which the next test judges.
    assert_eq!(hex[..176], expected[..176]);
    assert_eq!(decode(&octets), Ok((example(), 13)));
}

/// CRC-32 of IEEE 802.3, bit by bit.
fn crc_32(octets: &[u8]) -> u32 {
    !octets.iter().fold(u32::MAX, |crc, octet| {
        (0..8).fold(crc ^ u32::from(*octet), |crc, _| {
            if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 }
        })
    })
}

#[test]
fn the_checksum_is_the_crc_32_everyone_knows() {
    assert_eq!(crc_32(b"123456789"), 0xCBF4_3926);
    let octets = encode(&example(), 13);
    assert_eq!(octets[88..], crc_32(&octets[..88]).to_le_bytes());
}

/// `octets` with a checksum that matches them.
fn sealed(mut octets: Vec<u8>) -> Vec<u8> {
    let end = octets.len() - 4;
    let checksum = crc_32(&octets[..end]).to_le_bytes();
    octets[end..].copy_from_slice(&checksum);
    octets
}

#[test]
fn a_whole_record_of_a_newer_version_is_told_apart_from_damage() {
    for length in [16, RECORD_OCTETS, 200] {
        let mut newer = encode(&example(), 13).to_vec();
        newer.resize(length, 0x55);
        newer[4] = 2;
        newer[6] = length as u8;
        assert_eq!(decode(&newer), Err(Damage::Checksum));
        let newer = sealed(newer);
        assert_eq!(decode(&newer), Err(Damage::Version(2)));
        assert_eq!(choose(&newer, &[]), Start::Damaged, "never a fresh start in silence");
    }
}

#[test]
fn fields_no_program_writes_are_refused() {
    for (octet, value) in [(14, 2), (15, 4), (15, 0x80)] {
        let mut octets = encode(&example(), 13).to_vec();
        octets[octet] = value;
        assert_eq!(decode(&sealed(octets)), Err(Damage::Content));
    }
    let mut longer = encode(&example(), 13).to_vec();
    longer.push(0);
    longer[6] += 1;
    assert_eq!(decode(&sealed(longer)), Err(Damage::Content));
}

#[test]
fn damage_is_named() {
    let octets = encode(&example(), 13);
    assert_eq!(decode(b"CWKX then whatever"), Err(Damage::Magic));
    assert_eq!(decode(&octets[..91]), Err(Damage::Short));
    let mut short = octets;
    short[6] = 3;
    assert_eq!(decode(&short), Err(Damage::Short));
    assert_eq!(Damage::Version(2).to_string(), "the record has version 2, this program knows 1");
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn what_is_kept_comes_back(kept in kept(), sequence: u32, rest: Vec<u8>) {
        let mut slot = encode(&kept, sequence).to_vec();
        slot.extend(rest);
        prop_assert_eq!(decode(&slot), Ok((kept, sequence)));
    }

    #[test]
    fn every_flipped_bit_is_noticed(kept in kept(), sequence: u32) {
        let octets = encode(&kept, sequence);
        for bit in 0..8 * RECORD_OCTETS {
            let mut flipped = octets;
            flipped[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(decode(&flipped).is_err(), "bit {}", bit);
        }
    }

    #[test]
    fn every_shortened_record_is_refused(kept in kept(), sequence: u32) {
        let octets = encode(&kept, sequence);
        for length in 0..RECORD_OCTETS {
            prop_assert_eq!(decode(&octets[..length]), Err(Damage::Short));
        }
    }

    #[test]
    fn random_octets_are_no_record(
        octets in prop::collection::vec(any::<u8>(), 0..300),
        head in 0..12_usize,
        kept in kept(),
    ) {
        prop_assert!(decode(&octets).is_err());
        // Garbage that begins like a record gets further, and no further than the checksum.
        let mut garbage = octets;
        for (to, from) in garbage.iter_mut().zip(&encode(&kept, 1)[..head]) {
            *to = *from;
        }
        prop_assert!(decode(&garbage).is_err());
        let _ = choose(&garbage, &garbage);
    }

    #[test]
    fn the_newer_of_two_records_is_taken_also_where_the_sequence_wraps(
        old in kept(),
        new in kept(),
        sequence in prop_oneof![any::<u32>(), Just(u32::MAX), Just(0), Just(0x7FFF_FFFF)],
        ahead in prop_oneof![Just(1), 1..0x7FFF_FFFFu32],
    ) {
        let newer = sequence.wrapping_add(ahead);
        let (a, b) = (encode(&old, sequence), encode(&new, newer));
        for (start, slot) in [(choose(&a, &b), Slot::B), (choose(&b, &a), Slot::A)] {
            let expected =
                Start::Kept { kept: new, sequence: newer, slot, other_damaged: false };
            prop_assert_eq!(start, expected);
            prop_assert_eq!(start.next(), (slot.other(), newer.wrapping_add(1)));
        }
    }
}

#[test]
fn a_start_names_what_it_found() {
    let record = encode(&example(), 13);
    let torn = &record[..40];
    let erased = [0xFF; 128];
    let cleared = [0; 128];
    for blank in [&[][..], &erased, &cleared] {
        assert_eq!(choose(blank, blank), Start::Fresh { interrupted: false });
        assert_eq!(choose(torn, blank), Start::Fresh { interrupted: true });
        assert_eq!(choose(blank, torn), Start::Fresh { interrupted: true });
        for (start, slot) in [(choose(&record, blank), Slot::A), (choose(blank, &record), Slot::B)]
        {
            let expected =
                Start::Kept { kept: example(), sequence: 13, slot, other_damaged: false };
            assert_eq!(start, expected);
        }
    }
    assert_eq!(choose(torn, torn), Start::Damaged);
    let twin = encode(&Kept { writes: 8, ..example() }, 13);
    let expected =
        Start::Kept { kept: example(), sequence: 13, slot: Slot::A, other_damaged: false };
    assert_eq!(choose(&record, &twin), expected, "of two equally new records the first");
    let expected =
        Start::Kept { kept: example(), sequence: 13, slot: Slot::A, other_damaged: true };
    assert_eq!(choose(&record, torn), expected);
    assert_eq!(Start::Damaged.next(), (Slot::A, 1));
    assert_eq!(Start::Fresh { interrupted: true }.next(), (Slot::A, 1));
}
