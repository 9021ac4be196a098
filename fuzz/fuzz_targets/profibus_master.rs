//! Octets, broken characters, time and requests into a PROFIBUS master.
#![no_main]
#[path = "../../host/commission/tests/anything/profibus_master.rs"]
mod profibus_master;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| profibus_master::body(octets));
