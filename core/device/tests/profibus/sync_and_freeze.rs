//! Sync and Freeze, as far as the encoder feels them (profibus clause 3).

use crate::bench::{Bench, FULL_RANGE};

const UNFREEZE: u8 = 0x04;
const FREEZE: u8 = 0x08;
const UNSYNC: u8 = 0x10;
const SYNC: u8 = 0x20;

#[test]
fn frozen_inputs_stay_also_through_a_preset() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.turn_to(1_000);
    bench.position("00000000");
    bench.controls(FREEZE);
    bench.turn_to(2_000);
    assert_eq!(bench.position("00000000"), 1_000);
    assert_eq!(bench.position("80000005"), 1_000, "the preset is executed all the same");
    assert!(bench.state().freeze);
    assert_eq!(bench.diagnosis()[1] & 0x10, 0x10);
    bench.controls(UNFREEZE);
    assert_eq!(bench.position("00000000"), 5);
}

#[test]
fn held_presets_strike_with_the_sync() {
    let mut bench = Bench::power_up("amg11-p29").running(FULL_RANGE);
    bench.turn_to(1_000);
    bench.position("00000000");
    bench.controls(SYNC);
    assert_eq!(bench.position("80000005"), 1_000);
    bench.turn_to(1_001);
    bench.controls(SYNC);
    assert_eq!(bench.position("80000005"), 5, "the shaft was at 1001 when it struck");
    // From 1 to 0 and back between two Syncs is no rise.
    bench.position("00000009");
    bench.position("80000009");
    bench.controls(SYNC);
    assert_eq!(bench.position("00000009"), 5);
    bench.controls(UNSYNC);
    assert_eq!(bench.position("80000009"), 9);
}
