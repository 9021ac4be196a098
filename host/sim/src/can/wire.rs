//! The wire: who is on it, and what its owner can ask and change.

mod bus_off;
mod course;

use std::fmt;

use codewheel_station::can::{BitRate, Filter, Frame, Input};
use codewheel_station::{Duration, Instant, Station};
use fastrand::Rng;

use super::bits::Sequence;
use super::errors::TransmitErrors;
use super::takers::Takers;
use super::{Event, Faults, Rule, Statistics};
use crate::schedule::{NEVER, Schedule};
use bus_off::Off;

/// A [`Station`] that speaks CAN. Every such station is one.
pub trait Node: for<'a> Station<Input<'a> = Input<'a>, Output = Frame> {}

impl<N: for<'a> Station<Input<'a> = Input<'a>, Output = Frame>> Node for N {}

/// A station on a wire, as named by [`Wire::attach`]. Once detached it never names another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct NodeId {
    slot: u32,
    generation: u32,
}

/// A CAN segment in virtual time, which begins at [`Instant::ZERO`].
///
/// Whoever owns it calls [`run_until`](Self::run_until); several wires run together when each is
/// run until the least of their [`next_event`](Self::next_event)s.
///
/// Each station has one mailbox, as the simplest controller: what it hands out waits there until it
/// is sent, and meanwhile it is not asked for more. Stations are asked at bus idle, so a frame is as
/// fresh as the moment its arbitration begins. Where a frame arrives at the moment of a deadline,
/// the frame comes first.
pub struct Wire<N> {
    bit_nanos: u64,
    now: u64,
    slots: Vec<Slot<N>>,
    /// How many stations are switched on and not bus-off: they acknowledge each other.
    taking_part: usize,
    /// The stations whose controllers have left the bus.
    off: Vec<Off>,
    schedule: Schedule,
    takers: Takers,
    /// Slots to be asked for a frame at the next idle moment; [`Attached::asked`] holds them once.
    asking: Vec<usize>,
    waiting: Vec<Waiting>,
    phase: Phase,
    phase_since: u64,
    /// [`NEVER`] while the wire is idle.
    phase_end: u64,
    /// The slots that send the frame on the wire. More than one where they all send the same
    /// frame, or where they collide.
    senders: Vec<usize>,
    faults: Faults,
    random: Rng,
    rules: Vec<Rule>,
    /// Counted so far, `busy` only up to the last change of phase.
    counted: Statistics,
}

struct Slot<N> {
    generation: u32,
    node: Option<Attached<N>>,
}

struct Attached<N> {
    station: N,
    name: String,
    terminated: bool,
    /// A controller does not take the rest of a frame that began before it.
    since: u64,
    loss: Option<f64>,
    corruption: Option<f64>,
    mailbox: Option<Mail>,
    errors: TransmitErrors,
    /// Whether the slot is in [`Wire::asking`].
    asked: bool,
    /// The deadline has passed and only `transmit`, which has to wait, can move it.
    overdue: bool,
    /// Called too often without progress; left alone until its next input.
    stalled: bool,
    turns: u32,
    turns_since: u64,
}

struct Mail {
    frame: Frame,
    sequence: Sequence,
    /// A collision of this frame has been reported.
    collided: bool,
    /// It has been tried with nobody there to acknowledge it.
    unacknowledged: bool,
}

/// A full mailbox, as arbitration sees it.
struct Waiting {
    key: u32,
    slot: usize,
}

enum Phase {
    Idle,
    Frame { frame: Frame, from: NodeId, bits: u32, outcome: Outcome },
    Intermission,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Delivered,
    Destroyed,
    Unacknowledged,
}

impl<N: Node> Wire<N> {
    /// An idle wire without stations and without faults. What faults there will be is drawn from
    /// `seed`: the same stations, calls and seed give the same events.
    #[must_use]
    pub fn new(bit_rate: BitRate, seed: u64) -> Self {
        Self {
            bit_nanos: bit_rate.bit_nanos(),
            now: 0,
            slots: Vec::new(),
            taking_part: 0,
            off: Vec::new(),
            schedule: Schedule::new(),
            takers: Takers::new(),
            asking: Vec::new(),
            waiting: Vec::new(),
            phase: Phase::Idle,
            phase_since: 0,
            phase_end: NEVER,
            senders: Vec::new(),
            faults: Faults::default(),
            random: Rng::with_seed(seed),
            rules: Vec::new(),
            counted: Statistics::default(),
        }
    }

    /// Plugs a station in and switches it on, now.
    ///
    /// `name` is what violations call it. It takes the standard frames that one of `filters` lets
    /// through, and none where there are none; extended frames have no filter and reach nobody.
    /// `terminated` says whether its terminating resistor is on.
    pub fn attach(
        &mut self,
        name: impl Into<String>,
        node: N,
        filters: &[Filter],
        terminated: bool,
    ) -> NodeId {
        let free = self.slots.iter().position(|slot| slot.node.is_none());
        let slot = free.unwrap_or_else(|| {
            self.slots.push(Slot { generation: 0, node: None });
            self.slots.len() - 1
        });
        self.slots[slot].node = Some(Attached {
            station: node,
            name: name.into(),
            terminated,
            since: self.now,
            loss: None,
            corruption: None,
            mailbox: None,
            errors: TransmitErrors::default(),
            asked: false,
            overdue: false,
            stalled: false,
            turns: 0,
            turns_since: self.now,
        });
        self.taking_part += 1;
        self.takers.set(slot, filters);
        self.schedule.set(slot, self.now);
        NodeId { slot: slot as u32, generation: self.slots[slot].generation }
    }

    /// Switches a station off and unplugs it; `None` where it is gone already. A frame it is just
    /// sending is destroyed.
    pub fn detach(&mut self, id: NodeId) -> Option<N> {
        let slot = self.slot_of(id)?;
        let node = self.slots[slot].node.take()?;
        self.slots[slot].generation = self.slots[slot].generation.wrapping_add(1);
        if self.is_off(slot) {
            self.off.retain(|off| off.slot != slot);
        } else {
            self.taking_part -= 1;
        }
        self.takers.set(slot, &[]);
        self.schedule.set(slot, NEVER);
        self.asking.retain(|&asked| asked != slot);
        self.waiting.retain(|waiting| waiting.slot != slot);
        self.lose_sender(slot);
        Some(node.station)
    }

    /// Gives a station other acceptance filters, for frames that end from now on. Does nothing for
    /// a station that is gone.
    pub fn set_filters(&mut self, id: NodeId, filters: &[Filter]) {
        if let Some(slot) = self.slot_of(id) {
            self.takers.set(slot, filters);
        }
    }

    /// Switches the terminating resistor of a station. Does nothing for a station that is gone.
    pub fn set_terminated(&mut self, id: NodeId, terminated: bool) {
        if let Some(node) = self.attached_mut(id) {
            node.terminated = terminated;
        }
    }

    /// The station; `None` where it is gone.
    #[must_use]
    pub fn node(&self, id: NodeId) -> Option<&N> {
        self.attached(id).map(|node| &node.station)
    }

    /// The station, to be changed; `None` where it is gone. The wire advances it and asks it for
    /// deadline and output anew when it runs next, without virtual time having to pass.
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

    /// The stations on the wire.
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, &N)> {
        (0..).zip(&self.slots).filter_map(|(slot, Slot { generation, node })| {
            let id = NodeId { slot, generation: *generation };
            node.as_ref().map(|node| (id, &node.station))
        })
    }

    /// Sets how often the wire fails, for frames that begin from now on.
    pub fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
    }

    /// Gives one station its own probability of missing a frame, 1 for a deaf one that still
    /// acknowledges; `None` returns it to [`Faults::loss`]. Does nothing for a station that is gone.
    pub fn set_loss_at(&mut self, id: NodeId, loss: Option<f64>) {
        if let Some(node) = self.attached_mut(id) {
            node.loss = loss;
        }
    }

    /// Gives one station its own probability that a frame it sends is destroyed, as a bad transceiver
    /// does; `None` returns it to [`Faults::corruption`]. Unlike that one it takes the station off the
    /// bus: each destroyed frame counts eight, each good one minus one, and above 255 its controller
    /// is [bus-off](Self::bus_off). Does nothing for a station that is gone.
    pub fn set_corruption_at(&mut self, id: NodeId, corruption: Option<f64>) {
        if let Some(node) = self.attached_mut(id) {
            node.corruption = corruption;
        }
    }

    /// Lets the controller of a station leave the bus, as after too many errors: the station gets
    /// [`Input::BusOff`], its mailbox is empty, and it neither hears, speaks nor acknowledges. A frame
    /// it is just sending is destroyed. After 128 times 11 recessive bits, 2.8 ms on an idle wire at
    /// 500k, it gets [`Input::Recovered`] and takes part again (ISO 11898-1, 12.1.4.4).
    ///
    /// Does nothing for a station that is gone or bus-off already.
    pub fn bus_off(&mut self, id: NodeId, observer: &mut impl FnMut(&Event)) {
        if let Some(slot) = self.slot_of(id) {
            self.leave(slot, observer);
            self.lose_sender(slot);
        }
    }

    /// Whether the controller of a station is bus-off.
    #[must_use]
    pub fn is_bus_off(&self, id: NodeId) -> bool {
        self.slot_of(id).is_some_and(|slot| self.is_off(slot))
    }

    /// Holds all frames from now on against one more rule.
    pub fn add_rule(&mut self, rule: Rule) {
        self.rules.push(rule);
    }

    /// The virtual time, at which everything due has been done unless a station was changed since.
    #[must_use]
    pub const fn now(&self) -> Instant {
        Instant::from_nanos(self.now)
    }

    /// When something happens next, not before [`now`](Self::now): a deadline, the end of a frame, the
    /// end of a bus-off, or now where a station was attached or changed. `None` where nothing will ever happen by
    /// itself.
    #[must_use]
    pub fn next_event(&self) -> Option<Instant> {
        let next = self.schedule.earliest().min(self.phase_end).min(self.next_recovery());
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
        let phase = match self.phase {
            Phase::Idle => 0,
            Phase::Frame { .. } | Phase::Intermission => self.now - self.phase_since,
        };
        let busy = self.counted.busy + Duration::from_nanos(phase);
        Statistics { at: self.now(), busy, ..self.counted }
    }

    /// What is wrong with the wire as it is wired, one sentence each; empty where nothing is.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let nodes = self.slots.iter().filter_map(|slot| slot.node.as_ref());
        let terminated: Vec<&str> =
            nodes.filter(|node| node.terminated).map(|node| node.name.as_str()).collect();
        let found = match terminated.as_slice() {
            [] => "no terminating resistor".to_owned(),
            [one] => format!("only one terminating resistor, at {one}"),
            [_, _] => return Vec::new(),
            more => format!("{} terminating resistors, at {}", more.len(), more.join(", ")),
        };
        vec![format!("the wire has {found}; it needs two, one at each end")]
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
