//! Frames, the controller's reports, requests and time into the scanner.
#![no_main]
#[path = "../../core/devicenet/tests/anything/scanner.rs"]
mod scanner;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| scanner::body(octets));
