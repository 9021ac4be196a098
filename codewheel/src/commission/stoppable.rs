//! A seat that Ctrl-C ends.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use codewheel_commission::Seat;
use codewheel_link::{LinkError, Notice};
use codewheel_station::Instant;

/// How long what was begun may be ended in an orderly way after an end was wanted: a slave is
/// released, a token handed on.
const GRACE: Duration = Duration::from_secs(3);

/// Whether a person wants an end, or the time to get on the bus is over.
#[derive(Clone, Debug)]
pub(super) struct Stop {
    /// Set by Ctrl-C, until it is heeded.
    asked: Arc<AtomicBool>,
    state: Arc<State>,
    deadline: Option<std::time::Instant>,
}

#[derive(Debug, Default)]
struct State {
    /// A person asked for it.
    was_asked: AtomicBool,
    /// The time limit was met.
    is_over: AtomicBool,
    /// What was to be opened is open, and the time limit counts no more.
    is_open: AtomicBool,
}

impl Stop {
    /// `asked` is set by Ctrl-C, `limit` is how long opening may take.
    pub(super) fn new(asked: Arc<AtomicBool>, limit: Option<Duration>) -> Self {
        let deadline = limit.and_then(|limit| std::time::Instant::now().checked_add(limit));
        Self { asked, state: Arc::default(), deadline }
    }

    /// Whether what is under way must end.
    pub(super) fn is_wanted(&self) -> bool {
        self.was_asked() || self.is_over()
    }

    /// Whether a person asked for it.
    pub(super) fn was_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed) || self.state.was_asked.load(Ordering::Relaxed)
    }

    /// What was to be opened is open: from now on each request has its own limit.
    pub(super) fn lift_limit(&self) {
        self.state.is_open.store(true, Ordering::Relaxed);
    }

    /// Whether a person asked for it. From now on it is not wanted, so that what was begun can be
    /// ended in an orderly way; a second Ctrl-C wants it anew.
    pub(super) fn take(&self) -> bool {
        self.lift_limit();
        self.asked.swap(false, Ordering::Relaxed)
            | self.state.was_asked.swap(false, Ordering::Relaxed)
    }

    /// Whether an end was wanted since it was heeded last.
    fn heed(&self) -> bool {
        if self.asked.swap(false, Ordering::Relaxed) {
            self.state.was_asked.store(true, Ordering::Relaxed);
            return true;
        }
        self.left().is_some_and(|left| left.is_zero())
            && !self.state.is_over.swap(true, Ordering::Relaxed)
    }

    fn is_over(&self) -> bool {
        self.state.is_over.load(Ordering::Relaxed) || self.left().is_some_and(|left| left.is_zero())
    }

    /// The time that is left, where there is a limit.
    fn left(&self) -> Option<Duration> {
        let deadline = self.deadline.filter(|_| !self.state.is_open.load(Ordering::Relaxed))?;
        Some(deadline.saturating_duration_since(std::time::Instant::now()))
    }
}

/// A seat on which a turn fails when an end is wanted, so that whatever waits on it ends at once. The
/// turns after it pass for a while, in which what was begun can be ended: a slave that is left
/// allocated keeps its own master out.
#[derive(Debug)]
pub(super) struct Stoppable<S> {
    seat: S,
    stop: Stop,
    /// Until when turns pass although an end is wanted.
    grace: Option<std::time::Instant>,
}

impl<S> Stoppable<S> {
    pub(super) const fn new(seat: S, stop: Stop) -> Self {
        Self { seat, stop, grace: None }
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
        let now = std::time::Instant::now();
        if self.stop.heed() {
            self.grace = now.checked_add(GRACE);
            return Err(interrupted());
        }
        let left = if self.stop.is_wanted() {
            let grace = self.grace.map(|grace| grace.saturating_duration_since(now));
            Some(grace.filter(|grace| !grace.is_zero()).ok_or_else(interrupted)?)
        } else {
            self.stop.left()
        };
        let until = left.map_or(until, |left| until.min(self.seat.now() + left.into()));
        self.seat.turn(until)
    }
}

fn interrupted() -> LinkError {
    LinkError::System(io::ErrorKind::Interrupted.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A seat on which a millisecond passes in each turn.
    struct Ticking(Instant);

    impl Seat for Ticking {
        type Station = ();

        fn now(&self) -> Instant {
            self.0
        }

        fn station(&mut self) -> &mut () {
            Box::leak(Box::new(()))
        }

        fn turn(&mut self, until: Instant) -> Result<Vec<Notice>, LinkError> {
            self.0 = until.min(self.0 + codewheel_station::Duration::from_millis(1));
            Ok(Vec::new())
        }
    }

    fn seat(limit: Option<Duration>) -> (Stoppable<Ticking>, Stop, Arc<AtomicBool>) {
        let asked = Arc::new(AtomicBool::new(false));
        let stop = Stop::new(Arc::clone(&asked), limit);
        (Stoppable::new(Ticking(Instant::ZERO), stop.clone()), stop, asked)
    }

    const FAR: codewheel_station::Duration = codewheel_station::Duration::from_secs(3_600);

    #[test]
    fn ctrl_c_fails_one_turn_and_leaves_time_to_end_what_was_begun() {
        let (mut seat, stop, asked) = seat(None);
        assert!(seat.turn(seat.now() + FAR).is_ok() && !stop.is_wanted());
        for _ in 0..2 {
            asked.store(true, Ordering::Relaxed);
            assert!(seat.turn(seat.now() + FAR).is_err());
            assert!(seat.turn(seat.now() + FAR).is_ok(), "to release the slave");
            assert!(stop.is_wanted() && stop.was_asked());
        }
        seat.grace = Some(std::time::Instant::now());
        assert!(seat.turn(seat.now() + FAR).is_err(), "that ends too");
        assert!(stop.take() && !stop.is_wanted());
        assert!(seat.turn(seat.now() + FAR).is_ok());
    }

    #[test]
    fn a_time_that_is_over_fails_one_turn_unless_all_is_open_by_then() {
        let (mut seat, stop, _) = seat(Some(Duration::ZERO));
        assert!(seat.turn(seat.now() + FAR).is_err());
        assert!(seat.turn(seat.now() + FAR).is_ok(), "to release the slave");
        assert!(stop.is_wanted() && !stop.was_asked());
        let (mut open, stop, _) = self::seat(Some(Duration::ZERO));
        stop.lift_limit();
        assert!(open.turn(open.now() + FAR).is_ok() && !stop.is_wanted());
    }
}
