//! Power that fails while a preset is being written (encoder clause 4).

use codewheel_device::MemoryState;
use codewheel_encoder::{RECORD_OCTETS, encode};

use crate::bench::{Bench, EXAMPLE, start};

/// Position 100 at code 8192 in memory; then 200, and the power fails after `cut` octets of it.
fn cut(first: bool, cut: usize) -> Bench {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.turn_to(8_192);
    if !first {
        bench.position("00000000");
        bench.position("80000064");
    }
    bench.serves_memory = false;
    bench.position("00000000");
    assert_eq!(bench.position("800000C8"), 200);
    let kept = bench.device.keep(bench.now).expect("a record");
    let (slot, sequence) = start(&bench.memory).next();
    bench.memory.write(slot, &encode(&kept, sequence), Some(cut));
    let mut bench = bench.power_cycled(8_192);
    bench.brings_up(EXAMPLE, 0xF1);
    bench
}

#[test]
fn a_cut_at_any_octet_leaves_the_old_preset_or_the_new_one() {
    for octets in 0..=RECORD_OCTETS {
        let mut bench = cut(false, octets);
        let expected = if octets == RECORD_OCTETS { 200 } else { 100 };
        assert_eq!(bench.position("00000000"), expected, "cut after {octets} octets");
        assert_eq!(bench.snapshot().memory, MemoryState::Good, "cut after {octets} octets");
        // And what comes next is kept.
        bench.position("00000000");
        assert_eq!(bench.position("80000007"), 7);
        let mut bench = bench.power_cycled(8_192).running(EXAMPLE);
        assert_eq!(bench.position("00000000"), 7, "cut after {octets} octets");
    }
}

#[test]
fn a_cut_in_the_very_first_preset_leaves_no_preset_and_no_damage() {
    for octets in 0..RECORD_OCTETS {
        let mut bench = cut(true, octets);
        assert_eq!(bench.position("00000000"), 3_600, "cut after {octets} octets");
        assert_eq!(bench.snapshot().memory, MemoryState::Fresh, "cut after {octets} octets");
    }
}
