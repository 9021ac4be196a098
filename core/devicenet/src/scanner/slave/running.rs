//! Explicit messages while a slave exchanges data: those of the user, and those that keep the
//! explicit connection.

use codewheel_station::{Deadline, Duration, Instant};

use super::{Asked, KEEP_ALIVE_TIME, Phase, Slave, Then, Whose};
use crate::explicit::BodyFormat;
use crate::scanner::exchange::{Answer, Ended, Port, UNCONNECTED_TIME};
use crate::scanner::io::Input;
use crate::scanner::settings::{NotTaken, PollSettings};
use crate::scanner::steps::{Step, allocate, defer_delete, keep_alive};
use crate::scanner::view::{Response, Ticket};
use crate::server::choice;

impl Slave {
    fn ask_while_running(&mut self, whose: Whose) {
        self.whose = whose;
        match whose {
            Whose::User => self.exchange.begin(&mut self.user),
            // One that was switched on anew has no connection over which it could be slow.
            Whose::KeepAlive if self.suspected => {
                self.ask_within(Port::Connected, keep_alive(), UNCONNECTED_TIME);
            }
            Whose::KeepAlive => self.ask(Port::Connected, keep_alive()),
            Whose::Reallocate => {
                self.ask(Port::Unconnected, allocate(choice::EXPLICIT, self.master));
            }
            Whose::DeferDelete => self.ask(Port::Connected, defer_delete()),
        }
    }

    /// Whether nothing but requests of ours keeps the explicit connection, or would notice that
    /// the slave is gone.
    fn needs_requests(&self) -> bool {
        let has_io = self.settings.poll.is_some() || self.settings.change.is_some();
        let is_watched = self.settings.poll.is_some() || self.change_rate != 0;
        !has_io || !self.defers_delete || !is_watched
    }

    pub(super) fn arm_keep_alive(&mut self, now: Instant) {
        self.keep_alive_at = if self.needs_requests() {
            Deadline::at(now + KEEP_ALIVE_TIME)
        } else {
            Deadline::NEVER
        };
    }

    /// Sees what ended while running, and asks what is to be asked next.
    pub(super) fn run(&mut self, now: Instant) {
        if self.poll_lost_at.is_due(now) || self.change_lost_at.is_due(now) {
            return self.lost();
        }
        if let Some(ended) = self.exchange.ended() {
            self.exchange.stop();
            self.arm_keep_alive(now);
            match self.whose {
                Whose::User => self.user_ended(ended),
                whose => self.own_ended(whose, ended),
            }
        }
        if !self.is_running() || !self.exchange.is_idle() {
            return;
        }
        if let Asked::Waiting { repeated } = self.asked {
            self.asked = Asked::UnderWay { repeated };
            self.ask_while_running(Whose::User);
        } else if self.keep_alive_at.is_due(now) {
            self.ask_while_running(Whose::KeepAlive);
        }
    }

    fn user_ended(&mut self, ended: Ended) {
        self.repeats = 0;
        if ended == Ended::Silent && self.asked == (Asked::UnderWay { repeated: false }) {
            // Either the request got lost, or the slave has no explicit connection any more.
            // Allocating it tells: only in the second case it succeeds, and then the slave has
            // not seen the request, so that it may be repeated.
            self.asked = Asked::Waiting { repeated: true };
            self.ask_while_running(Whose::Reallocate);
        } else {
            self.asked = Asked::Ended(ended);
        }
    }

    fn own_ended(&mut self, whose: Whose, ended: Ended) {
        let answer = (ended == Ended::Answered).then(|| self.own.answer());
        let allocated = matches!(answer, Some(Answer::Done(_)));
        if let (Whose::Reallocate, Some(Answer::Done([format, ..]))) = (whose, answer) {
            self.format = BodyFormat::from_octet(*format).unwrap_or(self.format);
        }
        let polled = self.settings.poll.is_some();
        if answer.is_none() && self.repeats == 0 && whose != Whose::User {
            self.repeats = 1;
            return self.ask_while_running(whose);
        }
        self.repeats = 0;
        match whose {
            Whose::User => {}
            Whose::KeepAlive if answer.is_some() => self.suspected = false,
            // Whether a slave is there is for the polls to say, where there are some.
            Whose::KeepAlive if polled => self.ask_while_running(Whose::Reallocate),
            Whose::KeepAlive => self.lost(),
            Whose::Reallocate => {
                let forgotten = allocated && !polled && self.settings.change.is_some();
                if forgotten && self.change_rate == 0 {
                    // Nothing else would tell that its productions have ended.
                    self.lost();
                } else if allocated && self.defers_delete {
                    self.ask_while_running(Whose::DeferDelete);
                } else if !allocated && self.asked == (Asked::Waiting { repeated: true }) {
                    self.asked = Asked::Ended(Ended::Silent);
                }
            }
            Whose::DeferDelete => self.defers_delete = allocated,
        }
    }

    /// Allocates a poll connection besides what there is.
    pub(in super::super) fn begin_polling(&mut self, poll: PollSettings) -> Result<(), NotTaken> {
        self.expect_unasked()?;
        self.settings.poll = Some(poll);
        self.poll = Input::new();
        self.settle();
        self.enter(Step::AllocatePoll);
        Ok(())
    }

    /// Releases the poll connection, and keeps what else there is.
    pub(in super::super) fn end_polling(&mut self) -> Result<(), NotTaken> {
        self.expect_unasked()?;
        self.settle();
        self.release_from(0, Then::Resume);
        Ok(())
    }

    const fn expect_unasked(&self) -> Result<(), NotTaken> {
        if self.ticket.is_some() {
            return Err(NotTaken::Busy);
        }
        if !matches!(self.phase, Phase::Running) {
            return Err(NotTaken::NotRunning);
        }
        Ok(())
    }

    /// Takes in a request of the user.
    pub(in super::super) fn request(
        &mut self,
        ticket: Ticket,
        body: &[u8],
        patience: Duration,
    ) -> Result<(), NotTaken> {
        self.expect_unasked()?;
        self.ticket = Some(ticket);
        self.user.ask(Port::Connected, self.format, body, patience);
        if self.exchange.is_idle() {
            self.asked = Asked::UnderWay { repeated: false };
            self.ask_while_running(Whose::User);
        } else {
            self.asked = Asked::Waiting { repeated: false };
        }
        Ok(())
    }

    pub(in super::super) fn holds(&self, ticket: Ticket) -> bool {
        self.ticket == Some(ticket)
    }

    /// What came back for the request of the user, once something has.
    pub(in super::super) fn outcome(&self) -> Option<Response<'_>> {
        let Asked::Ended(ended) = self.asked else { return None };
        Some(match (ended, self.user.answer()) {
            (Ended::Answered, Answer::Done(data)) => Response::Done(data),
            (Ended::Answered, Answer::Refused(error)) => Response::Refused(error),
            (Ended::TooLong, _) => Response::TooLong,
            (Ended::Silent, _) => Response::NoAnswer,
        })
    }

    /// Forgets the request of the user, whatever has become of it.
    pub(in super::super) fn cancel(&mut self) {
        if matches!(self.asked, Asked::UnderWay { .. }) {
            self.exchange.stop();
        }
        self.asked = Asked::Nothing;
        self.ticket = None;
    }
}
