//! The watchdog: it watches the master, not the slave.

use codewheel_station::{Deadline, Duration, Instant};

/// Off, or running towards its end.
#[derive(Clone, Debug)]
pub(crate) struct Watchdog {
    period: Duration,
    expires: Deadline,
}

impl Watchdog {
    pub(crate) const OFF: Self = Self { period: Duration::ZERO, expires: Deadline::NEVER };

    /// Starts at `now`, or is off.
    pub(crate) fn start(now: Instant, period: Option<Duration>) -> Self {
        match period {
            Some(period) => Self { period, expires: Deadline::at(now + period) },
            None => Self::OFF,
        }
    }

    /// The master was heard.
    #[inline]
    pub(crate) fn retrigger(&mut self, now: Instant) {
        if !self.expires.is_never() {
            self.expires = Deadline::at(now + self.period);
        }
    }

    #[inline]
    pub(crate) const fn has_expired(&self, now: Instant) -> bool {
        self.expires.is_due(now)
    }

    pub(crate) const fn expires(&self) -> Deadline {
        self.expires
    }

    pub(crate) const fn is_on(&self) -> bool {
        !self.expires.is_never()
    }

    /// T_WD, while it is on.
    pub(crate) const fn period(&self) -> Option<Duration> {
        if self.is_on() { Some(self.period) } else { None }
    }
}
