//! Frames, time, memory, shaft and power into an encoder.
#![no_main]
#[path = "../../core/device/tests/anything/any_record.rs"]
mod any_record;
#[path = "../../core/device/tests/anything/device.rs"]
mod device;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| device::body(octets));
