use codewheel_sim::can::frame_bits;
use codewheel_station::can::{Frame, Identifier};
use proptest::prelude::*;

/// The frame bit by bit, in the words of the CAN specification 2.0, to be held against the fast
/// count.
fn slow_frame_bits(frame: &Frame) -> u32 {
    let mut bits = vec![false];
    let mut push = |value: u32, width: u32| {
        bits.extend((0..width).rev().map(|bit| value >> bit & 1 == 1));
    };
    let remote = u32::from(frame.is_remote());
    match frame.identifier() {
        Identifier::Standard(identifier) => {
            push(identifier.into(), 11);
            push(remote, 1);
            push(0, 1); // IDE
            push(0, 1); // r0
        }
        Identifier::Extended(identifier) => {
            push(identifier >> 18, 11);
            push(1, 1); // SRR
            push(1, 1); // IDE
            push(identifier & 0x3FFFF, 18);
            push(remote, 1);
            push(0, 2); // r1, r0
        }
    }
    push(frame.length() as u32, 4);
    frame.data().iter().for_each(|&octet| push(octet.into(), 8));

    let mut crc = 0_u16;
    for &bit in &bits {
        let next = bit ^ (crc >> 14 & 1 == 1);
        crc = crc << 1 & 0x7FFF;
        if next {
            crc ^= 0x4599;
        }
    }
    bits.extend((0..15).rev().map(|bit| crc >> bit & 1 == 1));

    let mut count = 0;
    let mut run = 0;
    let mut last = None;
    for bit in bits {
        run = if last == Some(bit) { run + 1 } else { 1 };
        last = Some(bit);
        count += 1;
        if run == 5 {
            count += 1;
            last = Some(!bit);
            run = 1;
        }
    }
    // CRC delimiter, ACK, ACK delimiter, EOF, interframe space.
    count + 1 + 1 + 1 + 7 + 3
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let identifier = prop_oneof![
        (0..0x800_u16).prop_map(Identifier::Standard),
        (0..1_u32 << 29).prop_map(Identifier::Extended),
    ];
    // Long runs are rare in random octets and are what stuffing is about.
    let octet = prop_oneof![Just(0x00), Just(0xFF), Just(0xF0), Just(0x1F), any::<u8>()];
    let data = proptest::collection::vec(octet, 0..=8);
    (identifier, data, any::<bool>()).prop_map(|(identifier, data, remote)| match remote {
        true => Frame::remote(identifier, data.len()).unwrap(),
        false => Frame::new(identifier, &data).unwrap(),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    #[test]
    fn the_fast_count_is_the_slow_count(frame in any_frame()) {
        prop_assert_eq!(frame_bits(&frame), slow_frame_bits(&frame));
    }
}

#[test]
fn no_frame_is_longer_than_the_worst_case_or_shorter_than_without_stuff_bits() {
    let mut random = fastrand::Rng::with_seed(5);
    for (octets, least, most) in [(0, 47, 55), (4, 79, 95), (5, 87, 105), (8, 111, 135)] {
        for _ in 0..20_000 {
            let data: Vec<u8> = (0..octets).map(|_| random.u8(..)).collect();
            let bits = frame_bits(&Frame::standard(random.u16(..), &data));
            assert!((least..=most).contains(&bits), "{octets} octets: {bits} bits");
        }
    }
}

#[test]
fn the_bounds_hold_for_every_identifier_without_data() {
    let bits = (0..0x800).map(|identifier| frame_bits(&Frame::standard(identifier, &[])));
    let (least, most) =
        bits.fold((u32::MAX, 0), |(low, high), bits| (low.min(bits), high.max(bits)));
    assert!(least >= 47 && most <= 55, "{least} … {most}");
}
