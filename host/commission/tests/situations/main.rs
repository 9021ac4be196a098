//! The PROFIBUS master as its slaves, other masters and a bad line meet it.

mod anything_at_all;
mod bench;
mod bring_up;
mod cycle;
mod diagnosis;
mod plain;
mod rates;
mod refusals;
mod retries;
mod scripted;
mod settings;
mod timing;
mod two_masters;
mod vanishing;
