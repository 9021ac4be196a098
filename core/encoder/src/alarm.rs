//! The position error: a code that moved further than any shaft turns, or that could not be read.

use codewheel_station::{Deadline, Duration, Instant};

/// How long an alarm stays after its last event: 2.5 s (DeviceNet manual §8, "Alarm signals").
pub const ALARM_TIME: Duration = Duration::from_millis(2_500);

/// Two samples this far apart or further are not judged: in the meantime a shaft may honestly be
/// anywhere. Decision: 2.5 ms.
pub const JUDGED_WITHIN: Duration = Duration::from_micros(2_500);

/// The speed limit of a new device in revolutions per minute. Decision: 12 000; the manuals name no
/// limit.
pub const DEFAULT_SPEED_LIMIT: u32 = 12_000;

/// What two samples may always differ by, in raw steps. Decision: 8, so that a jitter of the last
/// bits is no alarm however close two samples are.
const ALWAYS_ALLOWED: u32 = 8;

const MINUTE: Duration = Duration::from_secs(60);

/// The state of the position error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PositionError {
    /// The speed limit in raw steps per minute.
    limit: u64,
    /// When the alarm ends, while there is one.
    until: Deadline,
}

impl PositionError {
    /// No alarm; the limit is `rpm` on a disc of `singleturn_resolution` steps.
    pub(crate) fn new(rpm: u32, singleturn_resolution: u32) -> Self {
        let mut error = Self { limit: 0, until: Deadline::NEVER };
        error.set_limit(rpm, singleturn_resolution);
        error
    }

    pub(crate) fn set_limit(&mut self, rpm: u32, singleturn_resolution: u32) {
        self.limit = u64::from(rpm) * u64::from(singleturn_resolution);
    }

    /// Judges a move of `moved` raw steps, at most 2²⁸, within `elapsed` before `now`.
    pub(crate) fn judge(&mut self, now: Instant, elapsed: Duration, moved: u32) {
        if moved <= ALWAYS_ALLOWED || elapsed >= JUDGED_WITHIN {
            return;
        }
        // moved > ⌊limit·elapsed / 1 min⌋ without the division; the left side stays below 2⁶⁴.
        let took = u64::from(moved).saturating_mul(MINUTE.as_nanos());
        if took > self.limit.saturating_mul(elapsed.as_nanos()) {
            self.raise(now);
        }
    }

    /// Begins the alarm, or begins its time anew.
    pub(crate) fn raise(&mut self, now: Instant) {
        // Decision: "extended by 2.5 s" means that every event starts the time anew.
        self.until = Deadline::at(now + ALARM_TIME);
    }

    /// Ends the alarm once its time is over.
    pub(crate) fn advance(&mut self, now: Instant) {
        self.until.take_due(now);
    }

    pub(crate) const fn is_on(&self) -> bool {
        !self.until.is_never()
    }

    pub(crate) const fn deadline(&self) -> Option<Instant> {
        self.until.instant()
    }
}
