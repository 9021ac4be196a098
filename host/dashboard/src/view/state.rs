//! What changes while a plant runs.

use std::collections::BTreeMap;

use codewheel_plant::{
    BusSnapshot, DeviceSnapshot, LampState, MasterSnapshot, Memory, SlaveSnapshot, SlaveState,
    SwitchPositions,
};
use serde::Serialize;
use utoipa::ToSchema;

use super::{milliseconds, rounded, seconds};

/// The state of the plant: first whole, then as merge patches (RFC 7396) with what has changed.
#[derive(Serialize, ToSchema)]
pub(crate) struct StateDocument {
    /// Seconds since the start; in every patch.
    pub(crate) at: f64,
    /// The buses by name.
    pub(crate) buses: BTreeMap<String, BusState>,
}

/// A bus.
#[derive(Serialize, ToSchema)]
pub(crate) struct BusState {
    /// The share of the time in which it carries something, 0 to 1; null where nobody can tell.
    load: Option<f64>,
    /// Its masters by name.
    masters: BTreeMap<String, MasterState>,
    /// Its devices by name.
    devices: BTreeMap<String, DeviceState>,
}

#[derive(Serialize, ToSchema)]
struct MasterState {
    address: u8,
    on_line: bool,
    /// The last cycle.
    cycle_ms: f64,
    longest_ms: f64,
    /// Cycles completed.
    cycles: u64,
}

/// A device. What nobody knows without power is null.
#[derive(Serialize, ToSchema)]
struct DeviceState {
    power: bool,
    /// What its switches say.
    address: u8,
    /// Steps, 0 to total_resolution − 1.
    position: Option<u32>,
    /// Whole turns of the position.
    turns: Option<u32>,
    /// The share of a turn beyond them, 0 to 1.
    angle: Option<f64>,
    /// The raw code.
    code: Option<u32>,
    /// Steps a second.
    velocity: Option<i64>,
    rpm: Option<f64>,
    steps_per_turn: Option<u32>,
    total_resolution: Option<u32>,
    /// `CW` or `CCW`.
    direction: Option<&'static str>,
    /// The preset written last.
    preset: Option<u32>,
    /// What the preset function adds.
    offset: Option<i32>,
    /// A position error, or a preset out of range.
    alarm: Option<bool>,
    /// A low cell.
    warning: Option<bool>,
    lamp: LampDocument,
    /// Where it stands with its bus, in a word: `polled`, `data-exch`.
    state: &'static str,
    network: NetworkState,
    /// As its master sees it; null where no master of this plant serves it.
    master: Option<ServedState>,
    memory: Option<MemoryState>,
    switches: SwitchesState,
    /// The kinds of the faults that it has now.
    faults: Vec<&'static str>,
    shaft: ShaftDocument,
}

/// A lamp. Whether it shines at this moment is not told: the pattern is.
#[derive(Serialize, ToSchema)]
struct LampDocument {
    /// `off`, `green`, `yellow` or `red`.
    colour: &'static str,
    /// `off`, `steady`, `flashing 1 Hz` and so on.
    pattern: &'static str,
    /// What it says, in the words of the manuals.
    text: &'static str,
}

#[derive(Serialize, ToSchema)]
struct NetworkState {
    /// Where it stands with its bus, in a word.
    state: &'static str,
    /// The address of the master that owns it.
    master: Option<u8>,
}

#[derive(Serialize, ToSchema)]
struct ServedState {
    /// The master's name.
    id: Option<String>,
    /// `running`, `absent`, `configuring` or `refused`.
    state: &'static str,
    /// The position that it got last.
    position: Option<u32>,
    answers_per_second: f64,
    cycle_ms: f64,
}

#[derive(Serialize, ToSchema)]
struct MemoryState {
    /// `fresh`, `good` or `damaged`.
    state: &'static str,
    /// How often it has been written.
    writes: u32,
    /// The keys of the settings that the next power-up changes.
    unsaved: Vec<&'static str>,
}

#[derive(Serialize, ToSchema)]
struct SwitchesState {
    /// The tens and the units, as they stand.
    now: [u8; 2],
    /// As they stood at the power-up that is in force.
    at_power_up: [u8; 2],
    dip: Vec<bool>,
    dip_at_power_up: Vec<bool>,
    /// The terminating resistor.
    termination: bool,
}

#[derive(Serialize, ToSchema)]
struct ShaftDocument {
    /// The raw code of the shaft, which turns without power too; null where it is a real one.
    code: Option<u32>,
    /// How it moves: `turn rpm=60`.
    motion: String,
    /// Whether it moves.
    turning: bool,
}

impl StateDocument {
    /// The moment of a state.
    pub(crate) fn moment(snapshot: &BusSnapshot) -> f64 {
        seconds(snapshot.at)
    }
}

impl From<&BusSnapshot> for BusState {
    fn from(bus: &BusSnapshot) -> Self {
        let masters = bus.masters.iter();
        let devices = bus.devices.iter();
        Self {
            load: bus.load.map(|load| rounded(load, 2)),
            masters: masters.map(|master| (master.name.clone(), master.into())).collect(),
            devices: devices.map(|device| (device.name.clone(), device.into())).collect(),
        }
    }
}

impl From<&MasterSnapshot> for MasterState {
    fn from(master: &MasterSnapshot) -> Self {
        Self {
            address: master.address,
            on_line: master.on_line,
            cycle_ms: milliseconds(master.cycle.last),
            longest_ms: milliseconds(master.cycle.longest),
            cycles: master.cycle.count,
        }
    }
}

impl From<&DeviceSnapshot> for DeviceState {
    fn from(device: &DeviceSnapshot) -> Self {
        let state = &device.state;
        let measured = state.measured.as_ref();
        // A device has at least one step per turn; where it were none, there is no turn to tell of.
        let turn = measured.filter(|measured| measured.steps_per_turn > 0);
        Self {
            power: state.power,
            address: device.address,
            position: measured.map(|measured| measured.position),
            turns: turn.map(|measured| measured.position / measured.steps_per_turn),
            angle: turn.map(|measured| {
                let rest = measured.position % measured.steps_per_turn;
                rounded(f64::from(rest) / f64::from(measured.steps_per_turn), 5)
            }),
            code: measured.map(|measured| measured.code),
            velocity: measured.map(|measured| measured.velocity),
            rpm: turn.map(|measured| {
                let steps = f64::from(measured.steps_per_turn);
                rounded(measured.velocity as f64 * 60.0 / steps, 1)
            }),
            steps_per_turn: measured.map(|measured| measured.steps_per_turn),
            total_resolution: measured.map(|measured| measured.total_resolution),
            direction: measured.map(|measured| measured.direction),
            preset: measured.map(|measured| measured.preset),
            offset: measured.map(|measured| measured.offset),
            alarm: measured.map(|measured| measured.alarm),
            warning: measured.map(|measured| measured.warning),
            lamp: (&state.lamp).into(),
            state: state.connection,
            network: NetworkState { state: state.connection, master: state.master },
            master: device.master.as_ref().map(|slave| served(device, slave)),
            memory: state.memory.as_ref().map(MemoryState::from),
            switches: switches(&state.switches, &state.switches_at_power_up),
            faults: state.faults.clone(),
            shaft: ShaftDocument {
                code: state.shaft.code,
                motion: state.shaft.motion.to_string(),
                turning: state.shaft.turning,
            },
        }
    }
}

impl From<&LampState> for LampDocument {
    fn from(lamp: &LampState) -> Self {
        Self { colour: lamp.colour, pattern: lamp.pattern, text: lamp.text }
    }
}

impl From<&Memory> for MemoryState {
    fn from(memory: &Memory) -> Self {
        Self { state: memory.state, writes: memory.writes, unsaved: memory.unsaved.clone() }
    }
}

fn served(device: &DeviceSnapshot, slave: &SlaveSnapshot) -> ServedState {
    ServedState {
        id: device.served_by.clone(),
        state: match slave.state {
            SlaveState::Absent => "absent",
            SlaveState::Configuring => "configuring",
            SlaveState::Running => "running",
            SlaveState::Refused => "refused",
        },
        position: slave.position,
        answers_per_second: rounded(slave.answers_per_second, 0),
        cycle_ms: milliseconds(slave.cycle.last),
    }
}

fn switches(now: &SwitchPositions, at_power_up: &SwitchPositions) -> SwitchesState {
    SwitchesState {
        now: now.rotary,
        at_power_up: at_power_up.rotary,
        dip: now.dip.clone(),
        dip_at_power_up: at_power_up.dip.clone(),
        termination: now.termination,
    }
}
