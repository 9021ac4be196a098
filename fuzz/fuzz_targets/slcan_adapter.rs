//! A client's octets into the channel of an SLCAN adapter.
#![no_main]
#[path = "../../host/link/tests/anything/slcan_adapter.rs"]
mod slcan_adapter;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| slcan_adapter::body(octets));
