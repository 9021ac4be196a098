//! What a slave costs in memory.

use codewheel_profibus::Slave;

#[test]
fn a_slave_of_four_octets_takes_at_most_a_kibioctet() {
    let size = size_of::<Slave<4>>();
    assert!(size <= 1_024, "{size} octets");
}
