//! Every PROFIBUS product under a master that was not written by us: profirust, on a wire in bit
//! time that names whoever breaks a rule.

mod bring_up;
mod cycle;
mod fighting;
mod segment;
