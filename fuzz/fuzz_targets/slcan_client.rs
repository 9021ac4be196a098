//! An adapter's octets into its SLCAN client.
#![no_main]
#[path = "../../host/link/tests/anything/slcan_client.rs"]
mod slcan_client;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| slcan_client::body(octets));
