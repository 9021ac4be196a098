//! The bus cycle over the number of encoders, at every rate, in virtual time: what a plant can
//! expect, not how fast this machine is.
//!
//! ```text
//! cargo bench -p codewheel-commission --bench cycle
//! ```
//!
//! Each encoder has two words each way (F1h) and answers after 11 bits; profirust is the master. The
//! cycle is from the end of one round to the end of the next, with the token, one address of the GAP
//! and, now and then, Global_Control. Beside it stand the bits that it takes at least.

// What the tests of the crate need beyond it is not used here.
#![allow(dead_code, missing_docs)]

#[path = "../tests/products/segment.rs"]
mod segment;

use codewheel_commission::profibus::{MasterSettings, shortest_slot};
use codewheel_device::Product;
use codewheel_profibus::Baud;
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use segment::{MASTER, Segment, Wanted, encoder, some_cycles};

const COUNTS: [u8; 7] = [1, 2, 4, 8, 16, 24, 32];

fn main() {
    println!("mean bus cycle in ms, and in brackets how it stands to its bits\n");
    print!("| encoders |");
    COUNTS.iter().for_each(|count| print!(" {count:>13} |"));
    println!();
    print!("|---:|");
    COUNTS.iter().for_each(|_| print!("---:|"));
    println!();
    for rate in BaudRate::ALL {
        print!("| {rate:>8} |");
        for count in COUNTS {
            let cycle = cycle(rate, count).as_nanos() as f64;
            let bits = formula(rate, count).as_nanos() as f64;
            print!(" {:>7.3} ({:.2}) |", cycle / 1e6, cycle / bits);
        }
        println!();
    }
}

/// n·(33 + 143 + 11 + 143), the token of 33, a GAP request of 33 + 66 and its slot time, in bits.
fn formula(rate: BaudRate, count: u8) -> Duration {
    let gap = 33 + 66 + u32::from(shortest_slot(rate));
    rate.bits(u32::from(count) * (33 + 143 + 11 + 143) + 33 + gap)
}

fn cycle(rate: BaudRate, count: u8) -> Duration {
    let mut segment = Segment::new();
    let product = Product::find("amg11-p29").expect("in the catalogue");
    let addresses = 10..10 + count;
    let now = segment.wire.now();
    let mut all = Vec::new();
    for address in addresses {
        let shaft = "turn rpm=600";
        segment.attach_encoder(address, encoder(now, product, address, shaft, Baud::Fixed(rate)));
        all.push(Wanted {
            address,
            class_2: true,
            configuration: 0xF1,
            steps_per_turn: 8_192,
            total_resolution: 1 << 29,
        });
    }
    let mut settings = MasterSettings::new(MASTER, rate);
    settings.highest_station_address = MASTER + 2;
    settings.token_rotation_bits = Some(100_000);
    settings.watchdog = None;
    segment.attach_master(settings, &all);
    let limit = Duration::from_secs(300);
    assert!(segment.run_till(limit, some_cycles(rate), |segment| segment.all_exchange(2)));
    let before = segment.master().cycle_times();
    segment.run(formula(rate, count).times(30));
    segment.expect_peace();
    let after = segment.master().cycle_times();
    let total = after.total.as_nanos() - before.total.as_nanos();
    Duration::from_nanos(total / (after.count - before.count))
}
