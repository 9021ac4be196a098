//! Faults of the sensor.

use codewheel_encoder::{Sample, Sensor};
use codewheel_station::Instant;

/// A sensor that can be made to fail.
///
/// After a change the next question for the next change answers "now", so that an encoder on a
/// shaft at rest looks again; who changes it still has to have the station's deadline read anew,
/// as [`Wire::node_mut`](crate::can::Wire::node_mut) does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Faulty<S> {
    sensor: S,
    codes: u32,
    stuck: bool,
    /// Steps, modulo the number of codes, added to what the sensor says.
    jumped: u32,
    cell_low: bool,
    last_code: Option<u32>,
    disturbed: bool,
}

impl<S: Sensor> Faulty<S> {
    /// A sound sensor of `codes` raw codes, S · M; 0 counts as 1.
    #[must_use]
    pub fn new(sensor: S, codes: u32) -> Self {
        Self {
            sensor,
            codes: codes.max(1),
            stuck: false,
            jumped: 0,
            cell_low: false,
            last_code: None,
            disturbed: false,
        }
    }

    /// Holds the code of the last sample from now on, or of the next one where there was none; or
    /// lets go of it.
    pub fn set_stuck(&mut self, stuck: bool) {
        self.stuck = stuck;
        self.disturbed = true;
    }

    /// Adds `steps` to the code from now on, on top of earlier jumps.
    pub fn jump(&mut self, steps: i32) {
        let codes = i64::from(self.codes);
        self.jumped = (i64::from(self.jumped) + i64::from(steps)).rem_euclid(codes) as u32;
        self.disturbed = true;
    }

    /// Sets whether the voltage of the lithium cell is too low.
    pub fn set_cell_low(&mut self, cell_low: bool) {
        self.cell_low = cell_low;
        self.disturbed = true;
    }

    /// Whether it holds its code.
    #[must_use]
    pub const fn is_stuck(&self) -> bool {
        self.stuck
    }

    /// Whether the voltage of the lithium cell was set too low.
    #[must_use]
    pub const fn is_cell_low(&self) -> bool {
        self.cell_low
    }

    /// How far the code has jumped, in steps modulo the number of codes.
    #[must_use]
    pub const fn jumped(&self) -> u32 {
        self.jumped
    }

    /// The sensor behind the faults.
    pub const fn sensor(&self) -> &S {
        &self.sensor
    }

    /// The sensor behind the faults, to be changed or replaced.
    pub const fn sensor_mut(&mut self) -> &mut S {
        self.disturbed = true;
        &mut self.sensor
    }
}

impl<S: Sensor> Sensor for Faulty<S> {
    fn sample(&mut self, now: Instant) -> Sample {
        self.disturbed = false;
        let sample = self.sensor.sample(now);
        let code = match self.last_code {
            Some(code) if self.stuck => code,
            _ => {
                let code = u64::from(sample.code) + u64::from(self.jumped);
                (code % u64::from(self.codes)) as u32
            }
        };
        self.last_code = Some(code);
        Sample { code, cell_low: sample.cell_low || self.cell_low, ..sample }
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        if self.disturbed { Some(now) } else { self.sensor.changes_at(now) }
    }
}
