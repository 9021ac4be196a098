//! Octets, broken characters, time, memory, shaft and power into a PROFIBUS encoder.
#![no_main]
#[path = "../../core/device/tests/anything/any_record.rs"]
mod any_record;
#[path = "../../core/device/tests/anything/profibus_slave.rs"]
mod profibus_slave;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| profibus_slave::body(octets));
