//! What a device costs in memory.

use codewheel_device::ProfibusEncoder;
use codewheel_encoder::Sensor;

#[test]
fn a_profibus_encoder_takes_at_most_1700_octets_with_its_telegrams() {
    let size = size_of::<ProfibusEncoder<&mut dyn Sensor>>();
    let slave = size_of::<codewheel_profibus::Slave<4>>();
    println!("{size} octets, {slave} of them the slave with its telegrams");
    assert!(size <= 1_700, "{size} octets");
    assert!(size - slave <= 768, "{} octets without the slave", size - slave);
}
