//! The course of events: deadlines, arbitration, frames and what becomes of them.

use codewheel_station::can::{Frame, Identifier, Input};
use codewheel_station::{Duration, Instant};

use super::{Attached, Mail, Node, NodeId, Outcome, Phase, Waiting, Wire};
use crate::can::bits::{INTERFRAME_SPACE, Sequence, arbitration_key};
use crate::can::{Event, rules};
use crate::chance::happens;
use crate::schedule::NEVER;

/// How often a station may be called within one bit before it counts as stuck.
const TURNS: u32 = 1_000;

/// A station whose deadline has passed but which cannot be rid of its output yet, because the wire
/// is busy or its mailbox full, is advanced once in this time: a deadline that lies hidden behind
/// the first must not wait for the wire.
const PATIENCE: u64 = 1_000_000;

impl<N: Node> Wire<N> {
    /// Does everything due at this moment, once. What becomes due by that is left to the next step.
    pub(super) fn step(&mut self, observer: &mut impl FnMut(&Event)) {
        if self.phase_end <= self.now {
            self.end_phase(observer);
        }
        self.recover(observer);
        while let Some(slot) = self.schedule.due(self.now) {
            self.advance(slot, observer);
        }
        if matches!(self.phase, Phase::Idle) {
            self.ask();
            self.arbitrate(observer);
        }
    }

    fn advance(&mut self, slot: usize, observer: &mut impl FnMut(&Event)) {
        let Some(node) = self.slots[slot].node.as_mut() else {
            return self.schedule.set(slot, NEVER);
        };
        if self.now - node.turns_since >= self.bit_nanos {
            (node.turns, node.turns_since) = (0, self.now);
        }
        node.turns += 1;
        if node.turns > TURNS {
            node.stalled = true;
            self.schedule.set(slot, NEVER);
            let rule = format!(
                "asks to be called again and again: {TURNS} turns within one bit, and its deadline \
                 does not move on; it is left alone until its next input"
            );
            return self.report(slot, rule, observer);
        }
        let now = Instant::from_nanos(self.now);
        node.station.advance(now);
        if !node.asked {
            node.asked = true;
            self.asking.push(slot);
        }
        let mut deadline = nanos(node.station.deadline());
        if deadline <= self.now {
            node.overdue = true;
            deadline = self.now.saturating_add(PATIENCE);
        }
        self.schedule.set(slot, deadline);
    }

    /// Asks all that were called since they were last asked, as long as their mailbox is empty. A
    /// full one is asked after the frame in it has gone.
    fn ask(&mut self) {
        let now = Instant::from_nanos(self.now);
        for slot in self.asking.drain(..) {
            let Some(node) = self.slots[slot].node.as_mut() else {
                continue;
            };
            node.asked = false;
            if node.stalled || node.mailbox.is_some() || self.off.iter().any(|off| off.slot == slot)
            {
                continue;
            }
            if std::mem::take(&mut node.overdue) {
                node.station.advance(now);
            }
            if let Some(frame) = node.station.transmit(now) {
                self.waiting.push(Waiting { key: arbitration_key(&frame), slot });
                node.mailbox = Some(Mail::new(frame));
            }
            self.schedule.set(slot, nanos(node.station.deadline()));
        }
    }

    fn arbitrate(&mut self, observer: &mut impl FnMut(&Event)) {
        self.senders.clear();
        let Some(least) = self.waiting.iter().map(|waiting| waiting.key).min() else {
            return;
        };
        let first = self.waiting.iter().filter(|waiting| waiting.key == least);
        self.senders.extend(first.map(|waiting| waiting.slot));
        let collision = if self.senders.len() > 1 { self.collide(observer) } else { None };

        let Some(&slot) = self.senders.first() else {
            return;
        };
        let acknowledged = self.taking_part > self.senders.len();
        if !acknowledged && self.senders.iter().all(|&slot| self.is_held(slot)) {
            return self.senders.clear();
        }
        let Some(Mail { frame, sequence, .. }) = self.mail(slot) else {
            return;
        };
        let (frame, sequence) = (*frame, *sequence);
        let (bits, outcome) = if let Some(broken) = collision {
            (Sequence::destroyed_bits(broken), Outcome::Destroyed)
        } else if self.corrupts(slot) {
            let broken = self.random.u32(1..=sequence.stuffed());
            (Sequence::destroyed_bits(broken), Outcome::Destroyed)
        } else if acknowledged {
            (sequence.frame_bits(), Outcome::Delivered)
        } else {
            (sequence.unacknowledged_bits(), Outcome::Unacknowledged)
        };
        let lasts = if outcome == Outcome::Delivered { bits - INTERFRAME_SPACE } else { bits };
        let from = self.id(slot);
        self.begin(Phase::Frame { frame, from, bits, outcome }, lasts);
    }

    fn corrupts(&mut self, slot: usize) -> bool {
        let own = self.slots[slot].node.as_ref().and_then(|node| node.corruption);
        happens(&mut self.random, own.unwrap_or(self.faults.corruption))
    }

    /// Several stations send one identifier at the same moment. Where they send the same bits
    /// nobody notices. Else the first different bit is an error to those whose bit was recessive:
    /// they destroy the frame until, after sixteen tries, their error flags are passive; then the
    /// most dominant frame gets through.
    ///
    /// On a real wire the losers would go on failing up to bus-off. Here they lose as in
    /// arbitration. Returns the bit in which the frame is destroyed.
    fn collide(&mut self, observer: &mut impl FnMut(&Event)) -> Option<u32> {
        let mut senders = std::mem::take(&mut self.senders);
        senders.sort_unstable_by_key(|&slot| (self.mail(slot).map(|mail| mail.sequence), slot));
        self.report_collision(&senders, observer);

        let dominant = senders.first().and_then(|&slot| self.mail(slot)).map(|mail| mail.sequence);
        let mut broken = None;
        for &slot in &senders {
            let Some(node) = self.slots[slot].node.as_ref() else { continue };
            let (Some(mail), Some(dominant)) = (&node.mailbox, dominant) else { continue };
            let noticed = mail.sequence.differs_after(dominant);
            if let Some(bit) = noticed.filter(|_| !node.errors.passive()) {
                broken = Some(broken.map_or(bit, |earlier: u32| earlier.min(bit)));
            }
        }
        if broken.is_none() {
            senders.retain(|&slot| self.mail(slot).map(|mail| mail.sequence) == dominant);
        }
        self.senders = senders;
        broken
    }

    fn report_collision(&mut self, senders: &[usize], observer: &mut impl FnMut(&Event)) {
        for &slot in senders {
            let Some(mail) = self.mail_mut(slot) else { continue };
            let frame = mail.frame;
            if std::mem::replace(&mut mail.collided, true) || frame.is_remote() {
                continue;
            }
            let others = senders.iter().filter(|&&other| other != slot);
            let names = others.filter_map(|&other| self.slots[other].node.as_ref());
            let names: Vec<&str> = names.map(|node| node.name.as_str()).collect();
            let rule = format!(
                "sends {frame} at the same moment as {} sends that identifier: each identifier \
                 belongs to one sender",
                names.join(" and ")
            );
            self.report(slot, rule, observer);
        }
    }

    /// Whether a frame that nobody can acknowledge has been tried often enough. A real controller
    /// tries for ever; here it rests until somebody is attached.
    fn is_held(&self, slot: usize) -> bool {
        let node = self.slots[slot].node.as_ref();
        node.is_some_and(|node| {
            node.errors.passive() && node.mailbox.as_ref().is_some_and(|mail| mail.unacknowledged)
        })
    }

    fn begin(&mut self, phase: Phase, bits: u32) {
        if matches!(phase, Phase::Frame { .. }) {
            self.end_idle();
        }
        self.phase = phase;
        self.phase_since = self.now;
        self.phase_end = self.now.saturating_add(u64::from(bits) * self.bit_nanos);
    }

    fn end_phase(&mut self, observer: &mut impl FnMut(&Event)) {
        let since = self.phase_since;
        self.counted.busy = self.counted.busy + Duration::from_nanos(self.now - since);
        self.phase_end = NEVER;
        let Phase::Frame { frame, from, bits, outcome } =
            std::mem::replace(&mut self.phase, Phase::Idle)
        else {
            return self.begin_idle();
        };
        let at = Instant::from_nanos(self.now);
        match outcome {
            Outcome::Delivered => {
                self.counted.frames += 1;
                self.begin(Phase::Intermission, INTERFRAME_SPACE);
                observer(&Event::Frame { at, from, frame, bits });
                self.police(&frame, from, observer);
                self.deliver(&frame, since, observer);
            }
            Outcome::Destroyed => {
                self.counted.corrupted += 1;
                observer(&Event::Corrupted { at, from, frame });
                self.fail(false, observer);
                self.begin_idle();
            }
            Outcome::Unacknowledged => {
                self.counted.unacknowledged += 1;
                observer(&Event::Unacknowledged { at, from, frame });
                self.fail(true, observer);
                self.begin_idle();
            }
        }
    }

    fn deliver(&mut self, frame: &Frame, since: u64, observer: &mut impl FnMut(&Event)) {
        let senders = std::mem::take(&mut self.senders);
        for &slot in &senders {
            if let Some(node) = self.slots[slot].node.as_mut() {
                node.mailbox = None;
                node.errors.succeeded();
            }
            if let Some(place) = self.waiting.iter().position(|waiting| waiting.slot == slot) {
                self.waiting.swap_remove(place);
            }
            self.handle(slot, Input::Sent(frame));
        }
        if let Identifier::Standard(identifier) = frame.identifier() {
            let mut word = 0;
            while let Some(mut takers) = self.takers.word(identifier, word) {
                while takers != 0 {
                    let slot = word * 64 + takers.trailing_zeros() as usize;
                    takers &= takers - 1;
                    if !senders.contains(&slot) {
                        self.deliver_to(slot, frame, since, observer);
                    }
                }
                word += 1;
            }
        }
        self.senders = senders;
    }

    fn deliver_to(
        &mut self,
        slot: usize,
        frame: &Frame,
        since: u64,
        observer: &mut impl FnMut(&Event),
    ) {
        let Some(node) = self.slots[slot].node.as_ref().filter(|node| node.since <= since) else {
            return;
        };
        if self.is_off(slot) {
            return;
        }
        let loss = node.loss.unwrap_or(self.faults.loss);
        if happens(&mut self.random, loss) {
            self.counted.lost += 1;
            let (at, receiver) = (Instant::from_nanos(self.now), self.id(slot));
            return observer(&Event::Lost { at, receiver, frame: *frame });
        }
        self.handle(slot, Input::Frame(frame));
    }

    pub(super) fn handle(&mut self, slot: usize, input: Input<'_>) {
        let Some(node) = self.slots[slot].node.as_mut() else {
            return;
        };
        node.station.handle(Instant::from_nanos(self.now), input);
        node.stalled = false;
        node.turns = 0;
        if !node.asked {
            node.asked = true;
            self.asking.push(slot);
        }
        self.schedule.set(slot, nanos(node.station.deadline()));
    }

    fn fail(&mut self, unacknowledged: bool, observer: &mut impl FnMut(&Event)) {
        for slot in std::mem::take(&mut self.senders) {
            let Some(node) = self.slots[slot].node.as_mut() else { continue };
            // Want of an acknowledge makes nobody bus-off, nor does the noise of the whole wire.
            if !unacknowledged && node.corruption.is_some() {
                node.errors.failed();
            } else {
                node.errors.failed_at_most_passive();
            }
            let too_many = node.errors.bus_off();
            if let Some(mail) = node.mailbox.as_mut() {
                mail.unacknowledged |= unacknowledged;
            }
            if too_many {
                self.leave(slot, observer);
            }
        }
    }

    /// What the frame on the wire becomes when the station in `slot` has just left the bus or lost
    /// power.
    pub(super) fn lose_sender(&mut self, slot: usize) {
        self.senders.retain(|&sender| sender != slot);
        let other_sender = self.senders.first().map(|&sender| self.id(sender));
        let acknowledged = self.taking_part > self.senders.len();
        let Phase::Frame { outcome, from, .. } = &mut self.phase else {
            return;
        };
        if let Some(sender) = other_sender {
            *from = sender;
            if *outcome == Outcome::Delivered && !acknowledged {
                *outcome = Outcome::Unacknowledged;
            }
        } else if *outcome != Outcome::Destroyed {
            *outcome = Outcome::Destroyed;
            let error_frame = u64::from(Sequence::destroyed_bits(0)) * self.bit_nanos;
            self.phase_end = self.now.saturating_add(error_frame);
        }
    }

    fn police(&mut self, frame: &Frame, from: NodeId, observer: &mut impl FnMut(&Event)) {
        let slot = from.slot as usize;
        if let Some(rule) = rules::frame_breaks(frame) {
            self.report(slot, rule, observer);
        }
        for index in 0..self.rules.len() {
            let Some(node) = self.slots[slot].node.as_ref() else { return };
            if let Some(rule) = self.rules[index](frame, &node.name) {
                self.report(slot, rule, observer);
            }
        }
    }

    fn report(&mut self, slot: usize, rule: String, observer: &mut impl FnMut(&Event)) {
        let Some(node) = self.slots[slot].node.as_ref() else { return };
        self.counted.violations += 1;
        let (at, station) = (Instant::from_nanos(self.now), node.name.clone());
        observer(&Event::Violation { at, station, rule });
    }

    pub(super) fn id(&self, slot: usize) -> NodeId {
        NodeId { slot: slot as u32, generation: self.slots[slot].generation }
    }

    fn mail(&self, slot: usize) -> Option<&Mail> {
        self.slots[slot].node.as_ref().and_then(|node| node.mailbox.as_ref())
    }

    fn mail_mut(&mut self, slot: usize) -> Option<&mut Mail> {
        self.slots[slot].node.as_mut().and_then(|node: &mut Attached<N>| node.mailbox.as_mut())
    }
}

impl Mail {
    fn new(frame: Frame) -> Self {
        let sequence = Sequence::of(&frame);
        Self { frame, sequence, collided: false, unacknowledged: false }
    }
}

fn nanos(deadline: Option<Instant>) -> u64 {
    deadline.map_or(NEVER, Instant::as_nanos)
}
