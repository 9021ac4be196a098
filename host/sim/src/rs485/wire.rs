//! The line: who is on it, and what its owner can ask and change.

mod course;

use std::fmt;

use codewheel_station::rs485::{BaudRate, Node};
use codewheel_station::{Duration, Instant};
use fastrand::Rng;

use super::police::Police;
use super::speaking::Speaking;
use super::{Attachment, Event, Faults, Statistics, longest_cable};
use crate::schedule::{NEVER, Schedule};

/// A station on a line, as named by [`Wire::attach`]. Once detached it never names another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeId {
    slot: u32,
    generation: u32,
}

/// An RS-485 line in virtual time, which begins at [`Instant::ZERO`].
///
/// Whoever owns it calls [`run_until`](Self::run_until); several wires run together when each is
/// run until the least of their [`next_event`](Self::next_event)s.
///
/// The line has no rate of its own: each station speaks at the rate it has when it begins, and the
/// rates of all are asked anew whenever they were called. What is said at another rate than a
/// station listens at comes to it as broken characters, and one in four as an octet drawn from the
/// seed.
///
/// Stations decide for themselves when they speak, since nobody arbitrates. Each is asked after each
/// call whether it has anything to say, and what it hands out begins at that moment; while it
/// speaks it is not asked, and hears at most itself. Where a character ends at the moment of a
/// deadline, the character comes first.
///
/// Three things are simpler than on copper. A character that overlaps with another speaker's is
/// broken for all, even where the two say the same. A station at another rate hears at most one
/// character for each that is said. And signals take no time to travel (100 m are 0.5 µs: 6 bits at 12M).
pub struct Wire<N> {
    now: u64,
    slots: Vec<Slot<N>>,
    schedule: Schedule,
    /// Slots to be asked for a telegram at this moment; [`Attached::asked`] holds them once.
    asking: Vec<usize>,
    /// The slots that hear each character at the rate of [`Wire::attentive_at`], or hear it wrongly.
    attentive: Vec<usize>,
    /// `None` where [`Wire::attentive`] must be made anew.
    attentive_at: Option<BaudRate>,
    /// What is being said, the earliest first. More than one where stations collide.
    speaking: Vec<Speaking>,
    /// Since when somebody speaks; means nothing while nobody does.
    busy_since: u64,
    faults: Faults,
    random: Rng,
    police: Police,
    cable_metres: Option<u32>,
    /// At which rate somebody spoke last.
    last_rate: Option<BaudRate>,
    /// Counted so far, `busy` only up to the last silence.
    counted: Statistics,
}

struct Slot<N> {
    generation: u32,
    node: Option<Attached<N>>,
}

struct Attached<N> {
    station: N,
    name: String,
    attachment: Attachment,
    rate: BaudRate,
    /// It does not hear what began before it was there.
    since: u64,
    loss: Option<f64>,
    corruption: Option<f64>,
    speaks: bool,
    /// The begin of the character it hears at the wrong rate; [`NEVER`] where it hears none.
    misheard_since: u64,
    /// Whether the slot is in [`Wire::asking`].
    asked: bool,
    /// Called too often without progress; left alone until its next input.
    stalled: bool,
    turns: u32,
    turns_since: u64,
}

impl<N: Node> Wire<N> {
    /// A silent line without stations and without faults. What faults there will be is drawn from
    /// `seed`: the same stations, calls and seed give the same events.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            now: 0,
            slots: Vec::new(),
            schedule: Schedule::new(),
            asking: Vec::new(),
            attentive: Vec::new(),
            attentive_at: None,
            speaking: Vec::new(),
            busy_since: 0,
            faults: Faults::default(),
            random: Rng::with_seed(seed),
            police: Police::default(),
            cable_metres: None,
            last_rate: None,
            counted: Statistics::default(),
        }
    }

    /// Plugs a station in and switches it on, now. `name` is what violations and collisions call it.
    pub fn attach(&mut self, name: impl Into<String>, node: N, attachment: Attachment) -> NodeId {
        let free = self.slots.iter().position(|slot| slot.node.is_none());
        let slot = free.unwrap_or_else(|| {
            self.slots.push(Slot { generation: 0, node: None });
            self.slots.len() - 1
        });
        self.slots[slot].node = Some(Attached {
            rate: node.baud_rate(),
            station: node,
            name: name.into(),
            attachment,
            since: self.now,
            loss: None,
            corruption: None,
            speaks: false,
            misheard_since: NEVER,
            asked: false,
            stalled: false,
            turns: 0,
            turns_since: self.now,
        });
        self.schedule.set(slot, self.now);
        self.attentive_at = None;
        NodeId { slot: slot as u32, generation: self.slots[slot].generation }
    }

    /// Switches a station off and unplugs it; `None` where it is gone already. What it is just
    /// saying breaks off in the middle of a character.
    pub fn detach(&mut self, id: NodeId) -> Option<N> {
        let slot = self.slot_of(id)?;
        let node = self.slots[slot].node.take()?;
        self.slots[slot].generation = self.slots[slot].generation.wrapping_add(1);
        self.schedule.set(slot, NEVER);
        self.asking.retain(|&asked| asked != slot);
        for speaking in self.speaking.iter_mut().filter(|speaking| speaking.from == id) {
            speaking.cut();
        }
        Some(node.station)
    }

    /// Switches the terminating resistors of a station. Does nothing for a station that is gone.
    pub fn set_terminated(&mut self, id: NodeId, terminated: bool) {
        if let Some(node) = self.attached_mut(id) {
            node.attachment.terminated = terminated;
        }
    }

    /// Says how long the cable is, in metres. This changes nothing but [`warnings`](Self::warnings).
    pub const fn set_cable_length(&mut self, metres: u32) {
        self.cable_metres = Some(metres);
    }

    /// The station; `None` where it is gone.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Option<&N> {
        self.attached(id).map(|node| &node.station)
    }

    /// The station, to be changed; `None` where it is gone. The wire advances it and asks it for
    /// rate, deadline and telegram anew when it runs next, without virtual time having to pass.
    pub fn node_mut(&mut self, id: NodeId) -> Option<&mut N> {
        let slot = self.slot_of(id)?;
        self.schedule.set(slot, self.now);
        let node = self.slots[slot].node.as_mut()?;
        node.stalled = false;
        node.turns = 0;
        Some(&mut node.station)
    }

    /// The name a station was attached with; `None` where it is gone.
    #[must_use]
    pub fn name(&self, id: NodeId) -> Option<&str> {
        self.attached(id).map(|node| node.name.as_str())
    }

    /// The stations on the line.
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, &N)> {
        (0..).zip(&self.slots).filter_map(|(slot, Slot { generation, node })| {
            let id = NodeId { slot, generation: *generation };
            node.as_ref().map(|node| (id, &node.station))
        })
    }

    /// Sets how often the line fails: for telegrams that begin, and characters that end, from now
    /// on.
    pub fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
    }

    /// Gives one station its own probability of not hearing a telegram, 1 for a deaf one; `None`
    /// returns it to [`Faults::loss`]. Does nothing for a station that is gone.
    pub fn set_loss_at(&mut self, id: NodeId, loss: Option<f64>) {
        if let Some(node) = self.attached_mut(id) {
            node.loss = loss;
        }
    }

    /// Gives one station its own probability that what it says is destroyed, as a bad driver does;
    /// `None` returns it to [`Faults::corruption`]. Does nothing for a station that is gone.
    pub fn set_corruption_at(&mut self, id: NodeId, corruption: Option<f64>) {
        if let Some(node) = self.attached_mut(id) {
            node.corruption = corruption;
        }
    }

    /// The virtual time, at which everything due has been done unless a station was changed since.
    #[must_use]
    pub const fn now(&self) -> Instant {
        Instant::from_nanos(self.now)
    }

    /// When something happens next, not before [`now`](Self::now): a deadline, the end of a character, or
    /// now where a station was attached or changed. `None` where nothing will ever happen by itself.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        let ends = self.speaking.iter().map(|speaking| speaking.character_end());
        let next = ends.fold(self.schedule.earliest(), u64::min);
        (next != NEVER).then(|| Instant::from_nanos(next.max(self.now)))
    }

    /// Moves time on to `until`, from event to event, and does everything due up to then and at
    /// that moment. A moment that has passed moves nothing.
    pub fn run_until(&mut self, until: Instant, observer: &mut impl FnMut(&Event)) {
        while let Some(next) = self.next_event().filter(|&next| next <= until) {
            self.now = next.as_nanos();
            self.step(observer);
        }
        self.now = self.now.max(until.as_nanos());
    }

    /// What has been counted up to now. Two of them give the bus load between them.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        let spoken = if self.speaking.is_empty() { 0 } else { self.now - self.busy_since };
        let busy = self.counted.busy + Duration::from_nanos(spoken);
        Statistics { at: self.now(), busy, ..self.counted }
    }

    /// What is wrong with the line as it is wired, one sentence each; empty where nothing is. The
    /// cable is judged by the rate at which somebody spoke last.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.wrong_termination().into_iter().chain(self.long_cable()).collect()
    }

    fn wrong_termination(&self) -> Option<String> {
        let nodes = self.slots.iter().filter_map(|slot| slot.node.as_ref());
        let terminated: Vec<&str> = nodes
            .filter(|node| node.attachment.terminated)
            .map(|node| node.name.as_str())
            .collect();
        let found = match terminated.as_slice() {
            [] => "no termination".to_owned(),
            [one] => format!("only one termination, at {one}"),
            [_, _] => return None,
            more => format!("{} terminations, at {}", more.len(), more.join(", ")),
        };
        Some(format!("the wire has {found}; it needs two, one at each end"))
    }

    fn long_cable(&self) -> Option<String> {
        let (metres, rate) = (self.cable_metres?, self.last_rate?);
        let longest = longest_cable(rate);
        (metres > longest).then(|| {
            format!("the cable is {metres} m long; at {rate} it may have at most {longest} m")
        })
    }

    fn id(&self, slot: usize) -> NodeId {
        NodeId { slot: slot as u32, generation: self.slots[slot].generation }
    }

    fn slot_of(&self, id: NodeId) -> Option<usize> {
        let slot = self.slots.get(id.slot as usize)?;
        (slot.generation == id.generation && slot.node.is_some()).then_some(id.slot as usize)
    }

    fn attached(&self, id: NodeId) -> Option<&Attached<N>> {
        self.slot_of(id).and_then(|slot| self.slots[slot].node.as_ref())
    }

    fn attached_mut(&mut self, id: NodeId) -> Option<&mut Attached<N>> {
        self.slot_of(id).and_then(|slot| self.slots[slot].node.as_mut())
    }
}

impl<N> fmt::Debug for Wire<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.slots.iter().filter_map(|slot| slot.node.as_ref().map(|node| &node.name));
        f.debug_struct("Wire")
            .field("now", &Instant::from_nanos(self.now))
            .field("nodes", &names.collect::<Vec<_>>())
            .field("counted", &self.counted)
            .finish_non_exhaustive()
    }
}
