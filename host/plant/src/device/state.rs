//! What can be seen of a device from outside, in words that no bus has to explain.

use codewheel_device::{
    Colour, DeviceNetState, Lamp, MemoryState, Network, ProfibusState, Snapshot,
};
use codewheel_devicenet::connection::State;
use codewheel_encoder::{Block, Direction};
use codewheel_profibus as profibus;
use codewheel_station::Instant;

use super::Device;
use crate::field_bus::FieldBus;
use crate::snapshot::{
    DeviceState, LampState, Measured, Memory, ShaftState, SlaveSnapshot, SlaveState,
};

impl<B: FieldBus> Device<B> {
    /// What can be seen of it; `snapshot` is that of now, `master` how the master of this plant sees it
    /// that serves it, `faults` the kinds of faults that it has.
    pub(crate) fn state(
        &self,
        now: Instant,
        snapshot: Option<&Snapshot>,
        master: Option<&SlaveSnapshot>,
        faults: Vec<&'static str>,
    ) -> DeviceState {
        DeviceState {
            power: snapshot.is_some(),
            shaft: self.shaft_state(now),
            measured: snapshot.map(measured),
            lamp: snapshot.map_or(LampState::DARK, lamp),
            connection: connection(snapshot.map(|snapshot| &snapshot.network), master),
            master: snapshot.and_then(|snapshot| owner(&snapshot.network)),
            memory: snapshot.map(memory),
            switches: self.switches().clone(),
            switches_at_power_up: self.switches_at_power_up().clone(),
            faults,
        }
    }

    fn shaft_state(&self, now: Instant) -> ShaftState {
        let disc = self.sensor().shaft();
        ShaftState {
            code: disc.map(|disc| {
                let code = u64::from(disc.sensor().code(now)) + u64::from(disc.jumped());
                (code % u64::from(disc.sensor().codes())) as u32
            }),
            motion: self.motion().clone(),
            turning: disc.is_some_and(|disc| disc.sensor().moves_from(now)),
        }
    }
}

fn measured(snapshot: &Snapshot) -> Measured {
    let Block { settings, preset, offset, .. } = snapshot.in_force;
    Measured {
        code: snapshot.code,
        position: snapshot.position,
        velocity: snapshot.velocity,
        steps_per_turn: settings.steps_per_turn,
        total_resolution: settings.total_resolution,
        direction: match settings.direction {
            Direction::Cw => "CW",
            Direction::Ccw => "CCW",
        },
        preset,
        offset,
        alarm: snapshot.alarm,
        warning: snapshot.warning,
    }
}

impl LampState {
    /// A lamp without power.
    const DARK: Self = Self { colour: "off", pattern: "off", lit: false, text: "off" };
}

fn lamp(snapshot: &Snapshot) -> LampState {
    let lit = snapshot.colour != Colour::Dark;
    let state = |colour, pattern, text| LampState { colour, pattern, lit, text };
    match snapshot.lamp {
        Lamp::Off => LampState::DARK,
        Lamp::GreenFlashing => state("green", "flashing 1 Hz", "green flashing"),
        Lamp::Green => state("green", "steady", "green"),
        Lamp::Yellow => state("yellow", "steady", "yellow"),
        Lamp::RedFlashing => state("red", "flashing 1 Hz", "red flashing"),
        Lamp::RedFlashingFast => state("red", "flashing 5 Hz", "red flashing fast"),
        Lamp::Red => state("red", "steady", "red"),
        Lamp::SelfTest => match snapshot.colour {
            Colour::Green => state("green", "self test", "self test"),
            _ => state("red", "self test", "self test"),
        },
    }
}

fn memory(snapshot: &Snapshot) -> Memory {
    Memory {
        state: match snapshot.memory {
            MemoryState::Fresh => "fresh",
            MemoryState::Good => "good",
            MemoryState::Damaged => "damaged",
        },
        writes: snapshot.writes,
        unsaved: unsaved(&snapshot.in_force, &snapshot.saved, &snapshot.network),
    }
}

/// The keys of what the next power-up changes.
fn unsaved(in_force: &Block, saved: &Block, network: &Network) -> Vec<&'static str> {
    let Block { settings, preset, offset, crossings_at_change: _, cos_delta } = in_force;
    // On PROFIBUS the master brings the parameters; the offset goes with the ones it was made under.
    let of_master = matches!(network, Network::Profibus(_));
    if of_master {
        return Vec::new();
    }
    let before = &saved.settings;
    let changes = [
        ("direction", settings.direction != before.direction),
        ("steps-per-turn", settings.steps_per_turn != before.steps_per_turn),
        ("total-resolution", settings.total_resolution != before.total_resolution),
        ("preset", *preset != saved.preset),
        ("cos-delta", *cos_delta != saved.cos_delta),
        ("offset", *offset != saved.offset),
    ];
    changes.into_iter().filter(|(_, changed)| *changed).map(|(key, _)| key).collect()
}

/// The master that owns a device.
fn owner(network: &Network) -> Option<u8> {
    match network {
        Network::DeviceNet(state) => state.master.map(codewheel_devicenet::MacId::value),
        Network::Profibus(state) => state.master,
    }
}

/// Where a device stands with its master, or, where nobody here masters it, what it says itself.
fn connection(network: Option<&Network>, master: Option<&SlaveSnapshot>) -> &'static str {
    match (master.map(|master| master.state), network) {
        (Some(SlaveState::Absent), _) | (_, None) => "absent",
        (_, Some(Network::Profibus(state))) => standing(state),
        (Some(SlaveState::Running), Some(Network::DeviceNet(state))) => established(state),
        (Some(SlaveState::Refused), _) => "refused",
        (Some(SlaveState::Configuring), _) => "configuring",
        (None, Some(Network::DeviceNet(state))) => {
            match (state.poll.or(state.change_of_state), state.explicit) {
                (Some(State::Established), _) => established(state),
                (Some(State::TimedOut), _) => "timed-out",
                (Some(_), _) => "configuring",
                (None, Some(_)) => "explicit",
                (None, None) => "none",
            }
        }
    }
}

/// Which I/O connection a server exchanges data on.
const fn established(state: &DeviceNetState) -> &'static str {
    match (state.poll, state.change_of_state) {
        (Some(State::Established), Some(State::Established)) => "polled+cos",
        (Some(State::Established), _) => "polled",
        (_, Some(State::Established)) => "cos",
        _ => "explicit",
    }
}

/// Where a slave stands on its way to data exchange, with the names of the standard.
const fn standing(state: &ProfibusState) -> &'static str {
    match state.state {
        _ if state.baud_rate.is_none() => "baud-search",
        profibus::State::WaitPrm if state.faults.parameters || state.faults.not_supported => {
            "prm-fault"
        }
        profibus::State::WaitPrm if state.faults.configuration => "cfg-fault",
        profibus::State::WaitPrm => "wait-prm",
        profibus::State::WaitCfg => "wait-cfg",
        profibus::State::DataExchange => "data-exch",
    }
}
