//! What the scanner knows of one slave, and the steps that bring it to data exchange.

use codewheel_station::{Deadline, Duration, Instant};

use super::exchange::{ANSWER_TIME, Exchange, Outcome, Port};
use super::{Refusal, SlaveSettings, SlaveState, Ticket};
use crate::explicit::{GeneralStatus, Service, class};
use crate::server::choice;
use crate::{MacId, connection};

/// How long the scanner leaves a slave alone after an attempt failed.
const RETRY_TIME: Duration = Duration::from_millis(500);
/// How long it leaves one alone that refused: another master may give it up.
const REFUSED_TIME: Duration = Duration::from_secs(2);
/// How often a step is repeated whose request or answer got lost.
const REPEATS: u8 = 2;
/// How long a slave that was just heard checking its MAC ID needs until it is on-line.
const BOOT_TIME: Duration = Duration::from_millis(1_100);
/// The longest input a slave's I/O message can carry unfragmented.
const INPUT_OCTETS: usize = 8;

/// The steps from an unknown slave to data exchange, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Allocate the explicit and the I/O connections.
    Allocate,
    /// Give back what an earlier life of ours still holds, then allocate anew.
    ReleaseExplicit,
    ReleaseIo,
    /// Vendor, then product code, where the settings name them.
    Vendor,
    ProductCode,
    /// Keep the explicit connection alive by the I/O connection (watchdog action 3).
    DeferredDelete,
    /// Choose what the slave produces, where the settings name it.
    ProducedPath,
    /// Learn how much it produces.
    ProducedSize,
    /// Set the expected packet rate: the connection is established.
    Rate,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Left alone until then.
    Waiting {
        until: Instant,
    },
    /// A request of `step` is under way.
    Configuring {
        step: Step,
    },
    Running,
}

#[derive(Clone, Debug)]
pub(super) struct Slave {
    pub(super) settings: SlaveSettings,
    master: MacId,
    phase: Phase,
    /// How often the step under way has been repeated.
    repeats: u8,
    pub(super) exchange: Exchange,
    /// Whose request the exchange carries while running.
    pub(super) ticket: Option<Ticket>,
    /// A request whose answer can no longer come, since the slave was lost.
    pub(super) unanswered: Option<Ticket>,
    refusal: Option<Refusal>,
    input: [u8; INPUT_OCTETS],
    input_length: u8,
    produced_size: u16,
    pub(super) input_at: Option<Instant>,
    /// The slave was polled in this cycle and has not answered yet.
    pub(super) awaited: bool,
    /// When the slave is given up unless it answers a poll.
    lost_at: Deadline,
    pub(super) polls: u64,
    pub(super) responses: u64,
    pub(super) losses: u32,
}

impl Slave {
    pub(super) const fn new(settings: SlaveSettings, master: MacId) -> Self {
        Self {
            settings,
            master,
            phase: Phase::Waiting { until: Instant::ZERO },
            repeats: 0,
            exchange: Exchange::new(master, settings.mac),
            ticket: None,
            unanswered: None,
            refusal: None,
            input: [0; INPUT_OCTETS],
            input_length: 0,
            produced_size: 0,
            input_at: None,
            awaited: false,
            lost_at: Deadline::NEVER,
            polls: 0,
            responses: 0,
            losses: 0,
        }
    }

    pub(super) const fn state(&self) -> SlaveState {
        match (self.phase, self.refusal) {
            (Phase::Running, _) => SlaveState::Running,
            (_, Some(refusal)) => SlaveState::Refused(refusal),
            (Phase::Waiting { .. }, None) => SlaveState::Absent,
            (Phase::Configuring { .. }, None) => SlaveState::Configuring,
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.phase == Phase::Running
    }

    pub(super) fn input(&self) -> &[u8] {
        self.input.get(..usize::from(self.input_length)).unwrap_or_default()
    }

    fn wanted(&self) -> u8 {
        choice::EXPLICIT | choice::POLL
    }

    /// The slave was heard checking its MAC ID: whatever it knew of us is gone.
    pub(super) fn booted(&mut self, now: Instant) {
        if self.is_running() {
            self.losses += 1;
        }
        self.leave(now, BOOT_TIME);
    }

    /// Gives the slave up for `time`. A request of the user under way stays unanswered.
    fn leave(&mut self, now: Instant, time: Duration) {
        self.phase = Phase::Waiting { until: now + time };
        self.awaited = false;
        self.lost_at = Deadline::NEVER;
        self.unanswered = self.ticket.take().or(self.unanswered);
        self.exchange.stop();
    }

    fn enter(&mut self, step: Step) {
        self.phase = Phase::Configuring { step };
        let io = connection::POLL;
        let get = Service::GET_ATTRIBUTE_SINGLE.0;
        let set = Service::SET_ATTRIBUTE_SINGLE.0;
        let allocate = Service::ALLOCATE.0;
        let release = Service::RELEASE.0;
        let unconnected = |exchange: &mut Exchange, body: &[u8]| {
            exchange.begin(Port::Unconnected, body, ANSWER_TIME);
        };
        let connected = |exchange: &mut Exchange, body: &[u8]| {
            exchange.begin(Port::Connected, body, ANSWER_TIME);
        };
        let wanted = self.wanted();
        let exchange = &mut self.exchange;
        match step {
            Step::Allocate => {
                let body = [allocate, class::DEVICENET, 1, wanted, self.master.value()];
                unconnected(exchange, &body);
            }
            Step::ReleaseExplicit => {
                unconnected(exchange, &[release, class::DEVICENET, 1, choice::EXPLICIT]);
            }
            Step::ReleaseIo => {
                unconnected(exchange, &[release, class::DEVICENET, 1, wanted & !choice::EXPLICIT]);
            }
            Step::Vendor => connected(exchange, &[get, class::IDENTITY, 1, 1]),
            Step::ProductCode => connected(exchange, &[get, class::IDENTITY, 1, 3]),
            Step::DeferredDelete => {
                let action = connection::Connection::DEFERRED_DELETE;
                let body = [set, class::CONNECTION, connection::EXPLICIT, 12, action];
                connected(exchange, &body);
            }
            Step::ProducedPath => {
                let assembly = self.settings.assembly.unwrap_or(1);
                let body = [set, class::CONNECTION, io, 14, 0x20, class::ASSEMBLY, 0x24, assembly];
                connected(exchange, &body);
            }
            Step::ProducedSize => connected(exchange, &[get, class::CONNECTION, io, 7]),
            Step::Rate => {
                let [low, high] = self.settings.expected_packet_rate.to_le_bytes();
                connected(exchange, &[set, class::CONNECTION, io, 9, low, high]);
            }
        }
    }

    /// Moves on after the exchange of `step` has ended.
    fn conclude(&mut self, now: Instant, step: Step) {
        let Some(outcome) = self.exchange.outcome() else { return };
        // An allocation is not repeated here: whether anybody is there is what it asks.
        if outcome == Outcome::NoAnswer && step != Step::Allocate && self.repeats < REPEATS {
            self.repeats += 1;
            return self.enter(step);
        }
        self.repeats = 0;
        match (step, outcome) {
            (Step::Allocate, Outcome::Refused(error))
                if error.general == GeneralStatus::ALREADY_IN_STATE =>
            {
                return self.enter(Step::ReleaseExplicit);
            }
            (Step::ReleaseExplicit, Outcome::Done(_) | Outcome::Refused(_)) => {
                return self.enter(Step::ReleaseIo);
            }
            (Step::ReleaseIo, Outcome::Done(_) | Outcome::Refused(_)) => {
                return self.enter(Step::Allocate);
            }
            // A slave that knows no deferred delete is read and written while its explicit
            // connection lasts, and allocated anew after that.
            (Step::DeferredDelete, Outcome::Refused(_)) => {}
            (_, Outcome::NoAnswer) => return self.leave(now, RETRY_TIME),
            (_, Outcome::Refused(error)) => {
                self.refusal = Some(Refusal::Service(error));
                return self.leave(now, REFUSED_TIME);
            }
            (Step::Vendor | Step::ProductCode, Outcome::Done(data)) => {
                let found = match *data {
                    [low, high, ..] => u16::from_le_bytes([low, high]),
                    _ => 0,
                };
                let wanted = match (step, self.settings.identity) {
                    (Step::Vendor, Some((vendor, _))) => vendor,
                    (_, Some((_, product_code))) => product_code,
                    (_, None) => found,
                };
                if found != wanted {
                    self.refusal = Some(Refusal::AnotherDevice { found, wanted });
                    return self.leave(now, REFUSED_TIME);
                }
            }
            (Step::ProducedSize, Outcome::Done(data)) => {
                self.produced_size = match *data {
                    [low, high, ..] => u16::from_le_bytes([low, high]),
                    _ => 0,
                };
            }
            (_, Outcome::Done(_)) => {}
        }
        match self.after(step) {
            Some(next) => self.enter(next),
            None => {
                self.exchange.stop();
                self.refusal = None;
                self.phase = Phase::Running;
                // The slave grants the first interval ten seconds; we are as patient.
                self.lost_at = self.patience().map_or(Deadline::NEVER, |time| {
                    Deadline::at(now + time.max(connection::PRE_CONSUMPTION_TIME))
                });
            }
        }
    }

    fn after(&self, step: Step) -> Option<Step> {
        Some(match step {
            Step::Allocate | Step::ReleaseExplicit | Step::ReleaseIo => {
                if self.settings.identity.is_some() { Step::Vendor } else { Step::DeferredDelete }
            }
            Step::Vendor => Step::ProductCode,
            Step::ProductCode => Step::DeferredDelete,
            Step::DeferredDelete => {
                if self.settings.assembly.is_some() {
                    Step::ProducedPath
                } else {
                    Step::ProducedSize
                }
            }
            Step::ProducedPath => Step::ProducedSize,
            Step::ProducedSize => Step::Rate,
            Step::Rate => return None,
        })
    }

    fn patience(&self) -> Option<Duration> {
        connection::inactivity_time(self.settings.expected_packet_rate)
    }

    /// A poll response arrived.
    pub(super) fn response(&mut self, now: Instant, data: &[u8]) {
        self.awaited = false;
        // What is shorter or longer than the slave said it produces is none of its productions.
        if !self.is_running() || data.len() != usize::from(self.produced_size) {
            return;
        }
        for (to, from) in self.input.iter_mut().zip(data) {
            *to = *from;
        }
        self.input_length = data.len().min(INPUT_OCTETS) as u8;
        self.input_at = Some(now);
        self.responses += 1;
        self.lost_at = self.patience().map_or(Deadline::NEVER, |time| Deadline::at(now + time));
    }

    pub(super) fn advance(&mut self, now: Instant) {
        self.exchange.advance(now);
        match self.phase {
            Phase::Waiting { until } if now >= until => {
                self.enter(Step::Allocate);
            }
            Phase::Waiting { .. } => {}
            Phase::Configuring { step } => self.conclude(now, step),
            Phase::Running => {
                if self.lost_at.is_due(now) {
                    self.losses += 1;
                    self.leave(now, Duration::ZERO);
                }
            }
        }
    }

    pub(super) fn deadline(&self) -> Deadline {
        let phase = match self.phase {
            Phase::Waiting { until } => Deadline::at(until),
            _ => Deadline::NEVER,
        };
        phase.min(self.lost_at).min(self.exchange.deadline())
    }
}
