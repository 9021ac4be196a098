//! Where raw codes come from: a code disc, a virtual shaft, an SSI line.

use codewheel_station::Instant;

use crate::ssi::LineFault;

/// What the sensor says at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// The raw code, 0 … N−1. It grows when the shaft turns clockwise seen looking at the flange.
    pub code: u32,
    /// Whether the voltage of the lithium cell is too low. Means nothing to products without one.
    pub cell_low: bool,
    /// What stands behind the code.
    pub reading: Reading,
}

/// What stands behind the code of a [`Sample`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Reading {
    /// It was measured for this sample.
    #[default]
    Fresh,
    /// It was measured for an earlier sample, and nothing has been measured since: what a line that
    /// is read in a cycle says in between. Not to be judged by: the next code would seem to have
    /// moved in no time.
    Repeated,
    /// It could not be measured now; the code means nothing.
    Failed(LineFault),
}

/// The source of raw codes. The encoder asks it at the moment it needs a position.
pub trait Sensor {
    /// The raw code at `now`. `now` never goes back from call to call.
    fn sample(&mut self, now: Instant) -> Sample;

    /// The earliest moment, not before `now`, at which the sample may differ from the one at
    /// `now`; `now` itself while the shaft moves, `None` while it rests until further notice. A
    /// shaft at rest need not be sampled.
    fn changes_at(&self, now: Instant) -> Option<Instant>;
}

impl<S: Sensor + ?Sized> Sensor for &mut S {
    fn sample(&mut self, now: Instant) -> Sample {
        (**self).sample(now)
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        (**self).changes_at(now)
    }
}
