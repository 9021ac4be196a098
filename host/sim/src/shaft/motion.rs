//! What a shaft does from its beginning on.

use codewheel_station::Duration;

use super::along;

/// A motion as a function of the time since its beginning. Angles are relative to the first one, in
/// [`PARTS`](super::PARTS) of a step.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Motion {
    Still,
    Turn {
        /// Per minute, not zero.
        angle: i128,
    },
    Sine {
        /// Not zero.
        amplitude: i128,
        /// Not zero.
        period: Duration,
    },
    Profile(Profile),
}

/// Points in time with straight lines between them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Profile {
    /// At least one, in strictly rising time.
    points: Vec<Point>,
    /// Begins anew at each multiple of the time of the last point. `None`: rests there.
    repeat: Option<Repeat>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Point {
    pub(super) at: Duration,
    pub(super) angle: i128,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Repeat {
    /// The time of the last point.
    period: Duration,
    /// How far one round carries the shaft, modulo the number of codes: it is multiplied by the
    /// number of rounds, and must not outgrow its type.
    advance: i128,
}

const MINUTE: Duration = Duration::from_secs(60);

impl Motion {
    pub(super) fn angle(&self, time: Duration) -> i128 {
        match self {
            Self::Still => 0,
            Self::Turn { angle } => along(0, *angle, time, MINUTE),
            Self::Sine { amplitude, period } => {
                // The whole periods are taken off exactly, so the sine is as good after a century
                // as in the first second.
                let phase = time.as_nanos() % period.as_nanos();
                let turn = phase as f64 / period.as_nanos() as f64;
                (*amplitude as f64 * (turn * std::f64::consts::TAU).sin()).round() as i128
            }
            Self::Profile(profile) => profile.angle(time),
        }
    }

    /// When the angle may differ next from the one at `time`; not before `time`.
    pub(super) fn moves_at(&self, time: Duration) -> Option<Duration> {
        match self {
            Self::Still => None,
            Self::Turn { .. } | Self::Sine { .. } => Some(time),
            Self::Profile(profile) => profile.moves_at(time),
        }
    }
}

impl Profile {
    /// `points` is not empty and rises strictly in time.
    pub(super) fn once(points: Vec<Point>) -> Self {
        Self { points, repeat: None }
    }

    /// As [`once`](Self::once), the last point not at zero. `codes` are those of the shaft in
    /// [`PARTS`](super::PARTS).
    pub(super) fn repeated(points: Vec<Point>, codes: i128) -> Self {
        let repeat = points.first().zip(points.last()).map(|(first, last)| Repeat {
            period: last.at,
            advance: (last.angle - first.angle).rem_euclid(codes),
        });
        Self { points, repeat }
    }

    /// The angle of the last point, where it rests there.
    pub(super) fn end(&self) -> Option<i128> {
        if self.repeat.is_some() {
            return None;
        }
        self.points.last().map(|point| point.angle)
    }

    fn angle(&self, time: Duration) -> i128 {
        match self.repeat {
            Some(Repeat { period, advance }) => {
                let rounds = time.as_nanos() / period.as_nanos();
                i128::from(rounds) * advance + self.angle_in_round(within(time, period))
            }
            None => self.angle_in_round(time),
        }
    }

    fn angle_in_round(&self, time: Duration) -> i128 {
        let next = self.points.partition_point(|point| point.at <= time);
        let before = next.checked_sub(1).and_then(|index| self.points.get(index));
        match (before, self.points.get(next)) {
            (Some(from), Some(to)) => {
                let part = Duration::from_nanos(time.as_nanos() - from.at.as_nanos());
                let whole = Duration::from_nanos(to.at.as_nanos() - from.at.as_nanos());
                along(from.angle, to.angle, part, whole)
            }
            (Some(point), None) | (None, Some(point)) => point.angle,
            (None, None) => 0,
        }
    }

    fn moves_at(&self, time: Duration) -> Option<Duration> {
        let Some(Repeat { period, .. }) = self.repeat else {
            return self.moves_in_round(time);
        };
        let in_round = within(time, period);
        let round = Duration::from_nanos(time.as_nanos() - in_round.as_nanos());
        let moves = match self.moves_in_round(in_round) {
            Some(moves) => moves,
            None => self.moves_in_round(Duration::ZERO)? + period,
        };
        Some(round + moves)
    }

    /// The beginning of the first line, from `time` on, that is not level.
    fn moves_in_round(&self, time: Duration) -> Option<Duration> {
        let next = self.points.partition_point(|point| point.at <= time);
        let ahead = self.points.get(next.saturating_sub(1)..)?;
        let line = ahead.windows(2).find(|line| line[0].angle != line[1].angle)?;
        Some(line[0].at.max(time))
    }
}

fn within(time: Duration, period: Duration) -> Duration {
    Duration::from_nanos(time.as_nanos() % period.as_nanos())
}
