//! What follows from positions that come one after the other.

use std::collections::VecDeque;

use codewheel_commission::Sample;
use codewheel_station::{Duration, Instant};
use serde::Serialize;

use crate::commission::ring::shortest;

/// The speed is the mean of so long a time: long enough that a step more or less does not shake it.
const WINDOW: Duration = Duration::from_millis(250);
/// How many seconds the picture of the speed goes back.
const MINUTE: usize = 60;

/// How positions become turns; what a device does not tell is `None`.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::commission) struct Scale {
    pub(in crate::commission) steps_per_turn: Option<u32>,
    /// T, the number of positions.
    pub(in crate::commission) total_resolution: Option<u32>,
}

/// The motion of a shaft, as far as its positions tell.
#[derive(Debug)]
pub(super) struct Motion {
    scale: Scale,
    begun: Option<Instant>,
    last: Option<Sample>,
    /// The way since the first position, without the jumps at the end of the range.
    way: i64,
    /// When it was where, of the last [`WINDOW`] and one sample before.
    recent: VecDeque<(Instant, i64)>,
    /// The way at the last whole second, and its moment.
    second: Option<(Instant, i64)>,
    /// Steps a second in the last seconds, oldest first.
    minute: VecDeque<f64>,
    shortest: Option<u64>,
    longest: Option<u64>,
}

/// What is shown of a motion; angles and speeds are null where the device does not tell its steps per
/// turn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Readout {
    /// Seconds since the first position.
    pub(super) at: f64,
    /// In steps.
    pub(super) position: u32,
    /// Whole turns from position 0.
    pub(super) turn: Option<u32>,
    /// The rest of a turn.
    pub(super) degrees: Option<f64>,
    pub(super) steps_per_second: Option<f64>,
    pub(super) rpm: Option<f64>,
    pub(super) alarm: Option<bool>,
    pub(super) warning: Option<bool>,
    /// How long after the one before this position came: the cycle of the master, where it is known.
    pub(super) cycle_ms: Option<f64>,
    pub(super) cycle_min_ms: Option<f64>,
    pub(super) cycle_max_ms: Option<f64>,
}

impl Motion {
    pub(super) fn new(scale: Scale) -> Self {
        Self {
            scale,
            begun: None,
            last: None,
            way: 0,
            recent: VecDeque::new(),
            second: None,
            minute: VecDeque::new(),
            shortest: None,
            longest: None,
        }
    }

    /// Takes in the next position; what is to be shown of it.
    pub(super) fn take(&mut self, sample: Sample) -> Readout {
        let begun = *self.begun.get_or_insert(sample.at);
        let last = self.last.replace(sample);
        if let Some(last) = last {
            let way = i64::from(sample.position) - i64::from(last.position);
            self.way += shortest(way, self.scale.total_resolution.map_or(0, i64::from));
        }
        self.recent.push_back((sample.at, self.way));
        while self.recent.get(1).is_some_and(|(at, _)| sample.at.since(*at) >= WINDOW) {
            self.recent.pop_front();
        }
        self.close_second(sample.at);
        let cycle = sample.cycle.or_else(|| last.map(|last| sample.at.since(last.at).as_nanos()));
        if let Some(cycle) = cycle {
            self.shortest = Some(self.shortest.map_or(cycle, |least| least.min(cycle)));
            self.longest = Some(self.longest.map_or(cycle, |most| most.max(cycle)));
        }
        let steps = self.scale.steps_per_turn.filter(|steps| *steps > 0);
        let speed = self.speed();
        let milliseconds = |nanos: u64| round(nanos as f64 / 1e6, 1e3);
        Readout {
            at: round(seconds(sample.at.since(begun)), 1e3),
            position: sample.position,
            turn: steps.map(|steps| sample.position / steps),
            degrees: steps.map(|steps| {
                round(f64::from(sample.position % steps) * 360.0 / f64::from(steps), 1e3)
            }),
            steps_per_second: speed.map(|speed| round(speed, 1e1)),
            rpm: speed.zip(steps).map(|(speed, steps)| round(speed * 60.0 / f64::from(steps), 1e2)),
            alarm: sample.alarm,
            warning: sample.warning,
            cycle_ms: cycle.map(milliseconds),
            cycle_min_ms: self.shortest.map(milliseconds),
            cycle_max_ms: self.longest.map(milliseconds),
        }
    }

    /// The speed in the seconds of the last minute, oldest first, in steps a second.
    pub(super) fn minute(&self) -> impl ExactSizeIterator<Item = f64> + Clone {
        self.minute.iter().copied()
    }

    fn speed(&self) -> Option<f64> {
        let ((begun, from), (ended, to)) = self.recent.front().zip(self.recent.back())?;
        let time = seconds(ended.since(*begun));
        (time > 0.0).then(|| (to - from) as f64 / time)
    }

    fn close_second(&mut self, now: Instant) {
        let (begun, from) = *self.second.get_or_insert((now, self.way));
        let time = seconds(now.since(begun));
        if time < 1.0 {
            return;
        }
        // Seconds in which nothing came had the mean speed too.
        for _ in 0..(time as usize).min(MINUTE) {
            self.minute.push_back((self.way - from) as f64 / time);
        }
        while self.minute.len() > MINUTE {
            self.minute.pop_front();
        }
        self.second = Some((now, self.way));
    }
}

fn seconds(time: Duration) -> f64 {
    time.as_nanos() as f64 / 1e9
}

/// As many digits as mean something.
fn round(number: f64, parts: f64) -> f64 {
    // Without the sum, what is rounded from below zero would be shown as -0.
    (number * parts).round() / parts + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: Scale = Scale { steps_per_turn: Some(3_600), total_resolution: Some(36_000) };

    fn sample(milliseconds: u64, position: u32) -> Sample {
        let at = Instant::ZERO + Duration::from_millis(milliseconds);
        Sample { at, position, alarm: None, warning: None, cycle: None }
    }

    #[test]
    fn a_turning_shaft_has_its_speed_also_across_the_end_of_the_range() {
        let mut motion = Motion::new(SCALE);
        // 60 rpm are 3600 steps a second, 36 in 10 ms; it wraps at once.
        let mut readout = motion.take(sample(0, 35_990));
        assert_eq!((readout.rpm, readout.turn), (None, Some(9)));
        for step in 1..=100_u32 {
            let position = (35_990 + 36 * step) % 36_000;
            readout = motion.take(sample(u64::from(step) * 10, position));
        }
        assert_eq!((readout.rpm, readout.steps_per_second), (Some(60.0), Some(3_600.0)));
        assert_eq!(readout.cycle_ms, Some(10.0));
        assert_eq!((readout.turn, readout.degrees), (Some(0), Some(359.0)));
        // Backwards.
        for step in 1..=100_u32 {
            let position = (3_590 + 36_000 - 36 * step) % 36_000;
            readout = motion.take(sample(1_000 + u64::from(step) * 10, position));
        }
        assert_eq!(readout.rpm, Some(-60.0));
        assert_eq!(motion.minute().collect::<Vec<_>>(), [3_600.0, -3_600.0]);
    }

    #[test]
    fn a_shaft_that_stands_has_no_speed_and_no_minus() {
        let mut motion = Motion::new(SCALE);
        motion.take(sample(0, 7));
        let readout = motion.take(sample(100, 7));
        assert_eq!(readout.rpm.map(|rpm| rpm.to_string()), Some("0".to_owned()));
    }

    #[test]
    fn the_minute_keeps_sixty_seconds_and_the_cycle_its_extremes() {
        let mut motion = Motion::new(SCALE);
        for second in 0..100 {
            motion.take(sample(second * 1_000, 0));
        }
        let readout = motion.take(sample(99_300, 0));
        assert_eq!(motion.minute().len(), MINUTE);
        assert_eq!(
            (readout.cycle_min_ms, readout.cycle_ms, readout.cycle_max_ms),
            (Some(300.0), Some(300.0), Some(1_000.0))
        );
    }

    #[test]
    fn without_steps_per_turn_there_is_a_position_and_a_speed_in_steps() {
        let mut motion = Motion::new(Scale::default());
        motion.take(sample(0, 0));
        let readout = motion.take(sample(500, u32::MAX));
        assert_eq!((readout.turn, readout.degrees, readout.rpm), (None, None, None));
        assert_eq!(readout.steps_per_second, Some(f64::from(u32::MAX) * 2.0));
    }
}
