//! What a device shows of itself at one moment, without any protocol.

use codewheel_devicenet::MacId;
use codewheel_devicenet::connection::State;
use codewheel_encoder::Block;

use crate::keeping::MemoryState;
use crate::lamp::{Colour, Lamp};
use crate::{Product, Switches};

/// A device at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot {
    /// What it is.
    pub product: &'static Product,
    /// Where its switches stand.
    pub switches: Switches,
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
    /// The owning master.
    pub master: Option<MacId>,
    /// The state of the explicit connection, if it exists.
    pub explicit: Option<State>,
    /// The state of the poll connection, if it exists.
    pub poll: Option<State>,
    /// The state of the change of state or cyclic connection, if it exists.
    pub change_of_state: Option<State>,
    /// What the memory holds.
    pub memory: MemoryState,
    /// How often the memory has been written.
    pub writes: u32,
    /// How many events were lost before they were fetched.
    pub events_lost: u32,
}

impl Snapshot {
    /// Whole turns in the position, by the steps per turn in force.
    #[must_use]
    pub const fn turns(&self) -> u32 {
        match self.position.checked_div(self.in_force.settings.steps_per_turn) {
            Some(turns) => turns,
            None => 0,
        }
    }
}
