//! The master on its line: octets and time in, telegrams and deadlines out.

use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Duration, Instant, Station};

use super::Event;
use super::acyclic::Applications;
use super::judge::Awaited;
use super::master::Master;
use super::telegram::{SYNCHRONIZATION_BITS, fill};

/// How long the master is silent after another one was found at its address.
const COLLISION_PAUSE: Duration = Duration::from_secs(1);

/// How often profirust is asked in a row before it has nothing to send: the first time it may only
/// find that its cycle is over, the second time it passes the token.
const POLLS: u32 = 2;

impl Station for Master {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    /// The first octet of a telegram must come when it is there, not with the rest of it: an answer
    /// that has not begun within the slot time counts as none. The rest may come at once.
    fn handle(&mut self, now: Instant, input: Input<'_>) {
        self.free_at = self.free_at.max(now + self.settings.baud_rate.bits(SYNCHRONIZATION_BITS));
        self.heard = Some(now);
        self.line.hear();
        self.receiver.push(now, input);
        let mut telegram = Vec::new();
        while self.receiver.next(&mut telegram) {
            self.counters.received += 1;
            // Two spoke at once, and what was heard is no answer.
            if now <= self.speaks_until {
                self.counters.unexpected += 1;
            } else if self.judge(now, &telegram) {
                self.line.deliver(&telegram);
            }
        }
        // profirust takes one telegram at a time while it waits for an answer.
        let mut waiting = usize::MAX;
        while self.line.waiting() != 0 && self.line.waiting() < waiting {
            waiting = self.line.waiting();
            self.poll(now);
        }
    }

    /// Nothing falls due but what [`transmit`](Self::transmit) finds out.
    fn advance(&mut self, _now: Instant) {}

    fn transmit(&mut self, now: Instant) -> Option<Transmission> {
        if let Some(rejoins) = self.rejoins {
            if now < rejoins {
                return None;
            }
            self.rejoins = None;
            self.line.reset();
            self.fdl.set_online();
        }
        if now < self.line_is_free_at() {
            return None;
        }
        self.commit(now);
        for _ in 0..POLLS {
            if self.line.outgoing().is_empty() {
                self.poll(now);
            }
        }
        self.send(now)
    }

    /// profirust names no moment at which it wants to be asked, but all its waiting counts from the
    /// last activity of the bus: 33 bits before it speaks, the slot time for an answer to begin, and
    /// several of those before it takes the token for lost. The deadline is the first of these that
    /// has not been asked at; behind the last one, another slot time.
    fn deadline(&self) -> Option<Instant> {
        if let Some(rejoins) = self.rejoins {
            return Some(rejoins);
        }
        let (Some(quiet), Some(polled)) = (self.line.quiet_since(), self.polled) else {
            return Some(self.line_is_free_at());
        };
        let polled = self.clock.tick(polled);
        let quiet = self.heard.map_or(quiet, |heard| quiet.max(self.clock.tick(heard)));
        let slot = u32::from(self.settings.slot());
        let lost = slot * (6 + 2 * u32::from(self.settings.address));
        let next = [
            quiet.after_bits(SYNCHRONIZATION_BITS).next(),
            quiet.after_bits(slot).next(),
            quiet.after_bits(lost),
        ]
        .into_iter()
        .find(|tick| *tick > polled)
        .unwrap_or_else(|| polled.after_bits(slot));
        Some(self.clock.instant(next).max(self.line_is_free_at()))
    }
}

impl Node for Master {
    fn baud_rate(&self) -> BaudRate {
        self.settings.baud_rate
    }
}

impl Master {
    /// From when on the master may speak: nobody does, and the pause before a request is over.
    fn line_is_free_at(&self) -> Instant {
        self.free_at.max(self.receiver.patience())
    }

    /// Lets profirust go on. What was heard earlier it is told with the time of that.
    fn poll(&mut self, now: Instant) {
        if let Some(heard) = self.heard.take()
            && heard < now
        {
            self.poll_at(heard);
        }
        self.poll_at(now);
    }

    fn poll_at(&mut self, now: Instant) {
        let tick = self.clock.tick(now);
        // Its DP master never ends a cycle without slaves.
        let is_serving = !self.slaves.is_empty() && !self.is_stopped;
        let dp = is_serving.then_some(&mut self.dp);
        let mut applications = Applications { dp, requests: &mut self.requests };
        self.fdl.poll(tick.time(), &mut self.line, &mut applications);
        self.line.polled(tick);
        self.polled = Some(now);
        self.take_reports(now);
        if !self.fdl.connectivity_state().is_online() && self.rejoins.is_none() {
            self.events.push(Event::AddressCollision);
            self.rejoins = Some(now + COLLISION_PAUSE);
            self.awaited = Awaited::Nothing;
            self.line.reset();
        }
    }

    /// Makes a transmission of what profirust wants to send.
    fn send(&mut self, now: Instant) -> Option<Transmission> {
        let mut telegram = std::mem::take(self.line.outgoing());
        let transmission = if telegram.is_empty() {
            None
        } else {
            if let Some((place, service)) = self.note_request(&telegram) {
                if let Some(slave) = self.slaves.get(place) {
                    fill(&mut telegram, slave.octets_of(service));
                }
                self.asked(place);
            }
            self.counters.sent += 1;
            let rate = self.settings.baud_rate;
            let characters = u32::try_from(telegram.len()).unwrap_or(u32::MAX);
            self.speaks_until = now + rate.characters(characters);
            self.free_at = self.speaks_until + rate.bits(SYNCHRONIZATION_BITS);
            self.receiver.clear();
            Transmission::new(&telegram)
        };
        // Its room is used again.
        telegram.clear();
        *self.line.outgoing() = telegram;
        transmission
    }
}
