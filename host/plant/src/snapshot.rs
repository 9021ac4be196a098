//! What a bus shows of itself at one moment, whatever the bus is.

use std::sync::Arc;

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
    /// The share of the time since the snapshot before in which the wire was not idle, 0 … 1; `None`
    /// where nobody can tell. Of a [`Running`](crate::Running) plant it is half a second at least.
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
    /// The first master that serves it, as messages call it.
    pub served_by: Option<String>,
    /// What can be seen of it from outside, without any protocol.
    pub state: DeviceState,
    /// What happened to it since the snapshot before.
    pub reports: Vec<Report>,
}

/// What can be seen of a device from outside, whatever its bus.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceState {
    /// Whether it has power.
    pub power: bool,
    /// Its shaft, which turns without power too.
    pub shaft: ShaftState,
    /// What it measures; `None` without power.
    pub measured: Option<Measured>,
    /// Its lamp.
    pub lamp: LampState,
    /// Where it stands with its bus, in a word: `polled`, `data-exch`, `wait-prm`.
    pub connection: &'static str,
    /// The address of the master that owns it, of this plant or not.
    pub master: Option<u8>,
    /// Its non-volatile memory; `None` without power.
    pub memory: Option<Memory>,
    /// Where its switches stand.
    pub switches: SwitchPositions,
    /// Where they stood at the power-up that is in force, or will be next.
    pub switches_at_power_up: SwitchPositions,
    /// The kinds of the faults that it has now: `late-answers`.
    pub faults: Vec<&'static str>,
}

/// A shaft at one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaftState {
    /// The raw code of the shaft, 0 … S·M − 1; `None` where a real encoder has it.
    pub code: Option<u32>,
    /// How it moves, as text: `turn rpm=60`; `by hand` where somebody has turned it.
    pub motion: Arc<str>,
    /// Whether it moves now or will again.
    pub turning: bool,
}

/// What a device measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measured {
    /// The raw code at its newest sample, 0 … S·M − 1.
    pub code: u32,
    /// The position at its newest sample, 0 … T−1 steps.
    pub position: u32,
    /// How fast the position moves, steps per second.
    pub velocity: i64,
    /// n, the steps per turn in force.
    pub steps_per_turn: u32,
    /// T, the measuring range in force, in steps.
    pub total_resolution: u32,
    /// The sense of rotation in force: `CW` or `CCW`.
    pub direction: &'static str,
    /// The preset written last.
    pub preset: u32,
    /// What the preset function adds to the scaled position, in steps.
    pub offset: i32,
    /// A position error, or a preset out of range.
    pub alarm: bool,
    /// A low cell.
    pub warning: bool,
}

/// A lamp at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LampState {
    /// What shines, or flashes: `off`, `green`, `yellow`, `red`.
    pub colour: &'static str,
    /// How: `off`, `steady`, `flashing 1 Hz`, `flashing 5 Hz`, `self test`.
    pub pattern: &'static str,
    /// Whether it shines at this moment.
    pub lit: bool,
    /// What the lamp says, in the words of the manuals: `green flashing`.
    pub text: &'static str,
}

/// A non-volatile memory at one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    /// What it holds: `fresh`, `good`, `damaged`.
    pub state: &'static str,
    /// How often it has been written.
    pub writes: u32,
    /// The keys of the settings that the next power-up changes.
    pub unsaved: Vec<&'static str>,
}

/// Where the switches of a bus cover stand.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SwitchPositions {
    /// Both rotary switches, 0 … 9: the tens and the units of the address.
    pub rotary: [u8; 2],
    /// The DIP switches 1, 2, …, true for ON.
    pub dip: Vec<bool>,
    /// The terminating resistor.
    pub termination: bool,
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
    /// Answers a second since the snapshot before; of a [`Running`](crate::Running) plant over half a
    /// second at least.
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
