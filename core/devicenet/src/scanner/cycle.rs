//! The poll cycle: whose turn it is, who owes an answer, and when the next cycle begins.

use codewheel_station::{Deadline, Duration, Instant};

use super::view::CycleTimes;

/// How long the scanner waits for outstanding poll responses without getting any further before it
/// goes on without them.
const RESPONSE_TIME: Duration = Duration::from_millis(50);
/// How long a poll that was handed out may wait for the medium, where nobody reports it as sent.
const HANDED_TIME: Duration = Duration::from_secs(1);
/// The longest wait for responses: slaves that stammer must not keep the others from their polls.
const COLLECTING_TIME: Duration = Duration::from_secs(1);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Nothing is polled until then.
    Pause { until: Instant },
    /// Polls are being sent; `next` is the first place not yet looked at.
    Polling { began: Option<Instant>, next: u32 },
    /// All polls are out; responses are waited for.
    Collecting { began: Instant, until: Instant, latest: Instant },
}

/// A poll to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    /// The slave's place.
    pub(super) place: usize,
    /// Its last poll has not been answered.
    pub(super) missed: bool,
}

/// The slaves are bits here, by their places: the next one, and whether all have answered, are
/// single instructions.
#[derive(Clone, Debug)]
pub(super) struct Cycle<const SLAVES: usize> {
    phase: Phase,
    /// Who is polled.
    polled: u64,
    /// Who was polled and has not answered.
    awaited: u64,
    /// Whose answer this cycle waits for.
    outstanding: u64,
    /// Whose poll was handed out and not yet reported as sent.
    handed: u64,
    /// When the last poll was handed out, then when it was sent.
    polled_at: [Instant; SLAVES],
    interval: Duration,
    pub(super) interscan_delay: Duration,
    pub(super) times: CycleTimes,
}

impl<const SLAVES: usize> Cycle<SLAVES> {
    pub(super) fn new(interval: Duration) -> Self {
        Self {
            phase: Phase::Pause { until: Instant::ZERO },
            polled: 0,
            awaited: 0,
            outstanding: 0,
            handed: 0,
            polled_at: [Instant::ZERO; SLAVES],
            interval,
            interscan_delay: Duration::ZERO,
            times: CycleTimes::default(),
        }
    }

    /// Nobody is polled any more, and nobody owes an answer.
    pub(super) const fn reset(&mut self) {
        self.phase = Phase::Pause { until: Instant::ZERO };
        self.polled = 0;
        self.awaited = 0;
        self.outstanding = 0;
        self.handed = 0;
    }

    /// Whether the slave at `place` shall be polled.
    pub(super) const fn set_polled(&mut self, place: usize, polled: bool) {
        let bit = 1 << place;
        if polled {
            self.polled |= bit;
        } else {
            self.polled &= !bit;
            self.awaited &= !bit;
            self.outstanding &= !bit;
            self.handed &= !bit;
        }
    }

    /// Begins or ends what is due.
    #[inline]
    pub(super) fn advance(&mut self, now: Instant) {
        if let Phase::Collecting { began, until, .. } = self.phase
            && (now >= until || self.outstanding == 0)
        {
            self.close(now, Some(began));
        }
        if let Phase::Pause { until } = self.phase
            && now >= until
            && self.polled != 0
        {
            self.phase = Phase::Polling { began: None, next: 0 };
        }
    }

    fn close(&mut self, now: Instant, began: Option<Instant>) {
        self.outstanding = 0;
        let until = match began {
            Some(began) => {
                self.times.count += 1;
                self.times.last = now.since(began);
                self.times.longest = self.times.longest.max(self.times.last);
                (began + self.interval).max(now + self.interscan_delay)
            }
            // Nobody could be polled: all owe an answer to polls that the medium still holds.
            None => now + self.interval.max(RESPONSE_TIME),
        };
        self.phase = Phase::Pause { until };
    }

    /// The next slave to be polled. A slave that still may answer the last poll is passed over.
    /// Tell [`polled`](Self::polled) when the poll is handed out.
    #[inline]
    pub(super) fn next(&mut self, now: Instant) -> Option<Turn> {
        self.advance(now);
        while let Phase::Polling { began, next } = self.phase {
            let left = self.polled & u64::MAX.checked_shl(next).unwrap_or(0);
            if left == 0 {
                match began {
                    Some(began) if self.outstanding != 0 => {
                        let until = now + RESPONSE_TIME;
                        let latest = now + COLLECTING_TIME;
                        self.phase = Phase::Collecting { began, until, latest };
                    }
                    began => {
                        self.close(now, began);
                        self.advance(now);
                    }
                }
                continue;
            }
            let place = left.trailing_zeros();
            self.phase = Phase::Polling { began, next: place + 1 };
            let place = place as usize;
            let missed = self.awaited & 1 << place != 0;
            if missed && now < self.answer_due(place) {
                continue;
            }
            return Some(Turn { place, missed });
        }
        None
    }

    fn answer_due(&self, place: usize) -> Instant {
        let time = if self.handed & 1 << place != 0 { HANDED_TIME } else { RESPONSE_TIME };
        self.polled_at.get(place).map_or(Instant::ZERO, |at| *at + time)
    }

    /// The poll of the slave at `place` was handed out.
    #[inline]
    pub(super) fn polled(&mut self, now: Instant, place: usize) {
        let bit = 1 << place;
        self.awaited |= bit;
        self.outstanding |= bit;
        self.handed |= bit;
        if let Some(at) = self.polled_at.get_mut(place) {
            *at = now;
        }
        if let Phase::Polling { began, .. } = &mut self.phase {
            began.get_or_insert(now);
        }
    }

    /// The poll of the slave at `place` is on the wire.
    #[inline]
    pub(super) fn sent(&mut self, now: Instant, place: usize) {
        let bit = 1 << place;
        if self.awaited & bit == 0 {
            return;
        }
        self.handed &= !bit;
        if let Some(at) = self.polled_at.get_mut(place) {
            *at = now;
        }
        self.progress(now);
    }

    /// A fragment of an answer arrived.
    pub(super) fn part_of_answer(&mut self, now: Instant, place: usize) {
        if self.outstanding & 1 << place != 0 {
            self.progress(now);
        }
    }

    /// The slave at `place` has answered.
    #[inline]
    pub(super) fn answered(&mut self, now: Instant, place: usize) {
        let bit = 1 << place;
        if self.outstanding & bit != 0 {
            self.progress(now);
        }
        self.awaited &= !bit;
        self.outstanding &= !bit;
        self.handed &= !bit;
    }

    #[inline]
    fn progress(&mut self, now: Instant) {
        if let Phase::Collecting { until, latest, .. } = &mut self.phase {
            *until = (now + RESPONSE_TIME).min(*latest);
        }
    }

    #[inline]
    pub(super) const fn deadline(&self) -> Deadline {
        match self.phase {
            Phase::Pause { until } if self.polled != 0 => Deadline::at(until),
            Phase::Collecting { until, .. } => Deadline::at(until),
            Phase::Pause { .. } | Phase::Polling { .. } => Deadline::NEVER,
        }
    }
}
