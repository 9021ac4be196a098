//! The course of events: deadlines, telegrams that begin, characters that end.

use codewheel_station::Instant;
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use fastrand::Rng;

use super::{Attached, Wire};
use crate::chance::happens;
use crate::rs485::police::{MICROSECOND_CLOCK, Speaker};
use crate::rs485::speaking::Speaking;
use crate::rs485::{Event, Hearing};
use crate::schedule::NEVER;

/// How often a station may be called within [`WINDOW`] before it counts as stuck.
const TURNS: u32 = 1_000;
/// 100 µs: no station has a thousand things to do in it.
const WINDOW: u64 = 100_000;

/// A station whose deadline has passed but which cannot be rid of its telegram yet, because it is
/// still sending another, is advanced once in this time: a deadline that lies hidden behind the
/// first must not wait for that.
const PATIENCE: u64 = 1_000_000;

impl<N: Node> Wire<N> {
    /// Does everything due at this moment, once. What becomes due by that is left to the next step.
    pub(super) fn step(&mut self, observer: &mut impl FnMut(&Event)) {
        self.end_characters(observer);
        while let Some(slot) = self.schedule.due(self.now) {
            self.advance(slot, observer);
        }
        self.ask(observer);
    }

    fn advance(&mut self, slot: usize, observer: &mut impl FnMut(&Event)) {
        self.schedule.set(slot, NEVER);
        let Some(node) = self.slots[slot].node.as_mut() else {
            return;
        };
        if self.now - node.turns_since >= WINDOW {
            (node.turns, node.turns_since) = (0, self.now);
        }
        node.turns += 1;
        if node.turns > TURNS {
            node.stalled = true;
            let rule = format!(
                "asks to be called again and again: {TURNS} turns within 100 µs, and its deadline \
                 does not move on; it is left alone until its next input"
            );
            return self.report(slot, rule, observer);
        }
        node.station.advance(Instant::from_nanos(self.now));
        if !node.asked {
            node.asked = true;
            self.asking.push(slot);
        }
    }

    /// Asks all that were called in this step.
    fn ask(&mut self, observer: &mut impl FnMut(&Event)) {
        let now = Instant::from_nanos(self.now);
        let mut asking = std::mem::take(&mut self.asking);
        for slot in asking.drain(..) {
            let Some(node) = self.slots[slot].node.as_mut() else {
                continue;
            };
            node.asked = false;
            if node.stalled {
                continue;
            }
            let rate = node.station.baud_rate();
            if std::mem::replace(&mut node.rate, rate) != rate {
                self.attentive_at = None;
            }
            let said = if node.speaks { None } else { node.station.transmit(now) };
            let said = said.filter(|said| !said.octets().is_empty());
            let mut deadline = node.station.deadline().map_or(NEVER, Instant::as_nanos);
            if deadline <= self.now && (node.speaks || said.is_some()) {
                deadline = self.now.saturating_add(PATIENCE);
            }
            self.schedule.set(slot, deadline);
            if let Some(said) = said {
                self.begin(slot, said, observer);
            }
        }
        self.asking = asking;
    }

    fn begin(&mut self, slot: usize, said: Transmission, observer: &mut impl FnMut(&Event)) {
        let from = self.id(slot);
        let Some(node) = self.slots[slot].node.as_mut() else { return };
        node.speaks = true;
        self.last_rate = Some(node.rate);
        let mut speaking = Speaking::new(from, said, node.rate, self.now);
        let length = speaking.length();
        if happens(&mut self.random, node.corruption.unwrap_or(self.faults.corruption)) {
            speaking.broken_from = self.random.u32(..length);
        }
        if length > 1 && happens(&mut self.random, self.faults.pause) {
            speaking.pause = Some((self.random.u32(..length - 1), self.random.u32(11..=66)));
        }
        self.deafen(&mut speaking, observer);
        let interrupts = self.speaking.iter().any(|other| other.is_within_character(self.now));
        self.collide(&mut speaking, observer);
        self.police_begin(slot, &mut speaking, interrupts, observer);
        if self.speaking.is_empty() {
            self.busy_since = self.now;
        }
        self.speaking.push(speaking);
    }

    fn deafen(&mut self, speaking: &mut Speaking, observer: &mut impl FnMut(&Event)) {
        for slot in 0..self.slots.len() {
            let Some(node) = self.slots[slot].node.as_ref() else { continue };
            let receiver = self.id(slot);
            let loss = node.loss.unwrap_or(self.faults.loss);
            if receiver != speaking.from && happens(&mut self.random, loss) {
                speaking.deaf.push(slot);
                self.counted.lost += 1;
                let (at, octets) = (Instant::from_nanos(self.now), speaking.sent);
                observer(&Event::Lost { at, receiver, octets });
            }
        }
    }

    fn collide(&mut self, speaking: &mut Speaking, observer: &mut impl FnMut(&Event)) {
        let mut on_line = std::mem::take(&mut self.speaking);
        for other in &mut on_line {
            let until = other.end().min(speaking.end());
            other.collides_until = other.collides_until.max(until);
            speaking.collides_until = speaking.collides_until.max(until);
            self.counted.collisions += 1;
            let name = |id| self.name(id).unwrap_or("a station that lost its power").to_owned();
            let at = Instant::from_nanos(self.now);
            let (first, second) = (name(other.from), name(speaking.from));
            observer(&Event::Collision { at, first, second });
        }
        self.speaking = on_line;
    }

    fn police_begin(
        &mut self,
        slot: usize,
        speaking: &mut Speaking,
        interrupts: bool,
        observer: &mut impl FnMut(&Event),
    ) {
        let Some(node) = self.slots[slot].node.as_ref() else { return };
        let (broken, rightful) = self.police.begins(&Speaker {
            slot,
            name: &node.name,
            octets: speaking.sent.octets(),
            rate: speaking.rate,
            begin: speaking.begin,
            grant: if node.attachment.microsecond_clock { MICROSECOND_CLOCK } else { 0 },
            interrupts,
        });
        speaking.rightful = rightful;
        for rule in broken {
            self.report(slot, rule, observer);
        }
    }

    fn end_characters(&mut self, observer: &mut impl FnMut(&Event)) {
        if self.speaking.is_empty() {
            return;
        }
        let mut on_line = std::mem::take(&mut self.speaking);
        on_line.retain_mut(|speaking| {
            if speaking.character_end() > self.now {
                return true;
            }
            self.end_character(speaking, observer);
            if speaking.is_last() {
                self.end(speaking, observer);
                return false;
            }
            speaking.place += 1;
            true
        });
        if on_line.is_empty() {
            let spoken = Instant::from_nanos(self.now).since(Instant::from_nanos(self.busy_since));
            self.counted.busy = self.counted.busy + spoken;
        }
        self.speaking = on_line;
    }

    fn end_character(&mut self, speaking: &mut Speaking, observer: &mut impl FnMut(&Event)) {
        let at = Instant::from_nanos(self.now);
        let from = speaking.from;
        self.counted.characters += 1;
        self.police.character_ended(self.now);
        let mut octet = speaking.octet();
        let broken = speaking.is_broken() || happens(&mut self.random, self.faults.broken);
        if broken {
            self.counted.broken += 1;
            (speaking.intact, speaking.unbroken) = (false, false);
            observer(&Event::BrokenCharacter { at, from });
        } else if happens(&mut self.random, self.faults.flipped) {
            let sent = octet;
            let first = self.random.u32(..8);
            octet ^= 1 << first | 1 << ((first + self.random.u32(1..8)) % 8);
            speaking.intact = false;
            observer(&Event::Flipped { at, from, sent, carried: octet });
        }
        speaking.carry(octet);
        self.deliver(speaking, (!broken).then_some(octet));
        if let Some((_, bits)) = speaking.pause.filter(|&(behind, _)| behind == speaking.place) {
            (speaking.intact, speaking.unbroken) = (false, false);
            observer(&Event::Pause { at, from, bits });
        }
    }

    fn end(&mut self, speaking: &Speaking, observer: &mut impl FnMut(&Event)) {
        let Speaking { from, sent: octets, intact, .. } = *speaking;
        let slot = from.slot as usize;
        let carried = speaking.unbroken.then(|| speaking.carried_from(0));
        self.police.ended(slot, self.now, carried, speaking.rightful);
        let count = if intact { &mut self.counted.telegrams } else { &mut self.counted.disturbed };
        *count += 1;
        let (begin, end) = (Instant::from_nanos(speaking.begin), Instant::from_nanos(self.now));
        observer(&Event::Telegram { from, octets, begin, end, intact });
        if let Some(node) = self.attached_mut(from) {
            node.speaks = false;
            if !node.asked {
                node.asked = true;
                self.asking.push(slot);
            }
        }
    }

    /// Hands the character that has just ended to all that hear it; `None` is a broken one.
    fn deliver(&mut self, speaking: &mut Speaking, octet: Option<u8>) {
        let begin = speaking.begin_of(speaking.place);
        let alone = [octet.unwrap_or_default()];
        let character =
            if octet.is_some() { Input::Octets(&alone) } else { Input::BrokenCharacter };

        let pauses = speaking.pause.is_some_and(|(behind, _)| behind == speaking.place);
        let (portion, portion_begin) = if !speaking.unbroken {
            (Some(character), begin)
        } else if speaking.place == 0 || speaking.is_last() || pauses {
            let octets = speaking.carried_from(speaking.handed);
            (Some(Input::Octets(octets)), speaking.begin_of(speaking.handed))
        } else {
            (None, begin)
        };

        let said = Said { speaking, character, begin, portion, portion_begin };
        if portion.is_some() {
            for slot in 0..self.slots.len() {
                self.hear(slot, &said);
            }
        } else {
            let attentive = self.take_attentive(speaking.rate);
            for &slot in &attentive {
                self.hear(slot, &said);
            }
            self.attentive = attentive;
        }
        if portion.is_some() {
            speaking.handed = speaking.place + 1;
        }
    }

    /// Those to whom a character matters that is not the end of a portion.
    fn take_attentive(&mut self, rate: BaudRate) -> Vec<usize> {
        let mut attentive = std::mem::take(&mut self.attentive);
        if self.attentive_at.replace(rate) != Some(rate) {
            attentive.clear();
            attentive.extend((0..self.slots.len()).filter(|&slot| {
                self.slots[slot].node.as_ref().is_some_and(|node| {
                    node.rate != rate || node.attachment.hearing == Hearing::Characters
                })
            }));
        }
        attentive
    }

    fn hear(&mut self, slot: usize, said: &Said<'_>) {
        let own = said.speaking.from == self.id(slot);
        let Some(node) = self.slots[slot].node.as_mut() else { return };
        let speaks = node.speaks && !(own && node.attachment.echo);
        if speaks || node.since > said.begin || said.speaking.deaf.contains(&slot) {
            return;
        }
        let garbled;
        let input = if node.rate != said.speaking.rate {
            match node.mishear(said.begin, self.now, said.speaking.is_last(), &mut self.random) {
                None => return,
                Some(None) => Input::BrokenCharacter,
                Some(Some(octet)) => {
                    garbled = [octet];
                    Input::Octets(&garbled)
                }
            }
        } else {
            match (node.attachment.hearing, said.portion) {
                (Hearing::Characters, _) => said.character,
                (Hearing::Telegrams, Some(portion)) if node.since <= said.portion_begin => portion,
                (Hearing::Telegrams, _) => return,
            }
        };
        node.station.handle(Instant::from_nanos(self.now), input);
        node.stalled = false;
        node.turns = 0;
        if !node.asked {
            node.asked = true;
            self.asking.push(slot);
        }
    }

    fn report(&mut self, slot: usize, rule: String, observer: &mut impl FnMut(&Event)) {
        let Some(node) = self.slots[slot].node.as_ref() else { return };
        self.counted.violations += 1;
        let (at, station) = (Instant::from_nanos(self.now), node.name.clone());
        observer(&Event::Violation { at, station, rule });
    }
}

/// What there is to hear at the end of a character.
struct Said<'a> {
    speaking: &'a Speaking,
    character: Input<'a>,
    begin: u64,
    /// What those hear who hear telegrams.
    portion: Option<Input<'a>>,
    portion_begin: u64,
}

impl<N> Attached<N> {
    /// What it makes of a character at another rate than its own: nothing until its own character
    /// would be over, then mostly a broken one, `Some(None)`, and sometimes an octet.
    fn mishear(
        &mut self,
        begin: u64,
        end: u64,
        last: bool,
        random: &mut Rng,
    ) -> Option<Option<u8>> {
        self.misheard_since = self.misheard_since.min(begin);
        let over = end - self.misheard_since >= self.rate.characters(1).as_nanos();
        if !over && !last {
            return None;
        }
        self.misheard_since = NEVER;
        Some((random.u8(..4) == 0).then(|| random.u8(..)))
    }
}
