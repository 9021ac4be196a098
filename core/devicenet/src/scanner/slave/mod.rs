//! What the scanner knows of one slave: how it brings it to data exchange and keeps it there.

mod configuring;
mod running;

use codewheel_station::can::Frame;
use codewheel_station::{Deadline, Duration, Instant};

use super::IO_DATA_OCTETS;
use super::exchange::{Ended, Exchange, Port, Question};
use super::io::{Heard, Input, Output};
use super::settings::{Refusal, SlaveSettings};
use super::steps::{Body, Step};
use super::view::{SlaveState, SlaveView, Ticket};
use crate::explicit::{BodyFormat, Header};
use crate::{MacId, connection};

/// The longest request body.
pub(super) const REQUEST_OCTETS: usize = 64;
/// The same with the high octets of class and instance.
const WIDE_REQUEST_OCTETS: usize = REQUEST_OCTETS + 2;
/// The longest response body.
const RESPONSE_OCTETS: usize = 256;
/// The longest request of our own, and the longest response to one.
const OWN_OCTETS: usize = 10;
const OWN_RESPONSE_OCTETS: usize = 16;

/// How long the scanner leaves a slave alone after an attempt failed.
const RETRY_TIME: Duration = Duration::from_millis(500);
/// How long it leaves one alone that refused: another master may give it up.
const REFUSED_TIME: Duration = Duration::from_secs(2);
/// How often a step is repeated whose request or answer got lost.
const REPEATS: u8 = 2;
/// How long a slave that was just heard checking its MAC ID needs until it is on-line.
const BOOT_TIME: Duration = Duration::from_millis(1_100);
/// How long an explicit connection that nothing else keeps alive is left without a request; it
/// times out after ten seconds.
const KEEP_ALIVE_TIME: Duration = Duration::from_millis(2_500);
/// How many polls without an answer lose a slave with expected packet rate 0.
const MISSED_POLLS: u8 = 10;
/// How many lose one that seems to have been switched on anew.
const SUSPICIOUS_MISSED_POLLS: u8 = 3;

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
    /// A release of the connections `RELEASES[index]` is under way.
    Releasing {
        index: usize,
        then: Then,
    },
    Running,
    /// Removed from the scan list, and released.
    Gone,
}

/// What follows a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Then {
    /// Allocate anew what an earlier life of ours held.
    Allocate,
    /// Go on with the explicit connection alone.
    Resume,
    /// Leave the slave alone: it refused, or is another device.
    Leave,
    /// Forget the slave.
    Vanish,
}

/// Whose question the exchange carries while running.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Whose {
    User,
    KeepAlive,
    /// The explicit connection seems to be lost: allocate it, polls going on.
    Reallocate,
    /// Watchdog action 3 for the new one.
    DeferDelete,
}

/// How far the question of the user is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Nothing,
    /// It waits for the exchange.
    Waiting {
        repeated: bool,
    },
    UnderWay {
        repeated: bool,
    },
    Ended(Ended),
}

/// What of ours the slave may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Nothing,
    /// An allocation was sent, and no answer has come.
    Perhaps,
    Connections,
}

#[derive(Clone, Debug)]
pub(super) struct Slave {
    pub(super) settings: SlaveSettings,
    master: MacId,
    phase: Phase,
    /// How often the step under way has been repeated.
    repeats: u8,
    /// This attempt has already released what an earlier life of ours held.
    released: bool,
    held: Held,
    /// How its explicit connection has class and instance.
    format: BodyFormat,
    /// Whether the slave knows deferred delete.
    defers_delete: bool,
    removing: bool,
    exchange: Exchange,
    whose: Whose,
    own: Question<OWN_OCTETS, OWN_RESPONSE_OCTETS>,
    user: Question<WIDE_REQUEST_OCTETS, RESPONSE_OCTETS>,
    asked: Asked,
    ticket: Option<Ticket>,
    refusal: Option<Refusal>,
    poll: Input,
    change: Input,
    /// An acknowledge of the slave's production is owed.
    pub(super) acknowledge: bool,
    output: Output,
    /// What a poll may carry; known while running.
    consumed_size: u16,
    /// The expected packet rates, as granted.
    poll_rate: u16,
    change_rate: u16,
    /// Polls without an answer since the last one.
    misses: u8,
    /// It was heard checking its MAC ID while running: it, or another node.
    suspected: bool,
    /// When the slave is given up unless it answers a poll, or produces.
    poll_lost_at: Deadline,
    change_lost_at: Deadline,
    /// When the explicit connection wants a request.
    keep_alive_at: Deadline,
    polls: u64,
    losses: u32,
}

impl Slave {
    pub(super) const fn new(settings: SlaveSettings, master: MacId) -> Self {
        Self {
            settings,
            master,
            phase: Phase::Waiting { until: Instant::ZERO },
            repeats: 0,
            released: false,
            held: Held::Nothing,
            format: BodyFormat::Class8Instance8,
            defers_delete: false,
            removing: false,
            exchange: Exchange::new(master, settings.mac),
            whose: Whose::User,
            own: Question::new(),
            user: Question::new(),
            asked: Asked::Nothing,
            ticket: None,
            refusal: None,
            poll: Input::new(),
            change: Input::new(),
            acknowledge: false,
            output: Output::new(),
            consumed_size: 0,
            poll_rate: 0,
            change_rate: 0,
            misses: 0,
            suspected: false,
            poll_lost_at: Deadline::NEVER,
            change_lost_at: Deadline::NEVER,
            keep_alive_at: Deadline::NEVER,
            polls: 0,
            losses: 0,
        }
    }

    pub(super) fn view(&self) -> SlaveView<'_> {
        SlaveView {
            state: self.state(),
            input: self.poll.data(),
            input_at: self.poll.at,
            change: self.change.data(),
            change_at: self.change.at,
            output: self.output.data(),
            polls: self.polls,
            responses: self.poll.count,
            changes: self.change.count,
            losses: self.losses,
        }
    }

    const fn state(&self) -> SlaveState {
        match (self.phase, self.refusal) {
            (Phase::Running, _) => SlaveState::Running,
            (_, Some(refusal)) => SlaveState::Refused(refusal),
            (Phase::Waiting { .. } | Phase::Gone, None) => SlaveState::Absent,
            (Phase::Configuring { step: Step::Allocate }, None) if !self.released => {
                SlaveState::Absent
            }
            (Phase::Configuring { .. } | Phase::Releasing { .. }, None) => SlaveState::Configuring,
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.phase == Phase::Running
    }

    /// Whether it wants polls now.
    #[inline]
    pub(super) fn is_polled(&self) -> bool {
        self.is_running() && self.settings.poll.is_some()
    }

    /// Whether its place can be given to another.
    pub(super) fn is_gone(&self) -> bool {
        self.phase == Phase::Gone
    }

    /// Releases the slave, then forgets it; at once where it holds nothing of ours, or nobody
    /// would hear the release.
    pub(super) fn remove(&mut self, on_line: bool) {
        self.settle();
        self.removing = true;
        if self.held != Held::Nothing && on_line {
            self.release_from(0, Then::Vanish);
        } else {
            self.phase = Phase::Gone;
        }
    }

    /// The scanner has left the bus, or comes back to it.
    pub(super) fn fall_silent(&mut self) {
        self.settle();
        self.exchange.forget();
        self.refusal = None;
        self.held = Held::Nothing;
        self.phase =
            if self.removing { Phase::Gone } else { Phase::Waiting { until: Instant::ZERO } };
    }

    /// A node with this MAC ID was heard checking it. It is the slave, switched on anew, or another
    /// node that will find the address taken.
    pub(super) fn booted(&mut self, now: Instant) {
        match self.phase {
            // Whether it still answers will tell.
            Phase::Running => {
                self.suspected = true;
                if self.settings.poll.is_none() {
                    self.keep_alive_at = Deadline::at(now);
                }
            }
            Phase::Waiting { .. } | Phase::Configuring { step: Step::Allocate } => {
                self.leave(now, BOOT_TIME);
            }
            Phase::Configuring { .. } | Phase::Releasing { .. } | Phase::Gone => {}
        }
    }

    /// Ends what is going on. A request of the user under way stays without an answer; an answer
    /// that has arrived is kept.
    fn settle(&mut self) {
        self.exchange.stop();
        if matches!(self.asked, Asked::Waiting { .. } | Asked::UnderWay { .. }) {
            self.asked = Asked::Ended(Ended::Silent);
        }
        self.repeats = 0;
        self.released = false;
        self.acknowledge = false;
        self.misses = 0;
        self.suspected = false;
        self.poll_lost_at = Deadline::NEVER;
        self.change_lost_at = Deadline::NEVER;
        self.keep_alive_at = Deadline::NEVER;
    }

    /// Gives the slave up for `time`.
    fn leave(&mut self, now: Instant, time: Duration) {
        self.settle();
        self.phase = if self.removing { Phase::Gone } else { Phase::Waiting { until: now + time } };
    }

    fn ask(&mut self, port: Port, body: Body) {
        self.ask_within(port, body, port.patience());
    }

    fn ask_within(&mut self, port: Port, (body, length): Body, patience: Duration) {
        let format = match port {
            Port::Unconnected => BodyFormat::Class8Instance8,
            Port::Connected => self.format,
        };
        self.own.ask(port, format, body.get(..length).unwrap_or(&body), patience);
        self.exchange.begin(&mut self.own);
    }

    /// When the slave is lost unless it answers a poll.
    #[inline]
    pub(super) const fn poll_lost_at(&self) -> Deadline {
        self.poll_lost_at
    }

    /// A poll response arrived. Of all deadlines it moves only
    /// [`poll_lost_at`](Self::poll_lost_at).
    #[inline]
    pub(super) fn response(&mut self, now: Instant, data: &[u8]) -> Heard {
        if !self.is_polled() {
            return Heard::Nothing;
        }
        let heard = self.poll.heard(now, data);
        match heard {
            Heard::Nothing => self.misses = self.misses.saturating_add(1),
            Heard::Part => {}
            Heard::Whole => {
                self.misses = 0;
                self.suspected = false;
                let time = connection::inactivity_time(self.poll_rate);
                self.poll_lost_at = time.map(|time| now + time).into();
            }
        }
        heard
    }

    /// The slave produced of its own accord.
    pub(super) fn produced(&mut self, now: Instant, data: &[u8]) {
        // The first production overtakes the response to the rate that brought it about.
        let established = matches!(
            self.phase,
            Phase::Running | Phase::Configuring { step: Step::PollRate | Step::ChangeRate }
        );
        let Some(change) = self.settings.change.filter(|_| established) else { return };
        if self.change.heard(now, data) != Heard::Whole {
            return;
        }
        self.acknowledge = change.acknowledged;
        if self.is_running() {
            self.suspected = false;
            let time = connection::inactivity_time(self.change_rate);
            self.change_lost_at = time.map(|time| now + time).into();
        }
    }

    /// Counts a poll about to be sent. `missed`: the one before has not been answered. Returns
    /// what it carries, or `None` when the slave was lost by that.
    #[inline]
    pub(super) fn poll(&mut self, missed: bool) -> Option<&[u8]> {
        if missed {
            self.misses = self.misses.saturating_add(1);
        }
        let lost = (self.poll_rate == 0 && self.misses >= MISSED_POLLS)
            || (self.suspected && self.misses >= SUSPICIOUS_MISSED_POLLS);
        if lost {
            self.lost();
            return None;
        }
        self.polls += 1;
        let output = self.output.data();
        let fits = output.len() == usize::from(self.consumed_size);
        Some(if fits { output } else { &[] })
    }

    /// Whether `data` can be the slave's output, as far as is known, and keeps them then.
    pub(super) fn set_output(&mut self, data: &[u8]) -> bool {
        let fits = data.len() <= IO_DATA_OCTETS
            && (!self.is_running()
                || data.is_empty()
                || data.len() == usize::from(self.consumed_size));
        if fits {
            self.output.set(data);
        }
        fits
    }

    /// An explicit response arrived, without its header octet.
    pub(super) fn heard(&mut self, now: Instant, header: Header, rest: &[u8]) {
        if self.is_running() && self.whose == Whose::User {
            self.exchange.heard(now, header, rest, &mut self.user);
        } else {
            self.exchange.heard(now, header, rest, &mut self.own);
        }
        self.advance(now);
    }

    pub(super) fn sent(&mut self, now: Instant, port: Port, data: &[u8]) {
        self.exchange.sent(now, port, data);
    }

    pub(super) fn advance(&mut self, now: Instant) {
        self.exchange.advance(now);
        match self.phase {
            Phase::Waiting { until } if now >= until => self.enter(Step::Allocate),
            Phase::Waiting { .. } | Phase::Gone => {}
            Phase::Configuring { step } => self.conclude(now, step),
            Phase::Releasing { index, then } => self.conclude_release(now, index, then),
            Phase::Running => self.run(now),
        }
    }

    pub(super) fn deadline(&self) -> Deadline {
        let phase = match self.phase {
            Phase::Waiting { until } => Deadline::at(until),
            Phase::Running => {
                let idle = self.exchange.is_idle();
                let keep_alive = if idle { self.keep_alive_at } else { Deadline::NEVER };
                self.poll_lost_at.min(self.change_lost_at).min(keep_alive)
            }
            _ => Deadline::NEVER,
        };
        phase.min(self.exchange.deadline())
    }

    /// Whether [`transmit`](Self::transmit) has something.
    pub(super) const fn is_owed(&self) -> bool {
        self.exchange.is_owed()
    }

    pub(super) fn transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.is_running() && self.whose == Whose::User {
            self.exchange.transmit(now, &self.user)
        } else {
            let allocates = matches!(self.phase, Phase::Configuring { step: Step::Allocate });
            if allocates && self.held == Held::Nothing {
                self.held = Held::Perhaps;
            }
            self.exchange.transmit(now, &self.own)
        }
    }
}
