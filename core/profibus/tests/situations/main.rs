//! The slave as masters meet it: conversations in hexadecimal telegrams.

mod anything_at_all;
mod baud_search;
mod bench;
mod bring_up;
mod configuration;
mod data_exchange;
mod diagnosis;
mod garbage;
mod global_control;
mod lost_answers;
mod own_echo;
mod parameters;
mod pending_diagnosis;
mod refusals;
mod several_at_once;
mod size;
mod station_delay;
mod two_masters;
mod watchdog;
