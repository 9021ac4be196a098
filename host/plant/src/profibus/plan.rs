//! What a plan says of the devices and masters of a PROFIBUS.

use codewheel_commission::profibus::{MasterSettings, SlaveSettings};
use codewheel_device::profibus::parameters::{
    CLASS_2, DIRECTION, SCALING, STEPS_PER_TURN, TOTAL_RESOLUTION,
};
use codewheel_device::profibus::{IDENT_NUMBER, configuration};
use codewheel_encoder::{Direction, Geometry};
use codewheel_station::Instant;

use crate::field_bus::PlannedMaster;

/// What a device is told at power-up besides its switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceOptions {
    /// Whether it searches the rate of its line; otherwise it is told that of the bus.
    pub auto_baud: bool,
}

/// A DP master.
#[derive(Clone, Debug, PartialEq)]
pub struct DpMasterPlan {
    /// What messages call it.
    pub name: String,
    /// What it is told about itself and the bus.
    pub settings: MasterSettings,
    /// Whether its terminating resistors are on.
    pub termination: bool,
    /// It has the address of an earlier station on purpose.
    pub duplicate: bool,
    /// The slaves it serves, in the order in which it serves them.
    pub slaves: Vec<DpSlavePlan>,
}

/// A slave of a DP master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DpSlavePlan {
    /// Its address.
    pub address: u8,
    /// Whether device class 2 is on: scaling, preset, the long diagnosis.
    pub class_2: bool,
    /// What is exchanged.
    pub configuration: &'static configuration::Row,
    /// The sense of rotation.
    pub direction: Direction,
    /// Whether the position is scaled to the two numbers below.
    pub scaling: bool,
    /// n, the steps per turn.
    pub steps_per_turn: u32,
    /// T, the total resolution in steps.
    pub total_resolution: u32,
    /// Its groups, a bit each.
    pub groups: u8,
    /// The presets it gets, in order.
    pub presets: Vec<PresetPlan>,
}

/// A preset that a master gives to a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PresetPlan {
    /// When, from the start of the plant; later where the slave exchanges no data then.
    pub at: Instant,
    /// The position that the shaft has from then on.
    pub value: u32,
}

impl DpSlavePlan {
    /// A slave with the parameters of a new device of this geometry: class 2, F1h, CW, scaled to
    /// what its code disc has.
    #[must_use]
    pub const fn new(address: u8, geometry: Geometry) -> Self {
        let [_, two_words_and_preset, ..] = &configuration::ROWS;
        Self {
            address,
            class_2: true,
            configuration: two_words_and_preset,
            direction: Direction::Cw,
            scaling: true,
            steps_per_turn: geometry.singleturn_resolution(),
            total_resolution: geometry.range(),
            groups: 0,
            presets: Vec::new(),
        }
    }

    /// What the master is told about it.
    #[must_use]
    pub fn settings(&self) -> SlaveSettings {
        SlaveSettings {
            address: self.address,
            ident_number: IDENT_NUMBER,
            user_parameters: self.user_parameters(),
            configuration: vec![self.configuration.identifier],
            inputs: self.configuration.inputs.into(),
            outputs: self.configuration.outputs.into(),
            groups: self.groups,
            ..SlaveSettings::default()
        }
    }

    /// Octets 8 to 17 of Set_Prm; in class 1, which has no scaling, 8 and 9 (PROFIBUS manual §6.1).
    fn user_parameters(&self) -> Vec<u8> {
        let mut octets = vec![0; if self.class_2 { 10 } else { 2 }];
        DIRECTION.write((self.direction == Direction::Ccw).into(), &mut octets);
        CLASS_2.write(self.class_2.into(), &mut octets);
        SCALING.write(self.scaling.into(), &mut octets);
        STEPS_PER_TURN.write(self.steps_per_turn, &mut octets);
        TOTAL_RESOLUTION.write(self.total_resolution, &mut octets);
        octets
    }
}

impl PlannedMaster for DpMasterPlan {
    const KIND: &'static str = "dp-master";

    fn name(&self) -> &str {
        &self.name
    }

    fn address(&self) -> u8 {
        self.settings.address
    }

    fn termination(&self) -> bool {
        self.termination
    }

    fn slaves(&self) -> impl Iterator<Item = u8> {
        self.slaves.iter().map(|slave| slave.address)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// PROFIBUS manual §6.1 and §8, the example of 3600 steps and 256 turns.
    #[test]
    fn user_parameters_are_those_of_the_manual() {
        let scaled = DpSlavePlan {
            steps_per_turn: 3_600,
            total_resolution: 921_600,
            direction: Direction::Ccw,
            ..DpSlavePlan::new(7, Geometry::MULTITURN_29)
        };
        let octets = scaled.settings().user_parameters;
        assert_eq!(octets, [0x00, 0x0B, 0x00, 0x00, 0x0E, 0x10, 0x00, 0x0E, 0x10, 0x00]);
        let plain = DpSlavePlan {
            class_2: false,
            scaling: false,
            ..DpSlavePlan::new(7, Geometry::SINGLETURN_13)
        };
        assert_eq!(plain.settings().user_parameters, [0, 0]);
    }
}
