//! What a bus says by itself: who is there, who asks whom, and where shafts stand.

use codewheel_devicenet::explicit::{Header, Service, class};
use codewheel_devicenet::identifier::{
    CHANGE_ACKNOWLEDGE, CHANGE_OF_STATE_MESSAGE, DUPLICATE_MAC_CHECK, EXPLICIT_REQUEST,
    EXPLICIT_RESPONSE, POLL_COMMAND, POLL_RESPONSE, UNCONNECTED_REQUEST,
};
use codewheel_devicenet::{CheckMessage, Identifier, MacId};
use codewheel_station::can::{self, Frame};
use codewheel_station::{Duration, Instant};

use crate::{Owner, Role};

/// Group 1 messages 12 and 14: the responses to a multicast poll and to a bit-strobe.
const MULTICAST_RESPONSE: u8 = 12;
const STROBE_RESPONSE: u8 = 14;
/// Group 2 message 0: the bit-strobe command, which carries its source.
const STROBE_COMMAND: u8 = 0;
/// The response bit and service 4Dh of a device heartbeat.
const HEARTBEAT: u8 = 0xCD;
/// How long an explicit connection outlives its last request: four times 2500 ms.
const EXPLICIT_TIME: Duration = Duration::from_secs(10);
/// How long I/O data may be absent, at least, before they count as ended.
const IO_TIME: Duration = Duration::from_secs(2);
/// Within which time a check of a MAC ID is answered by a node that has it.
const CHECK_TIME: Duration = Duration::from_secs(2);

/// The pauses between things that come again and again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Intervals {
    /// How often it came.
    pub count: u64,
    /// When it came last.
    pub at: Option<Instant>,
    /// The last pause; zero before the second time.
    pub last: Duration,
    /// The shortest pause.
    pub shortest: Duration,
    /// The longest pause.
    pub longest: Duration,
}

impl Intervals {
    fn came(&mut self, now: Instant) {
        if let Some(at) = self.at {
            self.last = now.since(at);
            self.shortest = if self.count == 1 { self.last } else { self.shortest.min(self.last) };
            self.longest = self.longest.max(self.last);
        }
        self.at = Some(now);
        self.count += 1;
    }

    /// Whether it still comes: the last one is not longer ago than two seconds, or than four times
    /// the longest pause.
    #[must_use]
    pub fn goes_on(&self, now: Instant) -> bool {
        self.at.is_some_and(|at| now.since(at) < IO_TIME.max(self.longest.times(4)))
    }
}

/// What a slave produced: a poll response, a change of state, cyclic data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Production {
    /// When.
    pub at: Instant,
    octets: [u8; 8],
    length: u8,
}

impl Production {
    /// The octets, as they came.
    #[must_use]
    pub fn octets(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }
}

/// A device heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heartbeat {
    /// When.
    pub at: Instant,
    /// Identity attribute 8; 3 = operational.
    pub state: u8,
    /// Bit 1: a fault of the device.
    pub flags: u8,
}

/// What was heard of one address.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// When it sent something last.
    pub sent_at: Option<Instant>,
    /// When it asked somebody last, as masters do.
    pub asked_at: Option<Instant>,
    /// When it answered or produced last, as slaves do.
    pub answered_at: Option<Instant>,
    /// When a node checked last whether the address is free.
    pub checked_at: Option<Instant>,
    /// When a check of the address was answered: two nodes want it.
    pub contested_at: Option<Instant>,
    /// Poll commands to it.
    pub polls: Intervals,
    /// What it produced for another master, however that was asked for.
    pub productions: Intervals,
    /// What it produced last, for whomever.
    pub production: Option<Production>,
    /// Its last heartbeat.
    pub heartbeat: Option<Heartbeat>,
    /// Whose explicit requests it answered last, and when.
    pub master: Option<(MacId, Instant)>,
    /// The connections that were seen being allocated and not released.
    pub choice: u8,
    /// Who asked it last, over an explicit connection or to allocate one.
    question: Option<Question>,
}

/// An explicit request that waits for its response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Question {
    master: MacId,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The MAC ID is that of the allocator; only an owner gets the good answer.
    Allocate {
        choice: u8,
        allocator: MacId,
    },
    Release {
        choice: u8,
    },
    /// Over the explicit connection: only the owner gets any answer.
    Connected,
}

impl Heard {
    /// What it is, by what it does.
    #[must_use]
    pub const fn role(&self) -> Role {
        match (self.asked_at, self.answered_at) {
            (Some(_), _) => Role::Master,
            (None, Some(_)) => Role::Slave,
            (None, None) => Role::Unknown,
        }
    }

    /// Whether somebody else exchanges I/O data with it, or tries to.
    #[must_use]
    pub fn is_exchanging(&self, now: Instant) -> bool {
        self.polls.goes_on(now) || self.productions.goes_on(now)
    }

    /// To whom it belongs; `None` where nothing says that it belongs to another master.
    #[must_use]
    pub fn owner(&self, now: Instant) -> Option<Owner> {
        let asked = self.master.filter(|(_, at)| now.since(*at) < EXPLICIT_TIME);
        if !self.is_exchanging(now) && asked.is_none() {
            return None;
        }
        Some(self.master.map_or(Owner::Somebody, |(mac, _)| Owner::Master(mac.value())))
    }

    /// A node begins at this address, or ended: whoever it belonged to does not have it any more.
    const fn forget_master(&mut self) {
        self.master = None;
        self.choice = 0;
        self.question = None;
        self.polls.at = None;
        self.productions.at = None;
    }

    const fn asks(&mut self, now: Instant) {
        self.sent_at = Some(now);
        self.asked_at = Some(now);
    }

    fn checked(&mut self, now: Instant, is_response: bool) {
        if is_response {
            self.sent_at = Some(now);
            if self.checked_at.is_some_and(|at| now.since(at) < CHECK_TIME) {
                self.contested_at = Some(now);
            }
            return;
        }
        self.checked_at = Some(now);
        // Whoever has the address answers soon, and goes on as before.
        if self.sent_at.is_none_or(|at| now.since(at) > IO_TIME) {
            self.forget_master();
        }
    }

    fn produced(&mut self, now: Instant, data: &[u8], is_ours: bool) {
        self.answered_at = Some(now);
        if data.is_empty() {
            return;
        }
        if !is_ours {
            self.productions.came(now);
        }
        let mut production = Production { at: now, octets: [0; 8], length: data.len() as u8 };
        for (to, from) in production.octets.iter_mut().zip(data) {
            *to = *from;
        }
        self.production = Some(production);
    }

    fn asked(&mut self, master: MacId, message: u8, body: &[u8]) {
        let kind = match *body {
            [service, class::DEVICENET, 1, choice, allocator, ..]
                if service == Service::ALLOCATE.0 =>
            {
                Kind::Allocate { choice, allocator: MacId::from_low_bits(allocator.into()) }
            }
            [service, class::DEVICENET, 1, choice, ..] if service == Service::RELEASE.0 => {
                Kind::Release { choice }
            }
            _ if message == EXPLICIT_REQUEST => Kind::Connected,
            // What else the unconnected port is asked is a search, and no ownership.
            _ => return,
        };
        self.question = Some(Question { master, kind });
    }

    fn answered(&mut self, now: Instant, header: Header, body: &[u8]) {
        self.answered_at = Some(now);
        let Some(question) = self.question.take_if(|question| question.master == header.mac())
        else {
            return;
        };
        let Some(&service) = body.first() else { return };
        let is_good = service != Service::ERROR.response();
        match question.kind {
            Kind::Connected => self.master = Some((question.master, now)),
            Kind::Allocate { choice, allocator } if is_good => {
                self.choice |= choice;
                self.master = Some((allocator, now));
            }
            Kind::Release { choice } if is_good => {
                self.choice &= !choice;
                if self.choice == 0 {
                    self.forget_master();
                }
            }
            Kind::Allocate { .. } | Kind::Release { .. } => {}
        }
    }
}

/// All that was heard on a bus. It is fed with every frame of others from the beginning on.
#[derive(Clone, Debug)]
pub struct Overheard {
    since: Option<Instant>,
    frames: u64,
    nodes: [Heard; 64],
}

impl Default for Overheard {
    fn default() -> Self {
        Self { since: None, frames: 0, nodes: [Heard::default(); 64] }
    }
}

impl Overheard {
    /// For how long it has listened without a break.
    #[must_use]
    pub fn span(&self, now: Instant) -> Duration {
        self.since.map_or(Duration::ZERO, |since| now.since(since))
    }

    /// How many frames of others were heard.
    #[must_use]
    pub const fn frames(&self) -> u64 {
        self.frames
    }

    /// What was heard of `mac`.
    #[must_use]
    pub fn node(&self, mac: MacId) -> Heard {
        self.nodes.get(usize::from(mac.value())).copied().unwrap_or_default()
    }

    /// Every address of which something was heard: it sent, or was asked.
    pub fn nodes(&self) -> impl Iterator<Item = (MacId, &Heard)> {
        let heard = |heard: &Heard| {
            heard.sent_at.is_some() || heard.checked_at.is_some() || heard.polls.count != 0
        };
        (0..64).filter_map(MacId::new).zip(&self.nodes).filter(move |(_, node)| heard(node))
    }

    /// Those that may be the master of somebody whose master did not give its address: nodes that
    /// were heard and are no slaves.
    pub fn candidates(&self) -> impl Iterator<Item = MacId> {
        let is_candidate = |heard: &Heard| heard.sent_at.is_some() && heard.role() != Role::Slave;
        self.nodes().filter(move |(_, heard)| is_candidate(heard)).map(|(mac, _)| mac)
    }

    pub(super) const fn listens(&mut self, now: Instant) {
        if self.since.is_none() {
            self.since = Some(now);
        }
    }

    /// The bus could not be heard: what was heard before may be past.
    pub(super) const fn was_deaf(&mut self) {
        self.since = None;
    }

    fn change(&mut self, mac: MacId, change: impl FnOnce(&mut Heard)) {
        if let Some(node) = self.nodes.get_mut(usize::from(mac.value())) {
            change(node);
        }
    }

    /// Takes in a frame of another node. What a slave that is `ours` says does not make it another
    /// master's.
    pub(super) fn hear(&mut self, now: Instant, frame: &Frame, ours: impl Fn(MacId) -> bool) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        if frame.is_remote() {
            return;
        }
        self.frames += 1;
        let data = frame.data();
        match Identifier::from_bits(bits) {
            Identifier::Group1 { message, source } => self.change(source, |node| {
                node.sent_at = Some(now);
                if matches!(
                    message,
                    MULTICAST_RESPONSE | CHANGE_OF_STATE_MESSAGE | STROBE_RESPONSE | POLL_RESPONSE
                ) {
                    node.produced(now, data, ours(source));
                }
            }),
            Identifier::Group2 { mac, message } => self.group_2(now, mac, message, data, ours(mac)),
            Identifier::Group3 { source, .. } => {
                self.change(source, |node| node.sent_at = Some(now));
            }
            Identifier::Group4 { .. } | Identifier::Invalid(_) => {}
        }
    }

    fn group_2(&mut self, now: Instant, mac: MacId, message: u8, data: &[u8], is_ours: bool) {
        match (message, data) {
            (STROBE_COMMAND, _) => self.change(mac, |node| node.asks(now)),
            (POLL_COMMAND | CHANGE_ACKNOWLEDGE, _) => self.change(mac, |node| node.polls.came(now)),
            (EXPLICIT_REQUEST | UNCONNECTED_REQUEST, [header, body @ ..]) => {
                let master = Header(*header).mac();
                self.change(master, |asker| asker.asks(now));
                self.change(mac, |node| node.asked(master, message, body));
            }
            (EXPLICIT_RESPONSE, [header, body @ ..]) => self.change(mac, |node| {
                node.sent_at = Some(now);
                match *body {
                    [HEARTBEAT, _, _, state, flags, ..] if *header == mac.value() => {
                        node.heartbeat = Some(Heartbeat { at: now, state, flags });
                    }
                    _ if is_ours => node.answered_at = Some(now),
                    _ => node.answered(now, Header(*header), body),
                }
            }),
            (DUPLICATE_MAC_CHECK, _) => {
                if let Ok(check) = CheckMessage::parse(data) {
                    self.change(mac, |node| node.checked(now, check.response));
                }
            }
            _ => {}
        }
    }
}
