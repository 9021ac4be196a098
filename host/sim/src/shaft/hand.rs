//! Shafts that are turned by hand, and motions that go on where another one was.

use codewheel_station::{Duration, Instant};

use super::motion::{Motion, Point, Profile};
use super::{PARTS, Shaft};

impl Shaft {
    /// The same motion, beginning at `now` where `other` is then, to the fraction of a step, in place
    /// of its own beginning and angle.
    #[must_use]
    pub fn going_on_from(self, other: &Self, now: Instant) -> Self {
        Self { start: other.angle(now), begins: now, ..self }
    }

    /// This shaft, held where it is at `now`.
    #[must_use]
    pub fn held(&self, now: Instant) -> Self {
        self.moving(now, Motion::Still)
    }

    /// This shaft, turned by `steps` evenly in the time `lasts` from `now` on, and held then. What
    /// motion it had is over.
    #[must_use]
    pub fn turned(&self, now: Instant, steps: i64, lasts: Duration) -> Self {
        let end = Point { at: lasts, angle: i128::from(steps) * PARTS };
        let begin = (lasts > Duration::ZERO).then_some(Point { at: Duration::ZERO, angle: 0 });
        let points = begin.into_iter().chain([end]).collect();
        self.moving(now, Motion::Profile(Profile::once(points)))
    }

    /// How many steps lie between where it is at `now` and where it will rest; 0 for a shaft that
    /// never does.
    #[must_use]
    pub fn steps_left(&self, now: Instant) -> i64 {
        let time = now.since(self.begins);
        let Motion::Profile(profile) = &self.motion else { return 0 };
        let left = profile.end().map_or(0, |end| {
            let step = |angle: i128| (self.start + angle).div_euclid(PARTS);
            step(end) - step(self.motion.angle(time))
        });
        i64::try_from(left).unwrap_or_default()
    }

    /// Whether it moves at `now`, or will without being touched.
    #[must_use]
    pub fn moves_from(&self, now: Instant) -> bool {
        self.motion.moves_at(now.since(self.begins)).is_some()
    }

    fn moving(&self, now: Instant, motion: Motion) -> Self {
        Self { codes: self.codes, start: self.angle(now), begins: now, motion }
    }

    /// The angle at `now`, in [`PARTS`] of a step, as if there were one range only.
    fn angle(&self, now: Instant) -> i128 {
        let angle = self.start + self.motion.angle(now.since(self.begins));
        angle.rem_euclid(i128::from(self.codes) * PARTS)
    }
}
