//! Fragmentation: messages longer than a CAN frame (CIP volume 3, chapter 4-4).
//!
//! Explicit messages go stop and wait: each fragment `[header][type<<6 | count]` + ≤ 6 octets is
//! acknowledged by `[header][C0 | count][status]`. I/O messages go unacknowledged:
//! `[type<<6 | count]` + ≤ 7 octets.

use codewheel_station::{Deadline, Duration, Instant};

/// How long a sender waits for the acknowledge of a fragment before its one retry.
pub const ACKNOWLEDGE_TIME: Duration = Duration::from_secs(1);

/// The acknowledge status "ok".
pub const STATUS_OK: u8 = 0;
/// The acknowledge status "too much data": the receiver's buffer is full.
pub const STATUS_TOO_MUCH_DATA: u8 = 1;

/// Octets of a body that one explicit fragment carries.
const EXPLICIT_OCTETS: usize = 6;
/// Octets of a body that an unfragmented explicit message carries.
pub const WHOLE_OCTETS: usize = 7;

/// The fragmentation octet: what kind of fragment, and its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fragment {
    /// First, middle, last or acknowledge.
    pub kind: Kind,
    /// Six bits, 0 … 3F, wrapping. A first fragment has 0, or 3F when it is the only one.
    pub count: u8,
}

/// The kind of a fragment, bits 7 and 6.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 0: begins a message.
    First,
    /// 1: goes on.
    Middle,
    /// 2: ends the message.
    Last,
    /// 3: acknowledges one explicit fragment.
    Acknowledge,
}

/// The count of a first fragment that is also the last.
pub const FIRST_AND_ONLY: u8 = 0x3F;

impl Fragment {
    /// Reads the octet; every value is a fragment.
    #[must_use]
    pub const fn from_octet(octet: u8) -> Self {
        let kind = match octet >> 6 {
            0 => Kind::First,
            1 => Kind::Middle,
            2 => Kind::Last,
            _ => Kind::Acknowledge,
        };
        Self { kind, count: octet & 0x3F }
    }

    /// The octet on the wire.
    #[must_use]
    pub const fn to_octet(self) -> u8 {
        let kind = match self.kind {
            Kind::First => 0,
            Kind::Middle => 1,
            Kind::Last => 2,
            Kind::Acknowledge => 3,
        };
        kind << 6 | self.count & 0x3F
    }
}

/// What a received fragment asks of the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// Nothing: the fragment belongs to no message being put together.
    Dropped,
    /// It is in its place (or there already): acknowledge its count.
    Taken,
    /// It was the last one: acknowledge it, then read [`Reassembly::body`].
    Complete,
    /// The body is longer than the buffer: acknowledge with [`STATUS_TOO_MUCH_DATA`].
    TooMuch,
}

/// Puts a fragmented message together in a buffer of `N` octets.
#[derive(Clone, Debug)]
pub struct Reassembly<const N: usize> {
    octets: [u8; N],
    length: u16,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Empty,
    Collecting {
        count: u8,
    },
    /// Whole; the count of the last fragment is kept, since its acknowledge may get lost.
    Complete {
        count: u8,
    },
}

impl<const N: usize> Default for Reassembly<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Reassembly<N> {
    /// An empty buffer.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(N <= u16::MAX as usize, "lengths are kept in 16 bits") };
        Self { octets: [0; N], length: 0, state: State::Empty }
    }

    /// Forgets what has been collected.
    pub const fn clear(&mut self) {
        self.length = 0;
        self.state = State::Empty;
    }

    /// The octets of the last complete message.
    #[must_use]
    pub fn body(&self) -> &[u8] {
        self.octets.get(..usize::from(self.length)).unwrap_or_default()
    }

    /// Takes one fragment in. Acknowledges are not for the receiver and are dropped.
    pub fn push(&mut self, fragment: Fragment, octets: &[u8]) -> Received {
        match (fragment.kind, self.state) {
            (Kind::First, _) => self.first(fragment.count, octets),
            (Kind::Middle | Kind::Last, State::Collecting { count }) => {
                if fragment.count == count {
                    // The acknowledge got lost. A last fragment with the count of the one before
                    // it is the same mistake seen from the other side.
                    return Received::Taken;
                }
                if fragment.count != (count + 1) & 0x3F {
                    self.clear();
                    return Received::Dropped;
                }
                if !self.append(octets) {
                    self.clear();
                    return Received::TooMuch;
                }
                if fragment.kind == Kind::Last {
                    self.state = State::Complete { count: fragment.count };
                    return Received::Complete;
                }
                self.state = State::Collecting { count: fragment.count };
                Received::Taken
            }
            (Kind::Last, State::Complete { count }) if count == fragment.count => Received::Taken,
            _ => Received::Dropped,
        }
    }

    fn first(&mut self, count: u8, octets: &[u8]) -> Received {
        self.clear();
        if count != 0 && count != FIRST_AND_ONLY {
            return Received::Dropped;
        }
        if !self.append(octets) {
            self.clear();
            return Received::TooMuch;
        }
        if count == FIRST_AND_ONLY {
            self.state = State::Complete { count };
            return Received::Complete;
        }
        self.state = State::Collecting { count };
        Received::Taken
    }

    fn append(&mut self, octets: &[u8]) -> bool {
        let begin = usize::from(self.length);
        let end = begin + octets.len();
        let Some(room) = self.octets.get_mut(begin..end) else { return false };
        room.copy_from_slice(octets);
        self.length = end as u16;
        true
    }
}

/// Sends one explicit body, whole or in acknowledged fragments.
///
/// Ask [`next`](Sending::next) whenever the medium can take a frame; hand acknowledges in; run
/// [`advance`](Sending::advance) at [`deadline`](Sending::deadline).
#[derive(Clone, Debug)]
pub struct Sending {
    length: u16,
    offset: u16,
    count: u8,
    phase: Phase,
    /// The end of [`Phase::Waiting`].
    waits_until: Deadline,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    /// The body fits one frame and has not been handed out yet.
    Whole,
    /// The fragment at `offset` waits for the medium.
    Owed {
        retried: bool,
    },
    /// The fragment at `offset` was handed out and waits for its acknowledge.
    Waiting {
        retried: bool,
    },
}

/// What to put on the wire next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece<'a> {
    /// The whole body, unfragmented.
    Whole(&'a [u8]),
    /// One fragment.
    Fragment(Fragment, &'a [u8]),
}

impl Sending {
    /// Nothing to send.
    pub const IDLE: Self =
        Self { length: 0, offset: 0, count: 0, phase: Phase::Idle, waits_until: Deadline::NEVER };

    /// Begins to send a body of `length` octets; whatever was on its way is given up.
    pub const fn begin(&mut self, length: u16) {
        let whole = length as usize <= WHOLE_OCTETS;
        let phase = if whole { Phase::Whole } else { Phase::Owed { retried: false } };
        *self = Self { length, phase, ..Self::IDLE };
    }

    /// Gives up what is on its way.
    pub const fn stop(&mut self) {
        *self = Self::IDLE;
    }

    /// Whether nothing is left to send or to be acknowledged.
    #[must_use]
    pub const fn is_idle(&self) -> bool {
        matches!(self.phase, Phase::Idle)
    }

    /// Whether a piece waits to be handed out.
    #[must_use]
    pub const fn is_owed(&self) -> bool {
        matches!(self.phase, Phase::Whole | Phase::Owed { .. })
    }

    /// Whether a piece of the body has been handed out.
    #[must_use]
    pub const fn has_begun(&self) -> bool {
        match self.phase {
            Phase::Whole => false,
            Phase::Owed { retried: false } => self.offset > 0,
            Phase::Idle | Phase::Owed { retried: true } | Phase::Waiting { .. } => true,
        }
    }

    /// Whether all of the body has been handed out; its last fragment may be unacknowledged.
    #[must_use]
    pub const fn is_all_out(&self) -> bool {
        match self.phase {
            Phase::Idle => true,
            Phase::Whole | Phase::Owed { retried: false } => false,
            Phase::Owed { retried: true } | Phase::Waiting { .. } => {
                self.offset as usize + EXPLICIT_OCTETS >= self.length as usize
            }
        }
    }

    /// The next piece of the body at the beginning of `buffer`, the same one that
    /// [`begin`](Sending::begin) was told the length of.
    pub fn next<'a>(&mut self, now: Instant, buffer: &'a [u8]) -> Option<Piece<'a>> {
        let body = buffer.get(..usize::from(self.length)).unwrap_or(buffer);
        match self.phase {
            Phase::Idle | Phase::Waiting { .. } => None,
            Phase::Whole => {
                self.phase = Phase::Idle;
                Some(Piece::Whole(body))
            }
            Phase::Owed { retried } => {
                let offset = usize::from(self.offset);
                let end = body.len().min(offset + EXPLICIT_OCTETS);
                let kind = if offset == 0 {
                    Kind::First
                } else if end == body.len() {
                    Kind::Last
                } else {
                    Kind::Middle
                };
                let octets = body.get(offset..end).unwrap_or_default();
                self.phase = Phase::Waiting { retried };
                self.waits_until = Deadline::at(now + ACKNOWLEDGE_TIME);
                Some(Piece::Fragment(Fragment { kind, count: self.count }, octets))
            }
        }
    }

    /// The fragment handed out last has reached the wire: the time for its acknowledge runs from
    /// here.
    pub fn sent(&mut self, now: Instant) {
        if matches!(self.phase, Phase::Waiting { .. }) {
            self.waits_until = Deadline::at(now + ACKNOWLEDGE_TIME);
        }
    }

    /// An acknowledge arrived. One with another count, or while none is waited for, is ignored; a
    /// status other than ok gives the message up.
    pub const fn acknowledged(&mut self, count: u8, status: u8) {
        if !matches!(self.phase, Phase::Waiting { .. }) || count != self.count {
            return;
        }
        let end = self.offset.saturating_add(EXPLICIT_OCTETS as u16);
        if status != STATUS_OK || end >= self.length {
            return self.stop();
        }
        self.waits_until = Deadline::NEVER;
        self.offset = end;
        self.count = (self.count + 1) & 0x3F;
        self.phase = Phase::Owed { retried: false };
    }

    /// Repeats an unacknowledged fragment once, then gives the message up. Returns whether it gave
    /// up.
    pub fn advance(&mut self, now: Instant) -> bool {
        if !self.waits_until.is_due(now) {
            return false;
        }
        self.waits_until = Deadline::NEVER;
        let give_up = self.phase == (Phase::Waiting { retried: true });
        self.phase = if give_up { Phase::Idle } else { Phase::Owed { retried: true } };
        give_up
    }

    /// When [`advance`](Sending::advance) must run.
    #[must_use]
    pub const fn deadline(&self) -> Deadline {
        self.waits_until
    }
}

/// Octets of data that one I/O fragment carries.
pub const IO_OCTETS: usize = 7;

/// The fragment number `index` of I/O `data` longer than eight octets, or `None` past the end.
#[must_use]
pub fn io_fragment(data: &[u8], index: usize) -> Option<(Fragment, &[u8])> {
    let offset = index.checked_mul(IO_OCTETS)?;
    let rest = data.get(offset..).filter(|rest| !rest.is_empty() || index == 0)?;
    let octets = rest.get(..IO_OCTETS).unwrap_or(rest);
    let last = octets.len() == rest.len();
    let fragment = match (index, last) {
        (0, true) => Fragment { kind: Kind::First, count: FIRST_AND_ONLY },
        (0, false) => Fragment { kind: Kind::First, count: 0 },
        (_, last) => Fragment {
            kind: if last { Kind::Last } else { Kind::Middle },
            count: (index & 0x3F) as u8,
        },
    };
    Some((fragment, octets))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn fragment(kind: Kind, count: u8) -> Fragment {
        Fragment { kind, count }
    }

    /// Sends `body` through a perfect medium and returns the fragments with what was put together.
    fn pass(body: &[u8]) -> (Vec<(Fragment, usize)>, Vec<u8>) {
        let mut sending = Sending::IDLE;
        let mut reassembly = Reassembly::<512>::new();
        let mut seen = Vec::new();
        sending.begin(body.len() as u16);
        while let Some(piece) = sending.next(Instant::ZERO, body) {
            match piece {
                Piece::Whole(octets) => return (seen, octets.to_vec()),
                Piece::Fragment(fragment, octets) => {
                    seen.push((fragment, octets.len()));
                    let received = reassembly.push(fragment, octets);
                    assert_ne!(received, Received::Dropped);
                    sending.acknowledged(fragment.count, STATUS_OK);
                }
            }
        }
        assert!(sending.is_idle());
        (seen, reassembly.body().to_vec())
    }

    #[test]
    fn every_length_arrives_whole_and_in_the_fewest_fragments() {
        let octets: Vec<u8> = (0..500).map(|i| i as u8).collect();
        for length in 0..octets.len() {
            let body = &octets[..length];
            let (fragments, arrived) = pass(body);
            assert_eq!(arrived, body, "{length} octets");
            let expected = if length <= 7 { 0 } else { length.div_ceil(6) };
            assert_eq!(fragments.len(), expected, "{length} octets");
        }
    }

    #[test]
    fn a_body_of_six_k_octets_ends_with_a_full_last_fragment() {
        let (fragments, _) = pass(&[0; 18]);
        assert_eq!(
            fragments,
            [
                (fragment(Kind::First, 0), 6),
                (fragment(Kind::Middle, 1), 6),
                (fragment(Kind::Last, 2), 6)
            ]
        );
    }

    #[test]
    fn the_count_wraps_from_63_to_0() {
        let (fragments, arrived) = pass(&[7; 420]);
        assert_eq!(fragments[63].0.count, 63);
        assert_eq!(fragments[64].0.count, 0);
        assert_eq!(arrived.len(), 420);
    }

    #[test]
    fn a_repeated_fragment_is_acknowledged_and_not_appended() {
        let mut reassembly = Reassembly::<64>::new();
        assert_eq!(reassembly.push(fragment(Kind::First, 0), &[1; 6]), Received::Taken);
        assert_eq!(reassembly.push(fragment(Kind::First, 0), &[1; 6]), Received::Taken);
        assert_eq!(reassembly.push(fragment(Kind::Middle, 1), &[2; 6]), Received::Taken);
        assert_eq!(reassembly.push(fragment(Kind::Middle, 1), &[2; 6]), Received::Taken);
        assert_eq!(reassembly.push(fragment(Kind::Last, 2), &[3]), Received::Complete);
        assert_eq!(reassembly.push(fragment(Kind::Last, 2), &[3]), Received::Taken);
        assert_eq!(reassembly.body(), [1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 3]);
    }

    #[test]
    fn a_wrong_count_forgets_the_message() {
        let mut reassembly = Reassembly::<64>::new();
        reassembly.push(fragment(Kind::First, 0), &[1]);
        assert_eq!(reassembly.push(fragment(Kind::Last, 2), &[3]), Received::Dropped);
        assert_eq!(reassembly.push(fragment(Kind::Last, 1), &[3]), Received::Dropped);
    }

    #[test]
    fn a_first_fragment_counts_0_or_3f() {
        let mut reassembly = Reassembly::<64>::new();
        assert_eq!(reassembly.push(fragment(Kind::First, 1), &[1]), Received::Dropped);
        assert_eq!(
            reassembly.push(fragment(Kind::First, FIRST_AND_ONLY), &[1]),
            Received::Complete
        );
        assert_eq!(reassembly.body(), [1]);
    }

    #[test]
    fn a_body_that_overflows_is_refused_with_too_much_data() {
        let mut reassembly = Reassembly::<8>::new();
        assert_eq!(reassembly.push(fragment(Kind::First, 0), &[1; 6]), Received::Taken);
        assert_eq!(reassembly.push(fragment(Kind::Middle, 1), &[1; 6]), Received::TooMuch);
        assert_eq!(reassembly.push(fragment(Kind::Last, 2), &[1]), Received::Dropped);
    }

    #[test]
    fn an_unacknowledged_fragment_is_repeated_once_then_given_up() {
        let body = [9; 20];
        let mut sending = Sending::IDLE;
        sending.begin(body.len() as u16);
        let first = sending.next(Instant::ZERO, &body);
        assert_eq!(sending.next(Instant::ZERO, &body), None);
        let second_try = sending.deadline().instant().unwrap();
        assert_eq!(second_try, Instant::ZERO + ACKNOWLEDGE_TIME);
        assert!(!sending.advance(second_try));
        assert_eq!(sending.next(second_try, &body), first);
        assert!(sending.advance(second_try + ACKNOWLEDGE_TIME));
        assert!(sending.is_idle());
    }

    #[test]
    fn io_data_longer_than_a_frame_comes_in_numbered_fragments() {
        let data = [5; 15];
        let all: Vec<_> = (0..).map_while(|index| io_fragment(&data, index)).collect();
        assert_eq!(all.len(), 3);
        assert_eq!(all[0], (fragment(Kind::First, 0), &[5; 7][..]));
        assert_eq!(all[1], (fragment(Kind::Middle, 1), &[5; 7][..]));
        assert_eq!(all[2], (fragment(Kind::Last, 2), &[5; 1][..]));
        assert_eq!(
            io_fragment(&[1, 2], 0),
            Some((fragment(Kind::First, FIRST_AND_ONLY), &[1, 2][..]))
        );
    }
}
