//! What a device shows of itself at one moment, without any protocol.

use codewheel_devicenet::{MacId, connection};
use codewheel_encoder::Block;
use codewheel_profibus as profibus;
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::keeping::MemoryState;
use crate::lamp::{Colour, Lamp};
use crate::profibus::Switches as ProfibusSwitches;
use crate::{Product, Switches};

/// A device at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot {
    /// What it is.
    pub product: &'static Product,
    /// Its serial number.
    pub serial: u32,
    /// The position at its newest sample, 0 … T−1 steps.
    pub position: u32,
    /// The raw code at its newest sample, 0 … N−1.
    pub code: u32,
    /// How fast the position moves, steps per second.
    pub velocity: i64,
    /// The settings in force.
    pub in_force: Block,
    /// The settings that the next power-up brings back.
    pub saved: Block,
    /// A position error.
    pub alarm: bool,
    /// A low cell.
    pub warning: bool,
    /// What the lamp says.
    pub lamp: Lamp,
    /// What the eye sees.
    pub colour: Colour,
    /// What it is to its bus.
    pub network: Network,
    /// What the memory holds.
    pub memory: MemoryState,
    /// How often the memory has been written.
    pub writes: u32,
    /// How many events were lost before they were fetched.
    pub events_lost: u32,
}

/// What a device is to its bus at one moment.
#[derive(Clone, Copy, Debug)]
pub enum Network {
    /// To a DeviceNet.
    DeviceNet(DeviceNetState),
    /// To a PROFIBUS.
    Profibus(ProfibusState),
}

/// What a server is to its DeviceNet.
#[derive(Clone, Copy, Debug)]
pub struct DeviceNetState {
    /// Where its switches stand.
    pub switches: Switches,
    /// The owning master.
    pub master: Option<MacId>,
    /// The state of the explicit connection, if it exists.
    pub explicit: Option<connection::State>,
    /// The state of the poll connection, if it exists.
    pub poll: Option<connection::State>,
    /// The state of the change of state or cyclic connection, if it exists.
    pub change_of_state: Option<connection::State>,
}

/// What a slave is to its PROFIBUS.
#[derive(Clone, Copy, Debug)]
pub struct ProfibusState {
    /// Where its switches stand.
    pub switches: ProfibusSwitches,
    /// WAIT_PRM, WAIT_CFG or DATA_EXCH.
    pub state: profibus::State,
    /// The master that has locked it.
    pub master: Option<u8>,
    /// The rate of the line; `None` while it is searched.
    pub baud_rate: Option<BaudRate>,
    /// The watchdog time, while the watchdog is on.
    pub watchdog: Option<Duration>,
    /// What station status 1 complains of.
    pub faults: profibus::Faults,
    /// Whether class 2 is on: scaling, preset, long diagnosis.
    pub class_2: bool,
    /// The identifier of the configuration in force: D0h, D1h, F0h or F1h.
    pub configuration: u8,
    /// Outputs wait for the next Sync.
    pub sync: bool,
    /// Inputs stay as at the last Freeze.
    pub freeze: bool,
    /// A preset out of range stands: the alarm stays until one in range comes.
    pub preset_refused: bool,
}

impl Snapshot {
    /// The state on DeviceNet, for a device that speaks it.
    #[must_use]
    pub const fn devicenet(&self) -> Option<&DeviceNetState> {
        match &self.network {
            Network::DeviceNet(state) => Some(state),
            Network::Profibus(_) => None,
        }
    }

    /// The state on PROFIBUS, for a device that speaks it.
    #[must_use]
    pub const fn profibus(&self) -> Option<&ProfibusState> {
        match &self.network {
            Network::Profibus(state) => Some(state),
            Network::DeviceNet(_) => None,
        }
    }

    /// Whole turns in the position, by the steps per turn in force.
    #[must_use]
    pub const fn turns(&self) -> u32 {
        match self.position.checked_div(self.in_force.settings.steps_per_turn) {
            Some(turns) => turns,
            None => 0,
        }
    }
}
