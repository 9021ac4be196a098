//! A seat that Ctrl-C ends.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use codewheel_commission::Seat;
use codewheel_link::{LinkError, Notice};
use codewheel_station::Instant;

/// Whether a person wants an end, or the time to get on the bus is over.
#[derive(Clone, Debug)]
pub(super) struct Stop {
    asked: Arc<AtomicBool>,
    /// Until the encoder is served there is a time limit.
    is_limited: Arc<AtomicBool>,
    /// Why what was being opened is given up, while what was begun is undone.
    was_asked: Arc<AtomicBool>,
    was_late: Arc<AtomicBool>,
    deadline: Option<std::time::Instant>,
}

impl Stop {
    /// `asked` is set by Ctrl-C, `limit` is how long opening may take.
    pub(super) fn new(asked: Arc<AtomicBool>, limit: Option<Duration>) -> Self {
        let deadline = limit.and_then(|limit| std::time::Instant::now().checked_add(limit));
        let (was_asked, was_late) = <(Arc<AtomicBool>, Arc<AtomicBool>)>::default();
        Self { asked, is_limited: Arc::new(AtomicBool::new(true)), was_asked, was_late, deadline }
    }

    /// Whether what is under way must end.
    pub(super) fn is_wanted(&self) -> bool {
        self.asked.load(Ordering::Relaxed) || self.is_late()
    }

    /// Whether a person asked for it.
    pub(super) fn was_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed) || self.was_asked.load(Ordering::Relaxed)
    }

    /// Whether the time to get on the bus was over.
    pub(super) fn was_late(&self) -> bool {
        self.is_late() || self.was_late.load(Ordering::Relaxed)
    }

    /// Lets what was begun be undone in an orderly way; a second Ctrl-C wants an end anew.
    fn wind_up(&self) {
        if self.is_late() {
            self.was_late.store(true, Ordering::Relaxed);
        }
        if self.take() {
            self.was_asked.store(true, Ordering::Relaxed);
        }
    }

    fn is_late(&self) -> bool {
        self.left().is_some_and(|left| left.is_zero())
    }

    /// What was to be opened is open: from now on each request has its own limit.
    pub(super) fn lift_limit(&self) {
        self.is_limited.store(false, Ordering::Relaxed);
    }

    /// Whether a person asked for it. From now on it is not wanted, so that what was begun can be
    /// ended in an orderly way; a second Ctrl-C wants it anew.
    pub(super) fn take(&self) -> bool {
        self.lift_limit();
        self.asked.swap(false, Ordering::Relaxed)
    }

    /// The time that is left, where there is a limit.
    fn left(&self) -> Option<Duration> {
        let deadline = self.deadline.filter(|_| self.is_limited.load(Ordering::Relaxed))?;
        Some(deadline.saturating_duration_since(std::time::Instant::now()))
    }
}

/// A seat whose turns fail as long as an end is wanted, so that whatever waits on it ends at once.
#[derive(Debug)]
pub(super) struct Stoppable<S> {
    seat: S,
    stop: Stop,
}

impl<S> Stoppable<S> {
    pub(super) const fn new(seat: S, stop: Stop) -> Self {
        Self { seat, stop }
    }
}

impl<S: Seat> Seat for Stoppable<S> {
    type Station = S::Station;

    fn now(&self) -> Instant {
        self.seat.now()
    }

    fn station(&mut self) -> &mut S::Station {
        self.seat.station()
    }

    fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
        if self.stop.is_wanted() {
            return Err(LinkError::System(io::ErrorKind::Interrupted.into()));
        }
        let until = match self.stop.left() {
            Some(left) => until.min(self.seat.now() + left.into()),
            None => until,
        };
        self.seat.turn(until)
    }

    fn wind_up(&mut self) {
        self.stop.wind_up();
    }
}
