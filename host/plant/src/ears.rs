//! Who hears what a bus carries: a recording, and whoever traces it.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use codewheel_capture::{BusRecorder, Condition, Content, Direction};
use codewheel_station::Instant;
use codewheel_station::can::Frame;

use crate::trace::Ring;

/// All who hear one bus.
#[derive(Debug)]
pub struct Ears {
    recorder: Option<BusRecorder>,
    traces: Mutex<Vec<Arc<Ring>>>,
    /// How many of them there are, so that a bus that nobody traces need not ask.
    count: AtomicUsize,
}

impl Ears {
    pub(crate) const fn new(recorder: Option<BusRecorder>) -> Self {
        Self { recorder, traces: Mutex::new(Vec::new()), count: AtomicUsize::new(0) }
    }

    /// Whether anybody listens.
    pub(crate) fn are_open(&self) -> bool {
        self.recorder.is_some() || self.count.load(Ordering::Relaxed) > 0
    }

    pub(crate) fn begin(&self, ring: Arc<Ring>) {
        let mut traces = self.traces();
        traces.push(ring);
        self.count.store(traces.len(), Ordering::Relaxed);
    }

    pub(crate) fn end(&self, ring: &Arc<Ring>) {
        let mut traces = self.traces();
        traces.retain(|other| !Arc::ptr_eq(other, ring));
        self.count.store(traces.len(), Ordering::Relaxed);
    }

    pub(crate) fn frame(&self, at: Instant, frame: &Frame, direction: Direction) {
        if let Some(recorder) = &self.recorder {
            recorder.frame(at, frame, direction);
        }
        self.tell(at, direction, Content::Frame(*frame));
    }

    pub(crate) fn telegram(
        &self,
        at: Instant,
        octets: &[u8],
        condition: Condition,
        direction: Direction,
    ) {
        if let Some(recorder) = &self.recorder {
            recorder.telegram(at, octets, condition, direction);
        }
        self.tell(at, direction, Content::Telegram { octets, condition });
    }

    fn tell(&self, at: Instant, direction: Direction, content: Content<'_>) {
        if self.count.load(Ordering::Relaxed) > 0 {
            self.traces().iter().for_each(|ring| ring.put(at, direction, content));
        }
    }

    fn traces(&self) -> MutexGuard<'_, Vec<Arc<Ring>>> {
        // Nothing that is done under the lock panics, so what a poisoned one holds is good.
        self.traces.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
