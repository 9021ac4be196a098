//! The DeviceNet encoder as its masters, its memory and its shaft meet it.

mod alarms_and_lamp;
mod anything_at_all;
mod bench;
mod change_of_state;
mod identity;
mod local;
mod memory;
mod on_the_wire;
mod parameter_object;
mod request_space;
mod resets;
mod rows_answer;
mod settings;
mod size;
mod slow_memory;
