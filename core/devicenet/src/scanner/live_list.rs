//! The live list: which of the 64 addresses have a node.
//!
//! First the scanner listens, then it asks each address that has not answered, twice, for its
//! vendor on the unconnected port of a Group 2 Only Server. One that is on-line refuses (02/03),
//! one that checks its MAC ID ignores it; nobody is harmed. A [forced](Probing::Forced) scan also
//! sends addresses that stayed silent a duplicate MAC ID check request, which every node on-line
//! answers, but which would drive a node into communication fault that checks its MAC ID just then.

use codewheel_station::can::Frame;
use codewheel_station::{Deadline, Duration, Instant};

use crate::explicit::{Header, Service, class};
use crate::identifier::{
    DUPLICATE_MAC_CHECK, EXPLICIT_REQUEST, EXPLICIT_RESPONSE, Identifier, UNCONNECTED_REQUEST,
    group_2,
};
use crate::{CheckMessage, MacId};

/// How long the scanner listens first. A node that checks its MAC ID sends something, or is
/// on-line, within a second.
const LISTEN_TIME: Duration = Duration::from_millis(1_100);
/// The pause between two probes.
const PROBE_TIME: Duration = Duration::from_millis(10);
/// How long late answers are waited for at the end of a round.
const ANSWER_TIME: Duration = Duration::from_millis(300);
/// How often an address is asked.
const ROUNDS: u8 = 2;
/// When a scan ends at the latest, however slow the medium is.
const SCAN_TIME: Duration = Duration::from_secs(10);

/// How far a scan goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Probing {
    /// Asks for the vendor code on the unconnected port: harmless.
    Gentle,
    /// Afterwards sends a duplicate MAC ID check request to each address still silent. A node that
    /// checks its MAC ID at that moment goes to communication fault; addresses that were heard
    /// checking are spared.
    Forced,
}

/// What is known of an address.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Presence {
    /// Nothing was heard of it.
    #[default]
    Silent,
    /// A node with this address sends something.
    Seen,
    /// A node with this address answered the scanner.
    Answers,
    /// A node checks whether the address is free: it will be on-line within two seconds.
    Checking,
    /// The scanner's own address.
    Scanner,
}

/// How far a scan is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScanProgress {
    /// None was asked for: the list says what was heard so far.
    #[default]
    NotBegun,
    /// The scanner listens.
    Listening,
    /// The scanner asks one address after the other.
    Probing {
        /// How much of it is done, 0 … 100.
        percent: u8,
    },
    /// It is done.
    Complete,
    /// The scanner left the bus, or nothing could be sent for ten seconds.
    Aborted,
}

/// The 64 addresses of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LiveList {
    /// What is known of each address, by address.
    pub nodes: [Presence; 64],
    /// How far the scan is.
    pub progress: ScanProgress,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    NotBegun,
    Listening,
    /// Address `next` and what follows are to be asked.
    Probing {
        round: u8,
        next: u32,
    },
    Complete,
    Aborted,
}

#[derive(Clone, Debug)]
pub(super) struct LiveScan {
    mac: MacId,
    phase: Phase,
    probing: Probing,
    /// The end of a pause; never while a probe is owed, or nothing goes on.
    waits_until: Deadline,
    /// When the scan ends at the latest.
    ends_at: Deadline,
    /// The addresses as bits.
    seen: u64,
    answers: u64,
    checking: u64,
}

const fn bit(mac: MacId) -> u64 {
    1 << mac.value()
}

impl LiveScan {
    pub(super) const fn new(mac: MacId) -> Self {
        Self {
            mac,
            phase: Phase::NotBegun,
            probing: Probing::Gentle,
            waits_until: Deadline::NEVER,
            ends_at: Deadline::NEVER,
            seen: 0,
            answers: 0,
            checking: 0,
        }
    }

    /// Begins anew, whatever was going on.
    pub(super) fn begin(&mut self, now: Instant, probing: Probing) {
        *self = Self {
            phase: Phase::Listening,
            probing,
            waits_until: Deadline::at(now + LISTEN_TIME),
            ends_at: Deadline::at(now + SCAN_TIME),
            ..Self::new(self.mac)
        };
    }

    /// Ends a scan before its time.
    pub(super) const fn abort(&mut self) {
        if matches!(self.phase, Phase::Listening | Phase::Probing { .. }) {
            self.end(Phase::Aborted);
        }
    }

    const fn end(&mut self, phase: Phase) {
        self.phase = phase;
        self.waits_until = Deadline::NEVER;
        self.ends_at = Deadline::NEVER;
    }

    /// A frame arrived: who has sent it?
    #[inline]
    pub(super) fn heard(&mut self, identifier: Identifier, data: &[u8]) {
        let header = data.first().map(|octet| Header(*octet));
        match identifier {
            Identifier::Group1 { source, .. } | Identifier::Group3 { source, .. } => {
                self.saw(source);
            }
            Identifier::Group2 { mac, message: DUPLICATE_MAC_CHECK } => {
                match CheckMessage::parse(data) {
                    Ok(CheckMessage { response: true, .. }) => {
                        self.saw(mac);
                        self.answers |= bit(mac);
                    }
                    Ok(_) => {
                        self.checking |= bit(mac);
                        self.seen &= !bit(mac);
                        self.answers &= !bit(mac);
                    }
                    Err(_) => {}
                }
            }
            // The destination is in the identifier, the master in the header.
            Identifier::Group2 { message: EXPLICIT_REQUEST | UNCONNECTED_REQUEST, .. } => {
                if let Some(header) = header {
                    self.saw(header.mac());
                }
            }
            Identifier::Group2 { mac, message: EXPLICIT_RESPONSE } => {
                self.saw(mac);
                if header.is_some_and(|header| header.mac() == self.mac) {
                    self.answers |= bit(mac);
                }
            }
            // The bit-strobe command carries its source.
            Identifier::Group2 { mac, message: 0 } => self.saw(mac),
            Identifier::Group2 { .. } | Identifier::Group4 { .. } | Identifier::Invalid(_) => {}
        }
    }

    #[inline]
    const fn saw(&mut self, mac: MacId) {
        self.seen |= bit(mac);
        self.checking &= !bit(mac);
    }

    /// The list, without what the scan list knows.
    pub(super) fn list(&self) -> LiveList {
        let mut nodes = [Presence::Silent; 64];
        for (node, mac) in nodes.iter_mut().zip((0..64).filter_map(MacId::new)) {
            *node = if mac == self.mac {
                Presence::Scanner
            } else if self.answers & bit(mac) != 0 {
                Presence::Answers
            } else if self.seen & bit(mac) != 0 {
                Presence::Seen
            } else if self.checking & bit(mac) != 0 {
                Presence::Checking
            } else {
                Presence::Silent
            };
        }
        let progress = match self.phase {
            Phase::NotBegun => ScanProgress::NotBegun,
            Phase::Listening => ScanProgress::Listening,
            Phase::Probing { round, next } => {
                let done = u32::from(round) * 64 + next;
                let percent = done * 100 / (u32::from(self.rounds()) * 64);
                ScanProgress::Probing { percent: percent.min(100) as u8 }
            }
            Phase::Complete => ScanProgress::Complete,
            Phase::Aborted => ScanProgress::Aborted,
        };
        LiveList { nodes, progress }
    }

    const fn rounds(&self) -> u8 {
        match self.probing {
            Probing::Gentle => ROUNDS,
            Probing::Forced => ROUNDS + 1,
        }
    }

    pub(super) fn advance(&mut self, now: Instant) {
        if self.ends_at.is_due(now) {
            return self.abort();
        }
        if !self.waits_until.is_due(now) {
            return;
        }
        self.waits_until = Deadline::NEVER;
        match self.phase {
            Phase::Listening => self.phase = Phase::Probing { round: 0, next: 0 },
            Phase::Probing { round, next: 64 } if round + 1 < self.rounds() => {
                self.phase = Phase::Probing { round: round + 1, next: 0 };
            }
            Phase::Probing { next: 64, .. } => self.end(Phase::Complete),
            _ => {}
        }
    }

    /// Whether a probe may be owed.
    #[inline]
    pub(super) fn is_probing(&self) -> bool {
        matches!(self.phase, Phase::Probing { .. }) && self.waits_until == Deadline::NEVER
    }

    /// The next probe. The addresses `listed`, as bits, are left to the scan list.
    pub(super) fn transmit(
        &mut self,
        now: Instant,
        listed: u64,
        vendor: u16,
        serial: u32,
    ) -> Option<Frame> {
        let Phase::Probing { round, next } = self.phase else { return None };
        let forced = round >= ROUNDS;
        let known = if forced { self.seen | self.checking } else { 0 };
        let asked = !(listed | bit(self.mac) | self.answers | known);
        let left = asked & u64::MAX.checked_shl(next).unwrap_or(0);
        let Some(mac) = MacId::new(left.trailing_zeros() as u8).filter(|_| left != 0) else {
            self.phase = Phase::Probing { round, next: 64 };
            self.waits_until = Deadline::at(now + ANSWER_TIME);
            return None;
        };
        self.waits_until = Deadline::at(now + PROBE_TIME);
        self.phase = Phase::Probing { round, next: u32::from(mac.value()) + 1 };
        if forced {
            return Some(CheckMessage { response: false, port: 0, vendor, serial }.frame(mac));
        }
        let get = Service::GET_ATTRIBUTE_SINGLE.0;
        let header = Header(self.mac.value());
        let header = if round == 0 { header } else { header.of_next_transaction() };
        let octets = [header.0, get, class::IDENTITY, 1, 1];
        Some(Frame::standard(group_2(mac, UNCONNECTED_REQUEST), &octets))
    }

    #[inline]
    pub(super) fn deadline(&self) -> Deadline {
        self.waits_until.min(self.ends_at)
    }
}
