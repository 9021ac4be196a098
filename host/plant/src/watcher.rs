//! Several readers of one running plant, each with its own newest snapshots.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time;

use codewheel_station::{Duration, Instant};

use crate::report::prepend;
use crate::{BusSnapshot, Report};

/// A reader of a running plant.
///
/// It gets snapshots as often as it has asked for; what happens is told to every watcher, whenever it
/// looks. Dropping it ends the snapshots that were made for it alone.
#[derive(Debug)]
pub struct Watcher {
    board: Arc<Board>,
    id: u64,
}

/// Where the buses leave their snapshots for all who watch.
#[derive(Debug)]
pub(crate) struct Board {
    notes: Mutex<Notes>,
    changed: Condvar,
    /// The shortest period that anybody watches with, in nanoseconds.
    period: AtomicU64,
}

#[derive(Debug, Default)]
struct Notes {
    buses: usize,
    next_id: u64,
    watchers: BTreeMap<u64, Desk>,
    /// A bus has ended by itself.
    ended: bool,
}

/// What waits for one watcher.
#[derive(Debug)]
struct Desk {
    period: Duration,
    trays: Vec<Tray>,
}

/// What waits of one bus.
#[derive(Debug, Default)]
struct Tray {
    newest: Option<BusSnapshot>,
    /// When it wants the next one.
    next: Instant,
    /// What happened since the newest one that it got, or since then.
    untold: Untold,
}

/// Reports of a bus and of its devices, which stand in the order of the snapshot.
#[derive(Debug, Default)]
struct Untold {
    bus: Vec<Report>,
    devices: BTreeMap<String, Vec<Report>>,
}

impl Board {
    pub(crate) fn new(buses: usize) -> Arc<Self> {
        let notes = Notes { buses, ..Notes::default() };
        Arc::new(Self {
            notes: Mutex::new(notes),
            changed: Condvar::new(),
            period: AtomicU64::new(u64::MAX),
        })
    }

    fn lock(&self) -> MutexGuard<'_, Notes> {
        // A poisoned lock means that another thread has panicked; its last state is still whole.
        self.notes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How long a bus has until somebody wants its next snapshot.
    pub(crate) fn period(&self) -> Duration {
        Duration::from_nanos(self.period.load(Ordering::Relaxed))
    }

    /// A watcher that wants a snapshot of each bus every `period`.
    pub(crate) fn watch(self: &Arc<Self>, period: time::Duration) -> Watcher {
        let mut notes = self.lock();
        let id = notes.next_id;
        notes.next_id += 1;
        let mut trays = Vec::new();
        trays.resize_with(notes.buses, Tray::default);
        notes.watchers.insert(id, Desk { period: period.into(), trays });
        self.set_period(&notes);
        Watcher { board: Arc::clone(self), id }
    }

    fn set_period(&self, notes: &Notes) {
        let shortest = notes.watchers.values().map(|desk| desk.period.as_nanos()).min();
        self.period.store(shortest.unwrap_or(u64::MAX), Ordering::Relaxed);
    }

    /// Leaves the newest snapshot of the bus at `place`, which was made `now`; `last` where there will be no other.
    pub(crate) fn leave(&self, place: usize, now: Instant, snapshot: &BusSnapshot, last: bool) {
        let mut notes = self.lock();
        for desk in notes.watchers.values_mut() {
            let period = desk.period;
            let Some(tray) = desk.trays.get_mut(place) else { continue };
            if last || now >= tray.next {
                tray.next = now + period;
                tray.put(snapshot.clone());
            } else {
                tray.untold.note(snapshot);
            }
        }
        drop(notes);
        self.changed.notify_all();
    }

    /// A bus has ended by itself.
    pub(crate) fn end(&self) {
        self.lock().ended = true;
        self.changed.notify_all();
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.lock().ended
    }
}

impl Tray {
    /// The newest snapshot wins, but what happened before it is told all the same.
    fn put(&mut self, mut snapshot: BusSnapshot) {
        if let Some(older) = self.newest.take() {
            self.untold.put_before(&older);
        }
        let untold = std::mem::take(&mut self.untold);
        prepend(untold.bus, &mut snapshot.reports);
        for (name, reports) in untold.devices {
            if let Some(device) = snapshot.devices.iter_mut().find(|device| device.name == name) {
                prepend(reports, &mut device.reports);
            }
        }
        self.newest = Some(snapshot);
    }
}

impl Untold {
    /// Notes what happened after all that is noted.
    fn note(&mut self, newer: &BusSnapshot) {
        append(&mut self.bus, &newer.reports);
        for device in newer.devices.iter().filter(|device| !device.reports.is_empty()) {
            append(self.devices.entry(device.name.clone()).or_default(), &device.reports);
        }
    }

    /// Notes what happened before all that is noted.
    fn put_before(&mut self, older: &BusSnapshot) {
        prepend(older.reports.clone(), &mut self.bus);
        for device in older.devices.iter().filter(|device| !device.reports.is_empty()) {
            let later = self.devices.entry(device.name.clone()).or_default();
            prepend(device.reports.clone(), later);
        }
    }
}

/// Puts newer reports behind those that wait.
fn append(waiting: &mut Vec<Report>, newer: &[Report]) {
    if newer.is_empty() {
        return;
    }
    let mut newer = newer.to_vec();
    prepend(std::mem::take(waiting), &mut newer);
    *waiting = newer;
}

impl Watcher {
    /// Waits for snapshots that this watcher has not fetched, at most for `patience`: of each bus
    /// the newest, if there is one, in the order of the plan.
    #[must_use]
    pub fn snapshots(&self, patience: time::Duration) -> Vec<(usize, BusSnapshot)> {
        let nothing = |notes: &mut Notes| {
            let waiting = notes.watchers.get(&self.id).into_iter().flat_map(|desk| &desk.trays);
            !notes.ended && waiting.clone().all(|tray| tray.newest.is_none())
        };
        let notes = self.board.lock();
        let (mut notes, _) = self
            .board
            .changed
            .wait_timeout_while(notes, patience, nothing)
            .unwrap_or_else(PoisonError::into_inner);
        let trays = notes.watchers.get_mut(&self.id).into_iter().flat_map(|desk| &mut desk.trays);
        trays.enumerate().filter_map(|(place, tray)| Some((place, tray.newest.take()?))).collect()
    }

    /// Wants snapshots every `period` from now on, the first one at once.
    pub(crate) fn set_period(&self, period: time::Duration) {
        let mut notes = self.board.lock();
        if let Some(desk) = notes.watchers.get_mut(&self.id) {
            desk.period = period.into();
            desk.trays.iter_mut().for_each(|tray| tray.next = Instant::ZERO);
        }
        self.board.set_period(&notes);
    }

    /// Whether a bus was lost; then no snapshots of it come any more.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.board.has_ended()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        let mut notes = self.board.lock();
        notes.watchers.remove(&self.id);
        self.board.set_period(&notes);
    }
}
