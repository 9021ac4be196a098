//! How a slave is brought to data exchange: allocation, configuration, and release where it fails.

use codewheel_station::Instant;

use super::{Held, Phase, REFUSED_TIME, REPEATS, RETRY_TIME, Slave, Then};
use crate::connection;
use crate::explicit::{BodyFormat, Error, GeneralStatus};
use crate::scanner::exchange::{Answer, Ended, Port};
use crate::scanner::io::IO_DATA_OCTETS;
use crate::scanner::settings::{IdentityCode, Refusal};
use crate::scanner::steps::{RELEASES, Step, release};
use crate::server::choice;

/// The coarsest clock that a rate may be rounded up to, in ms.
const COARSEST_CLOCK: u16 = 1_000;

/// The expected packet rate that a slave has: the one asked for, rounded up to its clock. What it
/// says beyond that must not make us wait for it for ever.
fn granted(asked: u16, answered: u16) -> u16 {
    if asked == 0 { 0 } else { answered.clamp(asked, asked.saturating_add(COARSEST_CLOCK)) }
}

impl Slave {
    /// The slave does not exchange data any more: bring it back at once.
    pub(super) fn lost(&mut self) {
        self.losses = self.losses.saturating_add(1);
        self.settle();
        self.enter(Step::Allocate);
    }

    pub(super) fn enter(&mut self, step: Step) {
        self.phase = Phase::Configuring { step };
        let port = if step == Step::Allocate { Port::Unconnected } else { Port::Connected };
        self.ask(port, step.request(&self.settings, self.master));
    }

    /// Releases `RELEASES[index]` and what follows, then goes on.
    pub(super) fn release_from(&mut self, index: usize, then: Then) {
        let holds = |choice: &u8| match then {
            Then::Allocate => true,
            Then::Resume => *choice == choice::POLL,
            Then::Leave | Then::Vanish => self.settings.choice() & choice != 0,
        };
        let next = RELEASES.iter().enumerate().skip(index).find(|(_, choice)| holds(choice));
        if let Some((index, choice)) = next {
            self.phase = Phase::Releasing { index, then };
            self.ask(Port::Unconnected, release(*choice));
        } else if then == Then::Allocate {
            self.enter(Step::Allocate);
        }
    }

    /// Leaves the slave for a while after it was allocated, and gives back what we hold.
    fn refuse(&mut self, refusal: Refusal) {
        self.refusal = Some(refusal);
        self.release_from(0, Then::Leave);
    }

    /// Moves on after the exchange of a release has ended.
    pub(super) fn conclude_release(&mut self, now: Instant, index: usize, then: Then) {
        let Some(ended) = self.exchange.ended() else { return };
        self.exchange.stop();
        if ended != Ended::Answered {
            // Where nobody has answered an allocation, nobody is likely to answer now.
            if self.repeats < REPEATS && self.held == Held::Connections {
                self.repeats += 1;
                return self.release_from(index, then);
            }
            // Nobody is there any more, unless it is one release that the slave will not hear of.
            if index == 0 {
                self.repeats = 0;
                return match then {
                    Then::Allocate => self.leave(now, RETRY_TIME),
                    Then::Resume => {
                        self.settings.poll = None;
                        self.leave(now, RETRY_TIME);
                    }
                    Then::Leave => self.leave(now, REFUSED_TIME),
                    Then::Vanish => self.phase = Phase::Gone,
                };
            }
        }
        // A refusal says that there was nothing to release, or that another master owns it.
        self.repeats = 0;
        self.release_from(index + 1, then);
        // Nothing was left to be released.
        if self.exchange.is_idle() {
            match then {
                Then::Allocate => {}
                Then::Resume => {
                    self.settings.poll = None;
                    self.begin_exchanging_data(now);
                }
                Then::Leave => {
                    self.held = Held::Nothing;
                    self.leave(now, REFUSED_TIME);
                }
                Then::Vanish => self.phase = Phase::Gone,
            }
        }
    }

    /// Moves on after the exchange of `step` has ended.
    pub(super) fn conclude(&mut self, now: Instant, step: Step) {
        let Some(ended) = self.exchange.ended() else { return };
        self.exchange.stop();
        if ended != Ended::Answered {
            // An allocation is not repeated here: whether anybody is there is what it asks.
            if step == Step::Allocate {
                self.refusal = None;
                self.held = Held::Perhaps;
            } else if self.repeats < REPEATS {
                self.repeats += 1;
                return self.enter(step);
            }
            return self.leave(now, RETRY_TIME);
        }
        self.repeats = 0;
        match (step, self.own.answer()) {
            (Step::Allocate | Step::AllocatePoll, Answer::Refused(error)) => {
                return self.not_allocated(now, step, error);
            }
            (Step::Allocate, Answer::Done(data)) => {
                self.held = Held::Connections;
                let format = data.first().copied().unwrap_or_default();
                let Some(known) = BodyFormat::from_octet(format) else {
                    return self.refuse(Refusal::BodyFormat { format });
                };
                self.format = known;
            }
            // A slave that knows no deferred delete gets its explicit connection kept alive; one
            // that does not tell what it consumes gets nothing.
            (Step::DeferredDelete, answer) => {
                self.defers_delete = matches!(answer, Answer::Done(_));
            }
            (Step::ConsumedSize, Answer::Refused(_)) => self.consumed_size = 0,
            (_, Answer::Refused(error)) => return self.refuse(Refusal::Service(error)),
            (_, Answer::Done(data)) => {
                let value = match *data {
                    [low, high, ..] => u16::from_le_bytes([low, high]),
                    _ => 0,
                };
                if let Err(refusal) = self.learn(step, value) {
                    return self.refuse(refusal);
                }
            }
        }
        match step.next(&self.settings) {
            Some(next) => self.enter(next),
            None => self.begin_exchanging_data(now),
        }
    }

    fn not_allocated(&mut self, now: Instant, step: Step, error: Error) {
        if error.general == GeneralStatus::ALREADY_IN_STATE && !self.released {
            self.released = true;
            self.held = Held::Connections;
            return self.release_from(0, Then::Allocate);
        }
        if step != Step::Allocate {
            return self.refuse(Refusal::Service(error));
        }
        self.held = Held::Nothing;
        self.refusal = Some(Refusal::Service(error));
        self.leave(now, REFUSED_TIME);
    }

    /// Takes in what a step found out.
    fn learn(&mut self, step: Step, value: u16) -> Result<(), Refusal> {
        let wanted = self.settings.identity;
        let another = |code, wanted: u16| {
            let different = Refusal::AnotherDevice { code, found: value, wanted };
            if value == wanted { Ok(()) } else { Err(different) }
        };
        let size = || {
            let too_long = usize::from(value) > IO_DATA_OCTETS;
            if too_long { Err(Refusal::InputTooLong { octets: value }) } else { Ok(value) }
        };
        match step {
            Step::Vendor => {
                wanted.map_or(Ok(()), |wanted| another(IdentityCode::Vendor, wanted.vendor))?;
            }
            Step::ProductCode => wanted
                .map_or(Ok(()), |wanted| another(IdentityCode::ProductCode, wanted.product_code))?,
            Step::PollSize => self.poll.expect(size()?),
            Step::ChangeSize => self.change.expect(size()?),
            Step::ConsumedSize => {
                self.consumed_size = value;
                let set = self.output.data().len() as u16;
                if set != 0 && set != value {
                    return Err(Refusal::OutputLength { consumes: value, set });
                }
            }
            Step::PollRate => {
                let asked = self.settings.poll.map_or(0, |poll| poll.expected_packet_rate);
                self.poll_rate = granted(asked, value);
            }
            Step::ChangeRate => {
                let asked = self.settings.change.map_or(0, |change| change.expected_packet_rate);
                self.change_rate = granted(asked, value);
            }
            Step::Allocate
            | Step::AllocatePoll
            | Step::DeferredDelete
            | Step::PollPath
            | Step::ChangePath
            | Step::ChangeInhibit => {}
        }
        Ok(())
    }

    fn begin_exchanging_data(&mut self, now: Instant) {
        self.refusal = None;
        self.released = false;
        self.phase = Phase::Running;
        // The slave grants the first interval ten seconds; we are as patient.
        let first = |rate| {
            let time = connection::inactivity_time(rate)?;
            Some(now + time.max(connection::PRE_CONSUMPTION_TIME))
        };
        self.poll_lost_at = self.settings.poll.and_then(|_| first(self.poll_rate)).into();
        self.change_lost_at = self.settings.change.and_then(|_| first(self.change_rate)).into();
        self.arm_keep_alive(now);
    }
}
