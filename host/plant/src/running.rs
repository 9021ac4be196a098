//! A plant that runs by the clock on the wall, each bus in a thread of its own.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time;

use codewheel_capture::BusRecorder;
use codewheel_link::{Clock, LinkError, Waker};
use codewheel_station::Duration;

use crate::field_bus::{FieldBus, Line};
use crate::manned::Manned;
use crate::plant::AnyBusPlan;
use crate::report::prepend;
use crate::{
    BusPlan, BusSnapshot, DeviceNet, Plant, PortBus, Profibus, Recording, StartError, VirtualBus,
};

/// How often a virtual bus catches up with the clock on the wall.
const PACE: time::Duration = time::Duration::from_millis(5);

/// A plant that runs. Dropping it stops it and lets its memories finish.
#[derive(Debug)]
pub struct Running {
    shared: Arc<Shared>,
    uris: Vec<String>,
    wakers: Vec<Waker>,
    threads: Vec<JoinHandle<Result<(), LinkError>>>,
}

#[derive(Debug, Default)]
struct Shared {
    newest: Mutex<Newest>,
    changed: Condvar,
    stop: AtomicBool,
}

/// The newest snapshot of each bus that has not been fetched.
#[derive(Debug, Default)]
struct Newest {
    snapshots: Vec<Option<BusSnapshot>>,
    /// A bus has ended by itself.
    ended: bool,
}

impl Plant {
    /// Opens all memory files, then all ports, switches everything on and lets it run by the clock
    /// on the wall, with a snapshot of each bus every `period`.
    ///
    /// # Errors
    /// [`StartError`]; nothing is left half started.
    pub fn start(self, period: time::Duration) -> Result<Running, StartError> {
        Ok(Self::switch_on(self.join()?, period, None))
    }

    /// As [`start`](Self::start), and records what all buses carry into the file at `path`, whose
    /// suffix says its format. An older file is replaced when nothing else is in the way.
    ///
    /// # Errors
    /// [`StartError`]; nothing is left half started.
    pub fn start_recorded(
        self,
        period: time::Duration,
        path: &Path,
    ) -> Result<(Running, Recording), StartError> {
        let buses: Vec<_> = self.buses.iter().map(AnyBusPlan::captured).collect();
        Recording::check(path, &buses)?;
        let ready = self.join()?;
        let recording = Recording::create(path, buses)?;
        Ok((Self::switch_on(ready, period, Some(&recording)), recording))
    }

    /// Opens all memory files, then all ports.
    fn join(self) -> Result<Vec<AnyReady>, StartError> {
        let manned: Vec<AnyManned> =
            self.buses.into_iter().map(AnyManned::open).collect::<Result<_, _>>()?;
        Ok(manned.into_iter().map(AnyManned::join).collect::<Result<_, _>>()?)
    }

    fn switch_on(
        ready: Vec<AnyReady>,
        period: time::Duration,
        recording: Option<&Recording>,
    ) -> Running {
        let clock = Clock::new();
        let shared = Arc::new(Shared::default());
        shared.lock().snapshots.resize_with(ready.len(), || None);
        let mut running =
            Running { shared, uris: Vec::new(), wakers: Vec::new(), threads: Vec::new() };
        for (place, ready) in ready.into_iter().enumerate() {
            let shared = Arc::clone(&running.shared);
            // The time of each bus, simulated or not, is that of the one clock.
            let recorder = recording.map(|recording| recording.bus(place, clock.now()));
            let post = Post { shared, place, clock, period: period.into(), recorder };
            match ready {
                AnyReady::DeviceNet(ready) => running.run(ready, post),
                AnyReady::Profibus(ready) => running.run(ready, post),
            }
        }
        running
    }
}

/// A bus whose memories are open.
enum AnyManned {
    DeviceNet(Manned<DeviceNet>),
    Profibus(Manned<Profibus>),
}

/// A bus whose port is open too, where it has one.
enum AnyReady {
    DeviceNet(Ready<DeviceNet>),
    Profibus(Ready<Profibus>),
}

struct Ready<B: FieldBus> {
    manned: Manned<B>,
    port: Option<B::Port>,
}

impl AnyManned {
    fn open(plan: AnyBusPlan) -> Result<Self, StartError> {
        Ok(match plan {
            AnyBusPlan::DeviceNet(plan) => Self::DeviceNet(Manned::open(plan)?),
            AnyBusPlan::Profibus(plan) => Self::Profibus(Manned::open(plan)?),
        })
    }

    fn join(self) -> Result<AnyReady, LinkError> {
        Ok(match self {
            Self::DeviceNet(manned) => AnyReady::DeviceNet(Ready::join(manned)?),
            Self::Profibus(manned) => AnyReady::Profibus(Ready::join(manned)?),
        })
    }
}

impl<B: FieldBus> Ready<B> {
    fn join(manned: Manned<B>) -> Result<Self, LinkError> {
        let BusPlan { uri, bit_rate, .. } = &manned.plan;
        let real = !manned.plan.is_virtual();
        let port = real.then(|| B::open(uri, *bit_rate)).transpose()?;
        Ok(Self { manned, port })
    }
}

/// Where the thread of a bus leaves its snapshots.
struct Post {
    shared: Arc<Shared>,
    place: usize,
    clock: Clock,
    period: Duration,
    recorder: Option<BusRecorder>,
}

impl Post {
    fn stopped(&self) -> bool {
        self.shared.stop.load(Ordering::Relaxed)
    }

    fn run_virtual<B: FieldBus>(&self, mut bus: VirtualBus<B>) {
        let mut next = self.clock.now();
        while !self.stopped() {
            let now = self.clock.now();
            match &self.recorder {
                None => bus.run_until(now, &mut |_| {}),
                Some(recorder) => {
                    bus.run_until(now, &mut |event| B::Line::record(event, recorder));
                }
            }
            if now >= next {
                next = now + self.period;
                self.leave(bus.snapshot());
            }
            std::thread::sleep(PACE);
        }
        bus.finish();
        self.leave(bus.snapshot());
    }

    fn run_port<B: FieldBus>(&self, mut bus: PortBus<B>) -> Result<(), LinkError> {
        if let Some(recorder) = self.recorder.clone() {
            bus.record_with(recorder);
        }
        let mut next = self.clock.now();
        let mut result = Ok(());
        while !self.stopped() && result.is_ok() {
            result = bus.turn(Some(next));
            let now = self.clock.now();
            if now >= next {
                next = now + self.period;
                self.leave(bus.snapshot());
            }
        }
        bus.finish();
        self.leave(bus.snapshot());
        if result.is_err() {
            self.shared.lock().ended = true;
            self.shared.changed.notify_all();
        }
        result
    }

    fn leave(&self, mut snapshot: BusSnapshot) {
        let mut newest = self.shared.lock();
        let Some(place) = newest.snapshots.get_mut(self.place) else { return };
        if let Some(older) = place.take() {
            keep_reports(older, &mut snapshot);
        }
        *place = Some(snapshot);
        self.shared.changed.notify_all();
    }
}

/// The newest snapshot wins, but what happened before it is told all the same.
fn keep_reports(older: BusSnapshot, newer: &mut BusSnapshot) {
    prepend(older.reports, &mut newer.reports);
    for (older, newer) in older.devices.into_iter().zip(&mut newer.devices) {
        prepend(older.reports, &mut newer.reports);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Newest> {
        // A poisoned lock means that the other thread has panicked; its last state is still whole.
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Running {
    /// Switches a bus on and gives it a thread.
    fn run<B: FieldBus>(&mut self, Ready { manned, port }: Ready<B>, post: Post) {
        let thread = match port {
            None => {
                self.uris.push(manned.plan.uri.to_string());
                let bus = VirtualBus::begin(manned);
                std::thread::spawn(move || {
                    post.run_virtual(bus);
                    Ok(())
                })
            }
            Some(port) => {
                let bus = PortBus::begin(manned, port, post.clock);
                self.uris.push(bus.uri().to_owned());
                self.wakers.push(bus.waker());
                std::thread::spawn(move || post.run_port(bus))
            }
        };
        self.threads.push(thread);
    }

    /// Where each bus is, in the order of the plan, with the port it really got.
    #[must_use]
    pub fn uris(&self) -> &[String] {
        &self.uris
    }

    /// Waits for snapshots that have not been fetched, at most for `patience`: of each bus the
    /// newest, if there is one, in the order of the plan.
    #[must_use]
    pub fn snapshots(&self, patience: time::Duration) -> Vec<(usize, BusSnapshot)> {
        let nothing =
            |newest: &mut Newest| !newest.ended && newest.snapshots.iter().all(Option::is_none);
        let newest = self.shared.lock();
        let (mut newest, _) = self
            .shared
            .changed
            .wait_timeout_while(newest, patience, nothing)
            .unwrap_or_else(PoisonError::into_inner);
        let snapshots = newest.snapshots.iter_mut().enumerate();
        snapshots.filter_map(|(place, snapshot)| Some((place, snapshot.take()?))).collect()
    }

    /// Whether a bus was lost; [`stop`](Self::stop) says why.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.shared.lock().ended
    }

    /// Stops all buses, lets the memories finish, and gives what is left to tell.
    ///
    /// # Errors
    /// [`LinkError`] where a bus was lost.
    pub fn stop(mut self) -> (Vec<(usize, BusSnapshot)>, Result<(), LinkError>) {
        let result = self.join();
        (self.snapshots(time::Duration::ZERO), result)
    }

    fn join(&mut self) -> Result<(), LinkError> {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.wakers.iter().for_each(Waker::wake);
        let mut result = Ok(());
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so.
            result = result.and(thread.join().unwrap_or(Ok(())));
        }
        result
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.join();
    }
}
