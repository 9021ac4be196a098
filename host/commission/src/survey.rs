//! Who is on a bus: what was overheard, and what a scan has found.

use codewheel_device::product::Bus;

use crate::Identity;

/// What a node is to its bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// It asks others.
    Master,
    /// It answers.
    Slave,
    /// It was heard, or is there, and nothing says which.
    Unknown,
}

/// To whom a slave belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Owner {
    /// To nobody.
    Nobody,
    /// To a master whose address was not heard.
    Somebody,
    /// To the master at this address.
    Master(u8),
}

/// A node on a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Its address.
    pub address: u8,
    /// What it is.
    pub role: Role,
    /// Who it says it is; `None` where it was not asked, or did not say.
    pub identity: Option<Identity>,
    /// To whom it belongs; `None` where that is unknown, or it is no slave.
    pub owner: Option<Owner>,
    /// What its lamp must show, as its manual says: `green`, `red flashing 1 Hz`; `None` where the
    /// bus does not tell.
    pub lamp: Option<&'static str>,
    /// What it does or lacks, in a few words: `exchanges data, 0.95 ms cycle`.
    pub state: String,
}

/// What was found on a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Survey {
    /// Which bus.
    pub bus: Bus,
    /// The nodes, by address.
    pub nodes: Vec<Found>,
    /// What a person should know besides: octets at another rate, two nodes at one address, masters
    /// because of which nothing was asked.
    pub remarks: Vec<String>,
}

/// How far something long is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done: `listening`, `asking address 17`.
    pub doing: String,
    /// How much of it is done, 0 … 100.
    pub percent: u8,
}
