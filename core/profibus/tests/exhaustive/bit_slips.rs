//! Bits that are lost or doubled: everything behind them is framed anew.
//!
//! The model: a bit of the stream is left out, or one is put in, anywhere, and a UART reads what is
//! left: it waits for a start bit, takes eleven bits, and begins to wait again. A broken character
//! ends the telegram. Idle bits before a start bit are no error here, as on a port of a PC, which is
//! the harder case. The line is idle behind the telegram.

use crate::bit_flips::{character, octet};
use crate::telegrams::{TOKEN, all, is_mistaken};

/// The octets a UART reads up to the first broken character.
fn read(bits: &[bool]) -> Vec<u8> {
    let mut octets = Vec::new();
    let mut at = 0;
    while let Some(idle) = bits[at..].iter().position(|bit| !bit) {
        at += idle;
        let Some(next) = bits.get(at..at + 11).and_then(octet) else { break };
        octets.push(next);
        at += 11;
    }
    octets
}

#[test]
fn a_lost_or_doubled_bit_is_never_taken_for_another_telegram_but_in_a_token() {
    println!("| telegram | slips | taken for another | taken as it was |");
    println!("|---|---|---|---|");
    for sample in all() {
        let mut bits: Vec<bool> =
            sample.octets.iter().flat_map(|octet| character(*octet)).collect();
        let length = bits.len();
        bits.extend([true; 33]);
        let lost = (0..length).map(|place| {
            let mut damaged = bits.clone();
            damaged.remove(place);
            damaged
        });
        let doubled = (0..=length).flat_map(|place| {
            let bits = &bits;
            [false, true].map(move |bit| {
                let mut damaged = bits.clone();
                damaged.insert(place, bit);
                damaged
            })
        });
        let (mut slips, mut mistaken, mut unharmed) = (0, 0, 0);
        for damaged in lost.chain(doubled) {
            let octets = read(&damaged);
            slips += 1;
            mistaken += u64::from(is_mistaken(&octets, &sample.octets));
            unharmed += u64::from(octets.starts_with(&sample.octets));
        }
        println!("| {} | {slips} | {mistaken} | {unharmed} |", sample.name);
        if sample.name != TOKEN {
            assert_eq!(mistaken, 0, "{}", sample.name);
        }
    }
}
