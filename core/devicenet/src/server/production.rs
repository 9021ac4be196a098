//! Change of state and cyclic production: connection instance 4 (DeviceNet description, clause 6).

use codewheel_station::{Deadline, Duration, Instant};

use super::Io;
use crate::ProducedPath;
use crate::connection::Connection;

/// What makes the connection produce.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trigger {
    /// A change of the data, and the expected packet rate.
    ChangeOfState,
    /// The expected packet rate alone.
    Cyclic,
}

/// The Acknowledge Handler object's attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct AcknowledgeHandler {
    /// Attribute 1: how long an acknowledge is waited for, in ms.
    pub(super) timer: u16,
    /// Attribute 2: how often a production is repeated.
    pub(super) retry_limit: u8,
}

impl AcknowledgeHandler {
    pub(super) const DEFAULT: Self = Self { timer: 16, retry_limit: 1 };
}

/// The connection with what makes it produce, and what holds it back.
#[derive(Clone, Debug)]
pub(super) struct Production {
    pub(super) io: Io,
    pub(super) trigger: Trigger,
    /// Whether the master acknowledges each production.
    pub(super) acknowledged: bool,
    /// Something is to be produced as soon as nothing holds it back.
    wanted: bool,
    /// A production is out and its acknowledge has not come.
    waiting: bool,
    /// How often the production that is out has been repeated.
    repeats: u8,
    /// When the expected packet rate elapses.
    due_at: Deadline,
    /// Until when the production inhibit time holds productions back.
    inhibited_until: Deadline,
    /// When the production that is out is repeated.
    acknowledge_by: Deadline,
}

impl Production {
    /// A fresh connection, configuring.
    pub(super) const fn new(trigger: Trigger, acknowledged: bool, path: ProducedPath) -> Self {
        let mut connection = Connection::io();
        // Without acknowledges nothing arrives, so nothing can be missed.
        connection.consumes = acknowledged;
        Self {
            io: Io { connection, path, owed: false },
            trigger,
            acknowledged,
            wanted: false,
            waiting: false,
            repeats: 0,
            due_at: Deadline::NEVER,
            inhibited_until: Deadline::NEVER,
            acknowledge_by: Deadline::NEVER,
        }
    }

    fn rate(&self) -> Option<Duration> {
        match self.io.connection.expected_packet_rate {
            0 => None,
            rate => Some(Duration::from_millis(u64::from(rate))),
        }
    }

    /// The connection was established just now, or revived: it produces at once.
    pub(super) fn begin(&mut self, now: Instant) {
        self.stop();
        self.wanted = true;
        self.restart_rate(now);
    }

    /// The connection no longer produces.
    pub(super) const fn stop(&mut self) {
        self.io.owed = false;
        self.wanted = false;
        self.waiting = false;
        self.repeats = 0;
        self.due_at = Deadline::NEVER;
        self.inhibited_until = Deadline::NEVER;
        self.acknowledge_by = Deadline::NEVER;
    }

    /// The expected packet rate begins anew.
    pub(super) fn restart_rate(&mut self, now: Instant) {
        self.due_at = match self.rate() {
            Some(rate) => Deadline::at(now + rate),
            None => Deadline::NEVER,
        };
    }

    /// The data have changed: a change of state connection wants to produce.
    pub(super) const fn changed(&mut self) {
        self.wanted = true;
    }

    /// Whether a change of the data would make a difference.
    pub(super) fn watches(&self) -> bool {
        self.trigger == Trigger::ChangeOfState
            && !self.wanted
            && self.io.connection.is_established()
    }

    /// Decides whether a production is owed to the wire now.
    pub(super) fn advance(&mut self, now: Instant, handler: AcknowledgeHandler) {
        if !self.io.connection.is_established() {
            return;
        }
        if self.acknowledge_by.take_due(now) {
            if self.repeats < handler.retry_limit {
                // With the newest data, and whatever the inhibit time says.
                self.repeats += 1;
                self.io.owed = true;
            } else {
                self.waiting = false;
                self.repeats = 0;
            }
        }
        if self.due_at.is_due(now) {
            self.wanted = true;
            self.schedule_next(now);
        }
        let inhibited = !self.inhibited_until.is_never() && !self.inhibited_until.is_due(now);
        if self.wanted && !self.waiting && !inhibited {
            self.io.owed = true;
        }
    }

    /// A cycle keeps its beat however late a production was; a change of state connection counts
    /// from its production.
    fn schedule_next(&mut self, now: Instant) {
        let (Some(rate), Some(due)) = (self.rate(), self.due_at.instant()) else {
            self.due_at = Deadline::NEVER;
            return;
        };
        // However many beats were missed, the next one comes when it would have come.
        let beats = now.since(due).as_nanos() / rate.as_nanos().max(1) + 1;
        self.due_at = Deadline::at(due + rate.times(beats));
    }

    /// The production owed has been built and handed out.
    pub(super) fn produced(&mut self, now: Instant) {
        self.io.owed = false;
        self.wanted = false;
        if self.trigger == Trigger::ChangeOfState {
            self.restart_rate(now);
        }
        self.inhibited_until = match self.io.connection.production_inhibit {
            0 => Deadline::NEVER,
            inhibit => Deadline::at(now + Duration::from_millis(u64::from(inhibit))),
        };
        self.waiting = self.acknowledged;
    }

    /// The production is on the wire: the time for its acknowledge runs from here.
    pub(super) fn sent(&mut self, now: Instant, handler: AcknowledgeHandler) {
        if self.waiting {
            let time = Duration::from_millis(u64::from(handler.timer));
            self.acknowledge_by = Deadline::at(now + time);
        }
    }

    /// The master's acknowledge arrived.
    pub(super) fn acknowledge(&mut self, now: Instant) {
        self.io.connection.arm(now);
        if self.waiting {
            // What may be owed is a repeat that has not reached the wire; nobody needs it now.
            self.io.owed = false;
        }
        self.waiting = false;
        self.repeats = 0;
        self.acknowledge_by = Deadline::NEVER;
    }

    pub(super) fn deadline(&self) -> Deadline {
        let held_back = self.wanted && !self.waiting && !self.io.owed;
        let inhibit = if held_back { self.inhibited_until } else { Deadline::NEVER };
        self.io.connection.deadline().min(self.due_at).min(self.acknowledge_by).min(inhibit)
    }
}
