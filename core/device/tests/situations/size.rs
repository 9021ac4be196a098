//! What a device costs in memory.

use codewheel_device::DeviceNetEncoder;

#[test]
fn a_devicenet_encoder_takes_at_most_a_kibioctet() {
    let size = size_of::<DeviceNetEncoder<&mut dyn codewheel_encoder::Sensor>>();
    assert!(size <= 1_024, "{size} octets");
}
