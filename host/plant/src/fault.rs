//! What goes wrong in a plant, and when.

use std::collections::VecDeque;
use std::fmt;

use codewheel_device::Product;
use codewheel_sim::ssi;
use codewheel_station::{Duration, Instant};

use crate::check::fault_of_words;
use crate::{SensorPlan, TimeSpan};

/// Something that goes wrong with a device, or right again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// When it begins, from the start of the plant.
    pub at: Instant,
    /// What happens.
    pub lever: Lever,
}

impl Fault {
    /// The fault that `words` name for `product` with `sensor` on a real port, with the words of
    /// plant files: `jump steps=4000 at=5s`, `power-cut at=2s for=500ms`.
    ///
    /// # Errors
    /// What is wrong with them, as one sentence.
    pub fn parse(words: &str, product: &Product, sensor: &SensorPlan) -> Result<Self, String> {
        fault_of_words(words, product, sensor)
    }
}

/// The levers of faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lever {
    /// The code jumps by so many raw steps and stays there.
    Jump(i32),
    /// The voltage of the lithium cell is too low, or right again.
    CellLow(bool),
    /// The sensor holds its code, or lets go of it.
    Stuck(bool),
    /// The power is gone for so long; a record in RAM that is just being written is torn.
    PowerCut(Duration),
    /// Frames or telegrams of the device are dropped.
    DropAnswers {
        /// How likely each one is dropped, 0 … 1.
        probability: f64,
        /// After so many it is over.
        count: Option<u32>,
        /// For how long; `None`: for ever.
        lasts: Option<Duration>,
    },
    /// Frames or telegrams of the device come late.
    LateAnswers {
        /// How late.
        delay: Duration,
        /// For how long; `None`: for ever.
        lasts: Option<Duration>,
    },
    /// The CAN controller leaves the bus for 128 times 11 recessive bits.
    BusOff,
    /// Something is wrong with the encoder at an SSI line or its wires, or right again.
    Ssi(Option<ssi::Fault>),
    /// What the device sends is destroyed on the wire; a CAN controller counts that up to bus-off.
    BadTransceiver {
        /// How likely each one is destroyed, 0 … 1.
        probability: f64,
        /// For how long; `None`: for ever.
        lasts: Option<Duration>,
    },
}

impl Lever {
    /// How long it lasts, where it ends by itself.
    #[must_use]
    pub const fn lasts(&self) -> Option<Duration> {
        match self {
            Self::PowerCut(lasts) => Some(*lasts),
            Self::DropAnswers { lasts, .. }
            | Self::LateAnswers { lasts, .. }
            | Self::BadTransceiver { lasts, .. } => *lasts,
            _ => None,
        }
    }

    /// Whether it acts on the sensor.
    pub(crate) const fn is_of_the_sensor(&self) -> bool {
        matches!(self, Self::Jump(_) | Self::CellLow(_) | Self::Stuck(_) | Self::Ssi(_))
    }
}

impl fmt::Display for Lever {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Jump(steps) => write!(f, "the code jumps by {steps} steps")?,
            Self::CellLow(true) => f.write_str("the lithium cell runs low")?,
            Self::CellLow(false) => f.write_str("the lithium cell is replaced")?,
            Self::Stuck(true) => f.write_str("the sensor is stuck")?,
            Self::Stuck(false) => f.write_str("the sensor is free again")?,
            Self::PowerCut(_) => f.write_str("the power is cut")?,
            Self::DropAnswers { probability, count, .. } => {
                match count {
                    Some(count) => write!(f, "{count} answers are dropped")?,
                    None => f.write_str("answers are dropped")?,
                }
                if *probability < 1.0 {
                    write!(f, " with a probability of {probability}")?;
                }
            }
            Self::LateAnswers { delay, .. } => {
                write!(f, "answers are {} late", TimeSpan(*delay))?;
            }
            Self::BusOff => f.write_str("the controller leaves the bus")?,
            Self::Ssi(None) => f.write_str("the SSI line is right again")?,
            Self::Ssi(Some(ssi::Fault::Unplugged)) => {
                f.write_str("the SSI encoder is unplugged")?
            }
            Self::Ssi(Some(ssi::Fault::Shorted)) => f.write_str("the SSI data line is shorted")?,
            Self::Ssi(Some(ssi::Fault::WordLength(bits))) => {
                write!(f, "the SSI encoder sends words of {bits} bits")?;
            }
            Self::Ssi(Some(ssi::Fault::NoMonoflop)) => {
                f.write_str("the SSI encoder loses its monoflop")?;
            }
            Self::Ssi(Some(ssi::Fault::FlippedBits(bits))) => {
                write!(f, "bits {bits:X}h of each SSI word arrive inverted")?;
            }
            Self::BadTransceiver { probability, .. } => {
                f.write_str("the transceiver destroys what it sends")?;
                if *probability < 1.0 {
                    write!(f, " with a probability of {probability}")?;
                }
            }
        }
        match self.lasts() {
            Some(lasts) => write!(f, " for {}", TimeSpan(lasts)),
            None => Ok(()),
        }
    }
}

/// What is done to a device at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Action {
    Begin(Lever),
    End(Lever),
}

/// All that will be done to the devices of one bus.
#[derive(Clone, Debug)]
pub(crate) struct Agenda {
    /// The next one first.
    pub(crate) steps: VecDeque<(Instant, usize, Action)>,
}

impl Agenda {
    pub(crate) fn new<'a>(devices: impl Iterator<Item = &'a [Fault]>) -> Self {
        let mut steps = Vec::new();
        for (place, faults) in devices.enumerate() {
            for Fault { at, lever } in faults {
                steps.push((*at, place, Action::Begin(*lever)));
                if let Some(lasts) = lever.lasts() {
                    steps.push((*at + lasts, place, Action::End(*lever)));
                }
            }
        }
        // What ends at a moment ends before what begins then; the rest stays in its order.
        steps.sort_by_key(|(at, _, action)| (*at, matches!(action, Action::Begin(_))));
        Self { steps: steps.into() }
    }

    pub(crate) fn next_at(&self) -> Option<Instant> {
        self.steps.front().map(|(at, ..)| *at)
    }

    /// The next step that is due.
    pub(crate) fn take_due(&mut self, now: Instant) -> Option<(usize, Action)> {
        self.next_at().filter(|at| *at <= now)?;
        self.steps.pop_front().map(|(_, place, action)| (place, action))
    }
}
