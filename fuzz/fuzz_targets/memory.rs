//! Records, cuts and flipped bits into the two slots of a memory.
#![no_main]
#[path = "../../core/device/tests/anything/any_record.rs"]
mod any_record;
#[path = "../../core/device/tests/anything/memory.rs"]
mod memory;
libfuzzer_sys::fuzz_target!(|octets: &[u8]| memory::body(octets));
