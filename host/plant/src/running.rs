//! A plant that runs by the clock on the wall, each bus in a thread of its own.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender, TrySendError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time;

use codewheel_link::{Clock, LinkError, Waker};
use codewheel_station::{Duration, Instant};

use crate::ears::Ears;
use crate::field_bus::{FieldBus, Line};
use crate::manned::Manned;
use crate::plant::AnyBusPlan;
use crate::watcher::Board;
use crate::{
    BusDescription, BusPlan, BusSnapshot, Cause, Command, DeviceNet, Done, ObjectGroup, Plant,
    PortBus, Profibus, Recording, Refusal, StartError, Ticket, Trace, VirtualBus, Watcher,
};

/// How often a virtual bus catches up with the clock on the wall.
const PACE: time::Duration = time::Duration::from_millis(5);

/// How much of its time a virtual bus makes up for at once.
const SLICE: Duration = Duration::from_millis(20);

/// Rates are averaged over so long a time at least, however often somebody looks.
const WINDOW: Duration = Duration::from_millis(500);

/// How many commands wait for one bus at most.
const WAITING: usize = 32;

/// How long a command or a question waits for its answer: longer than the bus itself waits for a
/// memory or a master.
const PATIENCE: time::Duration = time::Duration::from_secs(10);

/// A plant that runs. Dropping it stops it and lets its memories finish.
///
/// It can be shared between threads: who shows it holds a [`Watcher`], who does something to it calls
/// [`command`](Self::command).
#[derive(Debug)]
pub struct Running {
    board: Arc<Board>,
    /// The one that [`snapshots`](Self::snapshots) fetches from.
    watcher: Watcher,
    stop: Arc<AtomicBool>,
    buses: Vec<Wire>,
    descriptions: Vec<BusDescription>,
    uris: Vec<String>,
    threads: Mutex<Vec<JoinHandle<Result<(), LinkError>>>>,
}

/// The way to the thread of a bus.
#[derive(Debug)]
struct Wire {
    orders: SyncSender<Order>,
    ears: Arc<Ears>,
    /// Ends a wait of the port, where there is one; a virtual bus looks every [`PACE`].
    waker: Option<Waker>,
}

/// What the thread of a bus is asked.
#[derive(Debug)]
enum Order {
    Command { device: String, command: Command, reply: SyncSender<Result<Done, Refusal>> },
    Objects { device: String, reply: SyncSender<Result<Vec<ObjectGroup>, Refusal>> },
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
        let board = Board::new(ready.len());
        let mut running = Running {
            watcher: board.watch(period),
            board,
            stop: Arc::new(AtomicBool::new(false)),
            buses: Vec::new(),
            descriptions: Vec::new(),
            uris: Vec::new(),
            threads: Mutex::new(Vec::new()),
        };
        for (place, ready) in ready.into_iter().enumerate() {
            // The time of each bus, simulated or not, is that of the one clock.
            let recorder = recording.map(|recording| recording.bus(place, clock.now()));
            let (orders, waiting) = mpsc::sync_channel(WAITING);
            let ears = Arc::new(Ears::new(recorder));
            let post = Post {
                board: Arc::clone(&running.board),
                stop: Arc::clone(&running.stop),
                place,
                clock,
                ears: Arc::clone(&ears),
                orders: waiting,
                unanswered: Vec::new(),
            };
            let waker = match ready {
                AnyReady::DeviceNet(ready) => running.run(ready, post),
                AnyReady::Profibus(ready) => running.run(ready, post),
            };
            running.buses.push(Wire { orders, ears, waker });
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

/// A command that a bus has taken and not answered.
type Unanswered = (Ticket, SyncSender<Result<Done, Refusal>>);

/// What the thread of a bus has to do besides running it.
struct Post {
    board: Arc<Board>,
    stop: Arc<AtomicBool>,
    place: usize,
    clock: Clock,
    ears: Arc<Ears>,
    orders: Receiver<Order>,
    unanswered: Vec<Unanswered>,
}

impl Drop for Post {
    fn drop(&mut self) {
        // Whoever watches must not wait for a bus that has come to grief in a bug of ours.
        if std::thread::panicking() {
            self.board.end();
        }
    }
}

/// A bus in a thread.
trait Served {
    fn command(&mut self, device: &str, command: &Command) -> Ticket;
    fn take_answer(&mut self, ticket: Ticket) -> Option<Result<Done, Refusal>>;
    fn objects(&self, device: &str) -> Result<Vec<ObjectGroup>, Refusal>;
    fn snapshot(&mut self) -> BusSnapshot;
    fn finish(&mut self);
}

macro_rules! served {
    ($bus:ident) => {
        impl<B: FieldBus> Served for $bus<B> {
            fn command(&mut self, device: &str, command: &Command) -> Ticket {
                Self::command(self, device, command)
            }

            fn take_answer(&mut self, ticket: Ticket) -> Option<Result<Done, Refusal>> {
                Self::take_answer(self, ticket)
            }

            fn objects(&self, device: &str) -> Result<Vec<ObjectGroup>, Refusal> {
                Self::objects(self, device)
            }

            fn snapshot(&mut self) -> BusSnapshot {
                Self::snapshot(self)
            }

            fn finish(&mut self) {
                Self::finish(self);
            }
        }
    };
}
served!(VirtualBus);
served!(PortBus);

impl Post {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn run_virtual<B: FieldBus>(mut self, mut bus: VirtualBus<B>) {
        let mut next = self.clock.now();
        while !self.stopped() {
            let now = self.clock.now();
            // A bus that falls behind, on a busy computer, still hears what people want.
            let until = now.min(bus.now() + SLICE);
            if self.ears.are_open() {
                let ears = Arc::clone(&self.ears);
                bus.run_until(until, &mut |event| B::Line::record(event, &ears));
            } else {
                bus.run_until(until, &mut |_| {});
            }
            self.serve(&mut bus);
            self.show(&mut bus, now, &mut next);
            if until == now {
                std::thread::sleep(PACE);
            }
        }
        self.end(&mut bus);
    }

    fn run_port<B: FieldBus>(mut self, mut bus: PortBus<B>) -> Result<(), LinkError> {
        let mut next = self.clock.now();
        let mut result = Ok(());
        let mut listens = false;
        while !self.stopped() && result.is_ok() {
            if listens != self.ears.are_open() {
                listens = !listens;
                bus.listen(listens.then(|| Arc::clone(&self.ears)));
            }
            result = bus.turn(Some(next.min(self.clock.now() + self.board.period())));
            let now = self.clock.now();
            self.serve(&mut bus);
            self.show(&mut bus, now, &mut next);
        }
        self.end(&mut bus);
        if result.is_err() {
            self.board.end();
        }
        result
    }

    /// Does what people ask for, and answers what has come of it.
    fn serve(&mut self, bus: &mut impl Served) {
        for order in self.orders.try_iter() {
            match order {
                Order::Command { device, command, reply } => {
                    self.unanswered.push((bus.command(&device, &command), reply));
                }
                // Whoever does not wait any more needs no answer, here and below.
                Order::Objects { device, reply } => drop(reply.try_send(bus.objects(&device))),
            }
        }
        self.unanswered.retain(|(ticket, reply)| match bus.take_answer(*ticket) {
            Some(answer) => {
                let _ = reply.try_send(answer);
                false
            }
            None => true,
        });
    }

    /// Leaves a snapshot when somebody wants one.
    fn show(&self, bus: &mut impl Served, now: Instant, next: &mut Instant) {
        // Somebody may have come who wants them more often.
        let period = self.board.period();
        *next = (*next).min(now + period);
        if now >= *next {
            *next = now + period;
            self.board.leave(self.place, now, &bus.snapshot(), false);
        }
    }

    fn end(&self, bus: &mut impl Served) {
        bus.finish();
        self.board.leave(self.place, self.clock.now(), &bus.snapshot(), true);
    }
}

impl Running {
    /// Switches a bus on and gives it a thread; gives what wakes its port.
    fn run<B: FieldBus>(&mut self, Ready { manned, port }: Ready<B>, post: Post) -> Option<Waker> {
        let mut description = manned.describe();
        let (waker, thread) = match port {
            None => {
                let mut bus = VirtualBus::begin(manned);
                bus.set_window(WINDOW);
                let run = move || {
                    post.run_virtual(bus);
                    Ok(())
                };
                (None, std::thread::spawn(run))
            }
            Some(port) => {
                let mut bus = PortBus::begin(manned, port, post.clock);
                bus.set_window(WINDOW);
                bus.uri().clone_into(&mut description.uri);
                (Some(bus.waker()), std::thread::spawn(move || post.run_port(bus)))
            }
        };
        self.uris.push(description.uri.clone());
        self.descriptions.push(description);
        self.threads().push(thread);
        waker
    }

    fn threads(&self) -> MutexGuard<'_, Vec<JoinHandle<Result<(), LinkError>>>> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where each bus is, in the order of the plan, with the port it really got.
    #[must_use]
    pub fn uris(&self) -> &[String] {
        &self.uris
    }

    /// What does not change while the plant runs, in the order of the plan.
    #[must_use]
    pub fn descriptions(&self) -> &[BusDescription] {
        &self.descriptions
    }

    /// Does something to the device `device` of the bus `bus`, each called as the plan calls it, and
    /// waits until it is done: some milliseconds, for a Save or a master up to some seconds.
    ///
    /// # Errors
    /// [`Refusal`]; with the causes [`Late`](Cause::Late) and [`Stopped`](Cause::Stopped) nobody
    /// knows what was done, with all others nothing was.
    pub fn command(&self, bus: &str, device: &str, command: Command) -> Result<Done, Refusal> {
        let (reply, answer) = mpsc::sync_channel(1);
        self.ask(bus, Order::Command { device: device.to_owned(), command, reply }, &answer)
    }

    /// What can be read of a device and set, with the values of now.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn objects(&self, bus: &str, device: &str) -> Result<Vec<ObjectGroup>, Refusal> {
        let (reply, answer) = mpsc::sync_channel(1);
        self.ask(bus, Order::Objects { device: device.to_owned(), reply }, &answer)
    }

    /// Listens to what the bus `bus` carries from now on.
    ///
    /// # Errors
    /// [`Refusal`] where there is no such bus.
    pub fn trace(&self, bus: &str) -> Result<Trace, Refusal> {
        let (place, wire) = self.wire(bus)?;
        let description = &self.descriptions[place];
        let trace = Trace::begin(description, &wire.ears);
        wire.waker.iter().for_each(Waker::wake);
        Ok(trace)
    }

    /// A reader of its own, which gets a snapshot of each bus every `period`. A virtual bus moves on
    /// every 5 ms, so shorter periods bring no more.
    #[must_use]
    pub fn watch(&self, period: time::Duration) -> Watcher {
        let watcher = self.board.watch(period);
        self.wake();
        watcher
    }

    /// Gives a reader a snapshot of each bus every `period` from now on, the first one soon. What has
    /// happened meanwhile is told once, as ever.
    pub fn watch_every(&self, watcher: &Watcher, period: time::Duration) {
        watcher.set_period(period);
        self.wake();
    }

    /// Waits for snapshots that have not been fetched, at most for `patience`: of each bus the
    /// newest, if there is one, in the order of the plan. They come as often as the plant was told at
    /// its start.
    #[must_use]
    pub fn snapshots(&self, patience: time::Duration) -> Vec<(usize, BusSnapshot)> {
        self.watcher.snapshots(patience)
    }

    /// Whether a bus was lost; [`stop`](Self::stop) says why.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.board.has_ended()
    }

    /// Stops all buses, lets the memories finish, and gives what is left to tell.
    ///
    /// # Errors
    /// [`LinkError`] where a bus was lost.
    pub fn stop(&self) -> (Vec<(usize, BusSnapshot)>, Result<(), LinkError>) {
        let result = self.join();
        (self.snapshots(time::Duration::ZERO), result)
    }

    fn wire(&self, bus: &str) -> Result<(usize, &Wire), Refusal> {
        let place = self.descriptions.iter().position(|known| known.name == bus);
        place.and_then(|place| Some((place, self.buses.get(place)?))).ok_or_else(|| {
            let names: Vec<_> = self.descriptions.iter().map(|bus| bus.name.as_str()).collect();
            let text = format!("there is no bus {bus:?}: there is {}", names.join(", "));
            Refusal::new(Cause::Unknown, text)
        })
    }

    fn ask<T>(
        &self,
        bus: &str,
        order: Order,
        answer: &Receiver<Result<T, Refusal>>,
    ) -> Result<T, Refusal> {
        let (_, wire) = self.wire(bus)?;
        let stopped = || {
            let text = format!("the bus {bus} has stopped: start the plant anew");
            Refusal::new(Cause::Stopped, text)
        };
        wire.orders.try_send(order).map_err(|error| match error {
            TrySendError::Full(_) => {
                let text = format!(
                    "{WAITING} commands wait for the bus {bus} already: try again when they are done"
                );
                Refusal::new(Cause::Busy, text)
            }
            TrySendError::Disconnected(_) => stopped(),
        })?;
        wire.waker.iter().for_each(Waker::wake);
        answer.recv_timeout(PATIENCE).map_err(|error| match error {
            RecvTimeoutError::Timeout => {
                let text =
                    format!("the bus {bus} has not answered within {PATIENCE:?}: look at it");
                Refusal::new(Cause::Late, text)
            }
            RecvTimeoutError::Disconnected => stopped(),
        })?
    }

    fn wake(&self) {
        self.buses.iter().filter_map(|wire| wire.waker.as_ref()).for_each(Waker::wake);
    }

    fn join(&self) -> Result<(), LinkError> {
        self.stop.store(true, Ordering::Relaxed);
        self.wake();
        let mut result = Ok(());
        for thread in self.threads().drain(..) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bus_whose_thread_panics_is_a_lost_bus_to_all_who_watch() {
        let board = Board::new(1);
        let (_orders, waiting) = mpsc::sync_channel(1);
        let post = Post {
            board: Arc::clone(&board),
            stop: Arc::default(),
            place: 0,
            clock: Clock::new(),
            ears: Arc::new(Ears::new(None)),
            orders: waiting,
            unanswered: Vec::new(),
        };
        let thread = std::thread::spawn(move || {
            let _post = post;
            panic!("on purpose");
        });
        thread.join().expect_err("it panics");
        assert!(board.has_ended());
    }
}
