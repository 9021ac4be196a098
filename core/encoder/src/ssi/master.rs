//! The master's side of an SSI line, without I/O.

use codewheel_station::Instant;

use super::{LineFault, Refusal, Settings};
use crate::{Reading, Sample};

/// Says what to clock and when, and turns what was sampled into samples for an
/// [`Encoder`](crate::Encoder).
///
/// For boards that clock the line in the background. Where a transfer can be waited for, an
/// [`Input`](super::Input) needs less.
#[derive(Clone, Debug)]
pub struct Master {
    settings: Settings,
    reads_at: Instant,
    /// The code of the last good reading; 0 before there was one.
    code: u32,
}

impl Master {
    /// A master that has not read yet and does so at once.
    ///
    /// # Errors
    /// What [`Settings::check`] refuses.
    pub fn new(settings: Settings) -> Result<Self, Refusal> {
        settings.check()?;
        Ok(Self { settings, reads_at: Instant::ZERO, code: 0 })
    }

    /// How the line is read: [`clocks`](Settings::clocks) at [`clock_hz`](Settings::clock_hz).
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// When the next reading is due: a cycle after the one before.
    #[must_use]
    pub const fn reads_at(&self) -> Instant {
        self.reads_at
    }

    /// Takes in a reading whose first clock was at `now`, as for [`Settings::decode`]; `None` where
    /// the port did not clock the line. Returns the sample of this moment.
    pub fn read(&mut self, now: Instant, sampled: Option<u64>) -> Sample {
        self.reads_at = now + self.settings.cycle;
        let reading = sampled.ok_or(LineFault::NoTransfer);
        let reading = match reading.and_then(|sampled| self.settings.decode(sampled)) {
            Ok(code) => {
                self.code = code;
                Reading::Fresh
            }
            Err(fault) => Reading::Failed(fault),
        };
        Sample { reading, ..self.repeated() }
    }

    /// The sample between two readings: nothing new.
    #[must_use]
    pub fn repeated(&self) -> Sample {
        Sample { code: self.code, cell_low: false, reading: Reading::Repeated }
    }
}
