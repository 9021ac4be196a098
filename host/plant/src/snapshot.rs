//! What a bus shows of itself at one moment, whatever the bus is.

use codewheel_device::{Product, Snapshot, product};
use codewheel_station::{Duration, Instant};

use crate::Report;

/// A bus at one moment.
#[derive(Clone, Debug)]
pub struct BusSnapshot {
    /// Its name.
    pub name: String,
    /// What is spoken on it.
    pub bus: product::Bus,
    /// Where it is, with the port it really got.
    pub uri: String,
    /// Its bit rate as people write it: `500k`.
    pub bit_rate: String,
    /// When, from the start of the plant.
    pub at: Instant,
    /// The share of the time since the snapshot before in which the wire was not idle, 0 … 1;
    /// `None` where nobody can tell.
    pub load: Option<f64>,
    /// Its masters.
    pub masters: Vec<MasterSnapshot>,
    /// Its devices, by address.
    pub devices: Vec<DeviceSnapshot>,
    /// What happened on the bus itself since the snapshot before.
    pub reports: Vec<Report>,
}

/// A master at one moment.
#[derive(Clone, Debug)]
pub struct MasterSnapshot {
    /// What messages call it.
    pub name: String,
    /// Its address.
    pub address: u8,
    /// Whether it is on-line.
    pub on_line: bool,
    /// Its cycles.
    pub cycle: CycleTimes,
    /// The slaves it serves, as it sees them, whether they are devices of this plant or not.
    pub slaves: Vec<(u8, SlaveSnapshot)>,
}

/// How long the cycles of a master take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleTimes {
    /// Cycles completed.
    pub count: u64,
    /// The last one.
    pub last: Duration,
    /// The longest one.
    pub longest: Duration,
}

/// A device at one moment, seen from both sides of the bus.
#[derive(Clone, Debug)]
pub struct DeviceSnapshot {
    /// What messages call it.
    pub name: String,
    /// What its address switches say, 0 … 99.
    pub address: u8,
    /// The product.
    pub product: &'static Product,
    /// The device itself; `None` while it has no power.
    pub device: Option<Snapshot>,
    /// Where it stands with the first master that serves it.
    pub master: Option<SlaveSnapshot>,
    /// What happened to it since the snapshot before.
    pub reports: Vec<Report>,
}

/// Where a slave stands with its master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlaveState {
    /// It does not answer.
    Absent,
    /// It answers and is being made ready.
    Configuring,
    /// It exchanges data.
    Running,
    /// It answers, and refuses what the master wants of it.
    Refused,
}

/// A slave as its master sees it.
#[derive(Clone, Copy, Debug)]
pub struct SlaveSnapshot {
    /// Where it stands.
    pub state: SlaveState,
    /// The position as the master got it last; `None` before the first answer.
    pub position: Option<u32>,
    /// Answers a second since the snapshot before.
    pub answers_per_second: f64,
    /// The cycles of this master.
    pub cycle: CycleTimes,
    /// What the slave has told of its health beside its data; `None` where the bus has no such
    /// thing, or nothing was told yet.
    pub diagnosis: Option<Diagnosis>,
}

/// What a slave has told of its health.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diagnosis {
    /// A position error, or a preset out of range.
    pub alarm: bool,
    /// A low cell.
    pub warning: bool,
    /// The offset of the last preset, where it was told.
    pub offset: Option<i32>,
}
