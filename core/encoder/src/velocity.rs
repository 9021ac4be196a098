//! How fast the position runs: the difference over the last 100 ms.
//!
//! Past samples at least [`SPACING`] apart are kept as anchors, few enough for a small device,
//! old enough to reach back over the window. Between two anchors the shaft is taken to have turned
//! evenly; after the newest sample it is taken to rest, for a shaft at rest need not be sampled.

use codewheel_station::{Duration, Instant};

/// What the difference is taken over.
const WINDOW: Duration = Duration::from_millis(100);

/// Windows in a second.
const WINDOWS_PER_SECOND: i64 = 10;

const ANCHORS: usize = 8;

/// The least distance of two anchors: seven of these distances are more than the window.
const SPACING: Duration = Duration::from_millis(15);

/// A past sample: when, and the unwrapped position.
pub(crate) type Anchor = (Instant, i64);

/// The anchors of the last 100 ms, a ring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Velocity {
    anchors: [Anchor; ANCHORS],
    /// A sample from here on becomes an anchor: the newest one and [`SPACING`].
    due: Instant,
    /// How many anchors are valid.
    count: u8,
    /// Where the newest one lies.
    newest: u8,
}

impl Velocity {
    pub(crate) const fn new() -> Self {
        let anchors = [(Instant::ZERO, 0); ANCHORS];
        Self { anchors, due: Instant::ZERO, count: 0, newest: 0 }
    }

    /// Forgets everything, so that the next velocity starts from rest. For a position that jumped
    /// without the shaft.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
        self.due = Instant::ZERO;
    }

    /// Whether the sample taken at `at`, which one `elapsed` later is about to replace, is to be
    /// [kept](Self::keep). Part of every sample, so it is two comparisons.
    pub(crate) fn wants(&self, at: Instant, elapsed: Duration) -> bool {
        at >= self.due || elapsed >= SPACING
    }

    /// Keeps a sample as an anchor.
    #[cold]
    pub(crate) fn keep(&mut self, sample: Anchor) {
        // A sample before a pause marks where the shaft came to rest. Too close to the anchor
        // before it, it takes its place: otherwise the way to it would be smeared over the pause.
        if sample.0 >= self.due {
            self.newest = self.newest.wrapping_add(1) % ANCHORS as u8;
            self.count = (self.count + 1).min(ANCHORS as u8);
        }
        if let Some(place) = self.anchors.get_mut(usize::from(self.newest)) {
            *place = sample;
            self.due = sample.0 + SPACING;
        }
    }

    /// Steps per second over the window that ends `now`; `last` is the newest sample.
    pub(crate) fn per_second(&self, now: Instant, last: Anchor) -> i64 {
        let begin = now - WINDOW;
        let mut after = last;
        for age in 0..self.count {
            let Some(anchor) = self.anchor(age) else { break };
            if after.0 <= begin {
                break;
            }
            if anchor.0 <= begin {
                return per_second(last.1.wrapping_sub(between(anchor, after, begin)));
            }
            after = anchor;
        }
        // Either the newest sample is older than the window, or the oldest anchor is younger:
        // then the shaft counts as at rest before it, and no velocity springs from two close
        // samples.
        per_second(last.1.wrapping_sub(after.1))
    }

    /// The anchor `age` places behind the newest.
    fn anchor(&self, age: u8) -> Option<Anchor> {
        let place = self.newest.wrapping_sub(age) % ANCHORS as u8;
        self.anchors.get(usize::from(place)).copied()
    }
}

fn per_second(steps: i64) -> i64 {
    steps.saturating_mul(WINDOWS_PER_SECOND)
}

/// Where the shaft stood at `at` on an even way from `from` to `to`; in microseconds, so that the
/// product stays within 64 bits.
fn between(from: Anchor, to: Anchor, at: Instant) -> i64 {
    let micros = |until: Instant| (until.since(from.0).as_nanos() / 1_000) as i64;
    let (part, whole) = (micros(at), micros(to.0));
    let way = to.1.wrapping_sub(from.1);
    let gone = way.saturating_mul(part).checked_div(whole).unwrap_or(0);
    from.1.wrapping_add(gone)
}
