//! `socketcan:INTERFACE`: a CAN interface of this machine's Linux.
//!
//! Nothing here needs more rights than any user has: an interface is looked at, not set up.

mod frame;
mod netlink;
mod port;

pub(crate) use port::open;
