//! Captures as people meet them: written, read back, damaged, told.

mod anything_at_all;
mod bench;
mod damages;
mod devicenet;
mod dissector;
mod other_tools;
mod profibus;
mod recording;
mod refusals;
mod round_trips;
mod whole_sessions;

#[path = "../sessions/mod.rs"]
mod sessions;
