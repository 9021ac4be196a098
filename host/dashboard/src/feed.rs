//! One look at the plant for all who watch it.
//!
//! A thread takes the snapshots, makes the state of them once and says once what has changed. The
//! streams share its frames. While nobody looks, it takes only the reports, once a second.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use codewheel_plant::{BusSnapshot, Running, Watcher};
use serde_json::{Map, Value};
use tokio::sync::watch;

use crate::merge_patch;
use crate::view::{BusState, ReportDocument, StateDocument};

/// How often there is a new frame while somebody looks.
const FRAME: Duration = Duration::from_millis(50);
/// How often the reports are taken while nobody looks.
const REPORTS: Duration = Duration::from_secs(1);
/// The longest time until a first reader, or the end, is noticed.
const PATIENCE: Duration = Duration::from_millis(100);
/// The longest that the first frame waits for all buses.
const FIRST_FRAME: Duration = Duration::from_millis(300);
/// Reports that a new reader gets to see.
const JOURNAL: usize = 200;
/// Readers at the same time.
pub(crate) const READERS: usize = 32;

/// The thread that looks at the plant. Dropping it ends the thread.
#[derive(Debug)]
pub(crate) struct Feed {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    frames: watch::Sender<Option<Arc<Frame>>>,
    journal: Mutex<Journal>,
    readers: AtomicUsize,
    stop: AtomicBool,
}

/// The state of the plant at one moment.
#[derive(Debug)]
pub(crate) struct Frame {
    number: u64,
    at: f64,
    /// Name and state of each bus that has shown itself. A bus without news is the same one as in
    /// the frame before.
    buses: Vec<(String, Arc<Value>)>,
    /// What has changed since the frame before, as text.
    patch: Arc<str>,
    whole: OnceLock<Arc<str>>,
}

/// The newest reports, each with its number.
#[derive(Debug, Default)]
struct Journal {
    reports: VecDeque<ReportDocument>,
    /// The number of the next one.
    next: u64,
}

/// Somebody who looks at the plant.
#[derive(Debug)]
pub(crate) struct Reader {
    frames: watch::Receiver<Option<Arc<Frame>>>,
    /// The frame that was told last.
    told: Option<Arc<Frame>>,
    /// The number of the first report that was not told.
    next_report: u64,
    shared: Arc<Shared>,
}

impl Feed {
    /// Looks at `plant` from now on.
    ///
    /// # Errors
    /// What the system says where it has no thread.
    pub(crate) fn start(plant: &Arc<Running>) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            frames: watch::Sender::new(None),
            journal: Mutex::default(),
            readers: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
        });
        let watcher = plant.watch(REPORTS);
        let (looking, plant) = (Arc::clone(&shared), Arc::clone(plant));
        let thread = std::thread::Builder::new()
            .name("page state".into())
            .spawn(move || looking.look(&plant, &watcher))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// One more reader; `None` where there are [`READERS`] already.
    pub(crate) fn read(&self) -> Option<Reader> {
        let one_more = |readers| (readers < READERS).then_some(readers + 1);
        let taken =
            self.shared.readers.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_more);
        taken.ok().map(|_| Reader {
            frames: self.shared.frames.subscribe(),
            told: None,
            next_report: 0,
            shared: Arc::clone(&self.shared),
        })
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn look(&self, plant: &Running, watcher: &Watcher) {
        let mut fast = false;
        let mut number = 0;
        let buses = plant.descriptions().len();
        let mut last = Instant::now();
        while !self.stop.load(Ordering::Relaxed) {
            let is_read = self.readers.load(Ordering::Relaxed) > 0;
            if is_read != fast {
                fast = is_read;
                last = Instant::now();
                plant.watch_every(watcher, if fast { FRAME } else { REPORTS });
                if !fast {
                    // Whoever comes next must not see what was long ago; and the next frame must not
                    // seem to follow the last one.
                    self.frames.send_replace(None);
                    number += 1;
                }
            }
            let mut fresh = watcher.snapshots(PATIENCE);
            if fresh.is_empty() {
                if watcher.has_ended() {
                    // Nobody waits for a bus that has ended.
                    std::thread::sleep(PATIENCE);
                }
                continue;
            }
            let before = self.frames.borrow().clone();
            if fast && before.is_none() {
                // Whoever comes first gets to see all buses, but does not wait for a lost one.
                let missing = |fresh: &[(usize, BusSnapshot)]| {
                    (0..buses).any(|bus| fresh.iter().all(|(at, _)| *at != bus))
                };
                while missing(&fresh) && last.elapsed() < FIRST_FRAME && !watcher.has_ended() {
                    fresh.extend(watcher.snapshots(FIRST_FRAME.saturating_sub(last.elapsed())));
                }
            } else if fast {
                // The buses run on their own; what they show within a frame is one frame.
                std::thread::sleep(FRAME.saturating_sub(last.elapsed()));
                fresh.extend(watcher.snapshots(Duration::ZERO));
            }
            self.note(&fresh);
            if fast {
                last = Instant::now();
                let frame = Frame::after(before.as_deref(), number, &fresh);
                number += 1;
                self.frames.send_replace(Some(Arc::new(frame)));
            }
        }
    }

    fn note(&self, fresh: &[(usize, BusSnapshot)]) {
        let mut journal = self.journal();
        for report in fresh.iter().flat_map(|(_, bus)| ReportDocument::all(bus)) {
            journal.note(report);
        }
    }

    fn journal(&self) -> MutexGuard<'_, Journal> {
        // A poisoned lock means that the other thread has panicked; the reports are still whole.
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Journal {
    fn note(&mut self, report: ReportDocument) {
        if self.reports.len() == JOURNAL {
            self.reports.pop_front();
        }
        self.reports.push_back(report);
        self.next += 1;
    }

    /// The reports from number `next` on that are still there, and how many are not.
    fn since(&self, next: u64) -> (Vec<ReportDocument>, u64) {
        let first = self.next - self.reports.len() as u64;
        let lost = first.saturating_sub(next);
        let passed = usize::try_from(next.saturating_sub(first)).unwrap_or(usize::MAX);
        (self.reports.iter().skip(passed).cloned().collect(), lost)
    }
}

impl Frame {
    /// The frame that follows `before` with what is fresh.
    fn after(before: Option<&Self>, number: u64, fresh: &[(usize, BusSnapshot)]) -> Self {
        let mut buses = before.map(|frame| frame.buses.clone()).unwrap_or_default();
        let mut at = before.map_or(0.0, |frame| frame.at);
        for (_, snapshot) in fresh {
            at = at.max(StateDocument::moment(snapshot));
            // Names and numbers always become JSON.
            let state = serde_json::to_value(BusState::from(snapshot)).unwrap_or_default();
            let state = Arc::new(state);
            match buses.iter_mut().find(|(name, _)| *name == snapshot.name) {
                Some((_, older)) => *older = state,
                None => buses.push((snapshot.name.clone(), state)),
            }
        }
        let mut frame = Self { number, at, buses, patch: "".into(), whole: OnceLock::new() };
        if let Some(before) = before {
            frame.patch = frame.patch_from(before);
        }
        frame
    }

    /// The whole state as text.
    fn whole(&self) -> Arc<str> {
        let text = || {
            let buses = self.buses.iter().map(|(name, state)| (name.clone(), Value::clone(state)));
            text(self.at, buses.collect())
        };
        Arc::clone(self.whole.get_or_init(text))
    }

    /// The merge patch that makes this state of an older one, as text.
    fn patch_from(&self, older: &Self) -> Arc<str> {
        let mut changes = Map::new();
        for (name, state) in &self.buses {
            let before = older.buses.iter().find(|(older, _)| older == name);
            let change = match before {
                Some((_, before)) if Arc::ptr_eq(before, state) => None,
                Some((_, before)) => merge_patch::diff(before, state),
                None => Some(Value::clone(state)),
            };
            if let Some(change) = change {
                changes.insert(name.clone(), change);
            }
        }
        text(self.at, changes)
    }
}

fn text(at: f64, buses: Map<String, Value>) -> Arc<str> {
    let mut document = Map::new();
    document.insert("at".into(), at.into());
    if !buses.is_empty() {
        document.insert("buses".into(), Value::Object(buses));
    }
    Value::Object(document).to_string().into()
}

impl Reader {
    /// Waits until there is a frame that was not told. Never ends where the plant has ended.
    pub(crate) async fn changed(&mut self) {
        if self.frames.changed().await.is_err() {
            // The server ends; whoever waits is ended with it.
            std::future::pending::<()>().await;
        }
    }

    /// What has changed since this was asked last, as text: the whole state at first, then merge
    /// patches. However long ago that is, it is one patch.
    pub(crate) fn state(&mut self) -> Option<Arc<str>> {
        let newest = self.frames.borrow_and_update().clone()?;
        let text = match self.told.take() {
            None => newest.whole(),
            Some(told) if told.number == newest.number => {
                self.told = Some(told);
                return None;
            }
            Some(told) if told.number + 1 == newest.number => Arc::clone(&newest.patch),
            Some(told) => newest.patch_from(&told),
        };
        self.told = Some(newest);
        Some(text)
    }

    /// The reports since this was asked last, and how many are lost.
    pub(crate) fn reports(&mut self) -> (Vec<ReportDocument>, u64) {
        let journal = self.shared.journal();
        let (reports, lost) = journal.since(self.next_report);
        self.next_report = journal.next;
        (reports, lost)
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.shared.readers.fetch_sub(1, Ordering::Relaxed);
    }
}
