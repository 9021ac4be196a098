//! The DeviceNet encoder as its masters, its memory and its shaft meet it.

mod alarms_and_lamp;
mod bench;
mod identity;
mod memory;
mod on_the_wire;
mod rows_answer;
mod settings;
mod size;
