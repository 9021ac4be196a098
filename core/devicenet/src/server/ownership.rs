//! Time-outs and the end of connections: who owns the set, and when it is free again.

use codewheel_station::Instant;

use super::{Io, Restart, Server};
use crate::connection::{CHANGE_OF_STATE, Connection, EXPLICIT, POLL, State};
use crate::{Application, Event};

impl Server {
    pub(super) fn io(&self, instance: u8) -> Option<&Io> {
        match instance {
            POLL => self.poll.as_ref(),
            CHANGE_OF_STATE => self.production.as_ref().map(|production| &production.io),
            _ => None,
        }
    }

    pub(super) fn io_mut(&mut self, instance: u8) -> Option<&mut Io> {
        match instance {
            POLL => self.poll.as_mut(),
            CHANGE_OF_STATE => self.production.as_mut().map(|production| &mut production.io),
            _ => None,
        }
    }

    fn delete_io(&mut self, instance: u8) {
        match instance {
            POLL => self.poll = None,
            CHANGE_OF_STATE => self.production = None,
            _ => {}
        }
    }

    pub(super) fn io_timed_out<A: Application>(&mut self, now: Instant, instance: u8, app: &mut A) {
        let Some(io) = self.io_mut(instance) else { return };
        app.notice(now, Event::TimedOut { instance });
        match io.connection.watchdog_action {
            Connection::AUTO_RESET => io.connection.arm(now),
            Connection::AUTO_DELETE => self.delete_io(instance),
            _ => {
                io.connection.state = State::TimedOut;
                io.connection.disarm();
                io.owed = false;
                if instance == CHANGE_OF_STATE
                    && let Some(production) = &mut self.production
                {
                    production.stop();
                }
            }
        }
        self.settle_ownership(now, app);
    }

    pub(super) fn explicit_timed_out<A: Application>(&mut self, now: Instant, app: &mut A) {
        // A device that is about to restart has nothing to defer: an answer whose way to the wire
        // is never reported must not hold the restart up for ever.
        let lives_on = self.io_is(State::Established) && self.restart == Restart::No;
        let Some(connection) = &mut self.explicit else { return };
        app.notice(now, Event::TimedOut { instance: EXPLICIT });
        if connection.watchdog_action == Connection::DEFERRED_DELETE && lives_on {
            connection.state = State::DeferredDelete;
            connection.disarm();
        } else {
            self.end_explicit();
            self.settle_ownership(now, app);
        }
    }

    /// Whether an I/O connection is in `state`.
    pub(super) fn io_is(&self, state: State) -> bool {
        [POLL, CHANGE_OF_STATE]
            .into_iter()
            .any(|instance| self.io(instance).is_some_and(|io| io.connection.state == state))
    }

    /// Deletes the explicit connection and everything on its way over it.
    pub(super) fn end_explicit(&mut self) {
        if self.explicit.take().is_none() {
            return;
        }
        self.messages.end();
        if self.restart == Restart::Answering {
            // Nobody is left to read the answer; the reset itself was accepted.
            self.restart = Restart::Due;
        }
    }

    /// Forgets the master when it holds neither the explicit nor an established I/O connection, so
    /// that one that dies in mid-configuration never locks others out.
    pub(super) fn settle_ownership<A: Application>(&mut self, now: Instant, app: &mut A) {
        if self.master.is_none() || self.io_is(State::Established) {
            return;
        }
        let explicit_lives = self.explicit.as_ref().is_some_and(Connection::is_established);
        if !explicit_lives {
            self.forget_master();
            app.notice(now, Event::Forgotten);
        }
    }

    pub(super) fn forget_master(&mut self) {
        self.end_explicit();
        self.poll = None;
        self.production = None;
        self.master = None;
    }
}
