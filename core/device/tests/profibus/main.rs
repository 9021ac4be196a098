//! The PROFIBUS encoder as its masters, its memory and its shaft meet it.

mod alarms;
mod anything_at_all;
mod bench;
mod bring_up;
mod converter;
mod diagnosis;
mod lamp;
mod memory;
mod moment;
mod power_cuts;
mod presets;
mod refused;
mod rows;
mod size;
mod switches;
mod sync_and_freeze;
mod turns;
