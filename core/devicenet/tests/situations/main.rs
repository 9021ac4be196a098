//! The server and the scanner as a peer meets them: conversations in candump's notation.

mod allocation;
mod anything_at_all;
mod bench;
mod connections;
mod explicit_messages;
mod fragmented_messages;
mod getting_on_line;
mod objects;
mod polling;
mod scanner_meets_servers;
mod slow_services;
