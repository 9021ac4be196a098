//! Shafts: raw codes as pure functions of virtual time.
//!
//! A shaft is one line of text:
//!
//! | text | the shaft |
//! |---|---|
//! | `still` | rests |
//! | `turn rpm=60` | turns evenly; `-0.5` is backwards |
//! | `sine amplitude=90deg period=2s` | swings to both sides of where it began |
//! | `profile 0s:0 1s:90deg 3s:2turns` | goes from point to point and rests after the last |
//! | `profile 0s:0 1s:90deg 2s:90deg repeat` | the same without end, each round from where the last one ended |
//! | `csv FILE` | as `profile`, from lines of seconds and turns |
//!
//! Each takes `angle=`, the angle at the beginning, to which the others are relative: `angle=4096`.
//! An *angle* is a whole number of raw steps (`4096`), or degrees (`90deg`), or turns
//! (`1.5turns`); a *time* is in seconds (`2`, `2s`) or milliseconds (`500ms`). Numbers are decimal
//! with up to nine decimals.
//!
//! Angles grow when the shaft turns clockwise seen looking at the flange, and wrap at the number of
//! codes. All arithmetic is exact, so a shaft does not drift in centuries; only the sine is
//! computed in floating point, freshly for each moment.

mod faulty;
mod hand;
mod motion;
mod number;
mod table;
mod text;

use std::path::Path;

use codewheel_encoder::{Sample, Sensor};
use codewheel_station::{Duration, Instant};

pub use faulty::Faulty;
use motion::Motion;
pub use text::ShaftError;

/// Parts of a raw step in which angles are counted: degrees and decimals come out whole.
const PARTS: i128 = 360_000_000_000;

/// A shaft with its code disc.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaft {
    /// Raw codes, S · M.
    codes: u32,
    /// In [`PARTS`] of a step.
    start: i128,
    begins: Instant,
    motion: Motion,
}

impl Shaft {
    /// The shaft that `text` describes, in the notation of [this module](self), with a code disc of
    /// `singleturn_resolution` steps per turn (S) whose sensor tells `revolutions` turns apart (M).
    /// It begins to move at [`Instant::ZERO`].
    ///
    /// # Errors
    /// [`ShaftError`], one sentence that says what was given and what is allowed: a text that makes
    /// no sense, a file that cannot be read, or S · M outside 1 … 2³²−1.
    pub fn parse(
        text: &str,
        singleturn_resolution: u32,
        revolutions: u32,
    ) -> Result<Self, ShaftError> {
        text::parse(text, singleturn_resolution, revolutions)
    }

    /// The text of a shaft in which a relative FILE of `csv` is meant from `folder`, as one that means
    /// the same from anywhere the folder can be named. Other texts stay as they are.
    #[must_use]
    pub fn text_in_folder(text: &str, folder: &Path) -> String {
        text::in_folder(text, folder)
    }

    /// The same shaft, whose motion begins at `at`; until then it rests at its first angle.
    #[must_use]
    pub fn beginning(self, at: Instant) -> Self {
        Self { begins: at, ..self }
    }

    /// The same shaft with the raw code it begins from, modulo the number of codes, in place of the
    /// `angle=` of its text. With [`beginning`](Self::beginning) a new motion goes on where another
    /// shaft is.
    #[must_use]
    pub fn from_code(self, code: u32) -> Self {
        Self { start: i128::from(code) * PARTS, ..self }
    }

    /// The raw codes the shaft has, S · M: 1 … 2³²−1.
    #[must_use]
    pub const fn codes(&self) -> u32 {
        self.codes
    }

    /// The raw code at `now`, 0 … S · M − 1.
    #[must_use]
    pub fn code(&self, now: Instant) -> u32 {
        let angle = self.start + self.motion.angle(now.since(self.begins));
        angle.div_euclid(PARTS).rem_euclid(i128::from(self.codes)) as u32
    }
}

impl Sensor for Shaft {
    #[inline]
    fn sample(&mut self, now: Instant) -> Sample {
        Sample { code: self.code(now), ..Sample::default() }
    }

    fn changes_at(&self, now: Instant) -> Option<Instant> {
        let moves = self.motion.moves_at(now.since(self.begins))?;
        Some(now.max(self.begins + moves))
    }
}

/// The angle between `from` and `to`, `part` of `whole` along the way, rounded down.
///
/// Divided first and multiplied then, because the product may not fit.
fn along(from: i128, to: i128, part: Duration, whole: Duration) -> i128 {
    let (part, whole) = (i128::from(part.as_nanos()), i128::from(whole.as_nanos().max(1)));
    let way = to - from;
    from + way.div_euclid(whole) * part + (way.rem_euclid(whole) * part).div_euclid(whole)
}
