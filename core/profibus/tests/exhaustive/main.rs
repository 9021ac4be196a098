//! Whole spaces, walked to their ends: every flip of a bit, every request, every length.
//!
//! ```text
//! cargo test -p codewheel-profibus --test exhaustive
//! CODEWHEEL_EXHAUSTIVE=1 cargo test --release -p codewheel-profibus --test exhaustive -- --nocapture
//! ```
//!
//! The first walks a part in a few seconds, the second all of it, and prints the tables.

mod bit_flips;
mod bit_slips;
mod lengths;
mod request_space;
mod still;
mod telegrams;

/// Whether the whole space is wanted.
fn whole() -> bool {
    std::env::var_os("CODEWHEEL_EXHAUSTIVE").is_some_and(|value| value != "0")
}
