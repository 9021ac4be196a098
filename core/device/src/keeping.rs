//! Non-volatile memory as an effect: the device offers a record and is told when it is kept.
//!
//! What is the same on every bus: one record is on its way at a time, writes are counted, one that
//! failed is tried again after a while, and the crossing reference goes along with each.

use codewheel_encoder::{Encoder, Kept, Reference, Start};
use codewheel_station::{Deadline, Duration, Instant};

use crate::event::{Events, Happening};

/// How long an automatic write waits after one has failed, so that a dying memory is not worn out
/// (decision).
const RETRY_TIME: Duration = Duration::from_secs(60);

/// What the memory said at power-up, and since.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryState {
    /// Nothing was ever kept.
    Fresh,
    /// A record is kept.
    Good,
    /// Both records were damaged at a power-up, and nothing has been saved since.
    Damaged,
}

/// Where the shaft stood, in sixteen octets instead of the twenty-four of an `Option<Reference>`.
#[derive(Clone, Copy, Debug)]
struct KeptReference {
    crossings: i64,
    /// No code where there is no reference.
    code: u32,
}

impl KeptReference {
    const NO_CODE: u32 = u32::MAX;
}

impl From<Option<Reference>> for KeptReference {
    fn from(reference: Option<Reference>) -> Self {
        reference.map_or(Self { crossings: 0, code: Self::NO_CODE }, |reference| Self {
            crossings: reference.crossings,
            code: reference.code,
        })
    }
}

impl From<KeptReference> for Option<Reference> {
    fn from(KeptReference { crossings, code }: KeptReference) -> Self {
        (code != KeptReference::NO_CODE).then_some(Reference { crossings, code })
    }
}

/// What power-up finds in memory: the record, if there is one of this product.
pub(crate) fn found<'a, E: Copy + From<Happening>>(
    now: Instant,
    start: &'a Start,
    fingerprint: u16,
    events: &mut Events<E>,
) -> (Option<&'a Kept>, MemoryState) {
    match start {
        Start::Fresh { interrupted } => {
            if *interrupted {
                events.push(now, Happening::FirstWriteInterrupted);
            }
            (None, MemoryState::Fresh)
        }
        Start::Kept { kept, other_damaged, .. } if kept.fingerprint == fingerprint => {
            if *other_damaged {
                events.push(now, Happening::RecordDamaged);
            }
            (Some(kept), MemoryState::Good)
        }
        Start::Kept { .. } | Start::Damaged => (None, MemoryState::Damaged),
    }
}

/// The course of the writes, whatever is written.
#[derive(Clone, Debug)]
pub(crate) struct Upkeep {
    /// How often the memory has been written.
    pub(crate) writes: u32,
    pub(crate) memory: MemoryState,
    /// A record is on its way.
    writing: bool,
    /// An automatic write is wanted.
    due: bool,
    /// Before this no automatic write is tried again.
    retry_at: Deadline,
    /// The crossing reference, as it is in memory.
    reference: KeptReference,
    /// The crossing reference of the record on its way.
    written_reference: KeptReference,
}

impl Upkeep {
    pub(crate) fn new(kept: Option<&Kept>, memory: MemoryState) -> Self {
        Self {
            writes: kept.map_or(0, |kept| kept.writes),
            memory,
            writing: false,
            due: false,
            retry_at: Deadline::NEVER,
            reference: kept.and_then(|kept| kept.reference).into(),
            written_reference: None.into(),
        }
    }

    /// The crossing reference, as it is in memory.
    pub(crate) fn reference(&self) -> Option<Reference> {
        self.reference.into()
    }

    /// The crossing reference, as it is in memory or on its way there.
    pub(crate) fn coming_reference(&self) -> Option<Reference> {
        if self.writing { self.written_reference } else { self.reference }.into()
    }

    /// Asks for an automatic write where the shaft has gone far from the crossing reference.
    #[inline]
    pub(crate) fn watch(&mut self, encoder: &Encoder) {
        if let Some(reference) = self.reference()
            && !self.writing
            && encoder.reference_is_stale(&reference)
        {
            self.due = true;
        }
    }

    /// Asks for an automatic write.
    pub(crate) const fn ask(&mut self) {
        self.due = true;
    }

    /// What is asked for is new, so it does not wait until one that has failed is tried again.
    pub(crate) const fn hurry(&mut self) {
        self.retry_at = Deadline::NEVER;
    }

    /// Whether a record is on its way into memory.
    pub(crate) const fn is_writing(&self) -> bool {
        self.writing
    }

    /// Whether a record can be handed out at `now`; an `urgent` one waits for no retry.
    pub(crate) fn is_due(&self, now: Instant, urgent: bool) -> bool {
        let retry = self.retry_at.is_never() || self.retry_at.is_due(now);
        !self.writing && (urgent || self.due && retry)
    }

    /// Whether nothing is to be written, but for an automatic write that has failed.
    pub(crate) fn is_idle(&self) -> bool {
        !self.writing && (!self.due || !self.retry_at.is_never())
    }

    /// A record is handed out. Returns its crossing reference, where one is `needed`: the one of
    /// now, or before the first sample the one that is kept.
    pub(crate) fn begin(&mut self, needed: bool, encoder: &Encoder) -> Option<Reference> {
        self.due = false;
        self.retry_at = Deadline::NEVER;
        self.writing = true;
        let reference =
            if needed { encoder.reference().or_else(|| self.reference()) } else { None };
        self.written_reference = reference.into();
        reference
    }

    /// The record handed out last has been written, or not; `false` where there was none. After a
    /// failure the caller says with [`retry`](Self::retry) whether it is to be tried again.
    pub(crate) fn end(&mut self, good: bool) -> bool {
        let was_writing = core::mem::replace(&mut self.writing, false);
        if was_writing && good {
            self.reference = self.written_reference;
            self.writes = self.writes.saturating_add(1);
        }
        was_writing
    }

    /// Asks for an automatic write, but not at once: one has failed at `now`.
    pub(crate) fn retry(&mut self, now: Instant) {
        self.due = true;
        self.retry_at = Deadline::at(now + RETRY_TIME);
    }

    /// Wants nothing to be written any more.
    pub(crate) const fn forget(&mut self) {
        self.due = false;
        self.retry_at = Deadline::NEVER;
    }

    /// From here on a record that was to be tried again waits to be fetched, like any other.
    #[inline]
    pub(crate) fn advance(&mut self, now: Instant) {
        self.retry_at.take_due(now);
    }

    /// When [`advance`](Self::advance) is due.
    #[inline]
    pub(crate) fn deadline(&self) -> Deadline {
        if self.due { self.retry_at } else { Deadline::NEVER }
    }
}
