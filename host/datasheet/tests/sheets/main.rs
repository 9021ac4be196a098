//! The files as people get them, read by others, and held against devices that run.

mod devicenet_bench;
mod eds_and_running_devices;
mod eds_reader;
mod every_file;
mod gsd_and_running_devices;
mod gsd_and_the_vendor;
mod gsd_reader;
mod segment;
