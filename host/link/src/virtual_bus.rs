//! `virtual:NAME`: a bus inside this process, shared by threads.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use codewheel_station::can::{BitRate, Frame};

use crate::{CanPort, LinkError, Notice, Received, Waker};

/// Reports kept for one port; beyond them the oldest frames are lost.
const REPORTS: usize = 1024;

/// The buses that somebody is on, by name. They belong to their ports and end with the last one.
static BUSES: Mutex<BTreeMap<String, Weak<Bus>>> = Mutex::new(BTreeMap::new());

/// Joins the bus `name`, or lays it where it is not yet.
pub(crate) fn join(name: &str, rate: BitRate) -> Result<VirtualPort, LinkError> {
    let mut buses = lock(&BUSES);
    buses.retain(|_, bus| bus.strong_count() > 0);
    let bus = match buses.get(name).and_then(Weak::upgrade) {
        Some(bus) => bus,
        None => {
            let bus = Arc::new(Bus { name: name.to_owned(), rate, seats: Mutex::default() });
            buses.insert(name.to_owned(), Arc::downgrade(&bus));
            bus
        }
    };
    if bus.rate != rate {
        let (name, actual) = (name.to_owned(), bus.rate);
        return Err(LinkError::OtherBitRate { name, asked: rate, actual });
    }
    let mut seats = lock(&bus.seats);
    let number = seats.next;
    seats.next += 1;
    let bell = Arc::new(Condvar::new());
    seats.taken.insert(number, Seat::new(Arc::clone(&bell)));
    seats.acknowledge_the_lone();
    drop(seats);
    Ok(VirtualPort { bus, number, bell })
}

/// A wire: whoever holds the lock has the bus, so there is one order.
#[derive(Debug)]
struct Bus {
    name: String,
    rate: BitRate,
    seats: Mutex<Seats>,
}

#[derive(Debug, Default)]
struct Seats {
    next: u64,
    taken: BTreeMap<u64, Seat>,
}

/// One port's place on the bus.
#[derive(Debug)]
struct Seat {
    inbox: VecDeque<Received>,
    frames_lost: u64,
    /// A frame that a lone node repeats until somebody acknowledges it.
    unacknowledged: Option<Frame>,
    woken: bool,
    /// Rung for this port alone, so that a frame wakes only those it is for.
    bell: Arc<Condvar>,
}

impl Seat {
    fn new(bell: Arc<Condvar>) -> Self {
        Self { inbox: VecDeque::new(), frames_lost: 0, unacknowledged: None, woken: false, bell }
    }

    /// Leaves a report. Reports of our own frames are kept before frames of others: somebody waits
    /// for them.
    fn leave(&mut self, received: Received) {
        if self.inbox.len() >= REPORTS {
            let oldest = self.inbox.iter().position(|kept| matches!(kept, Received::Frame(_)));
            self.inbox.remove(oldest.unwrap_or_default());
            self.frames_lost += 1;
        }
        self.inbox.push_back(received);
        self.bell.notify_one();
    }
}

impl Seats {
    /// Brings the frame of seat `from` to all others, or keeps it until there are others.
    fn put(&mut self, from: u64, frame: &Frame) {
        let is_alone = self.taken.len() < 2;
        for (number, seat) in &mut self.taken {
            match (*number == from, is_alone) {
                (true, true) => seat.unacknowledged = Some(*frame),
                (true, false) => seat.leave(Received::Sent(*frame)),
                (false, _) => seat.leave(Received::Frame(*frame)),
            }
        }
    }

    /// Delivers what a lone node had to repeat, now that it is no longer alone.
    fn acknowledge_the_lone(&mut self) {
        if self.taken.len() < 2 {
            return;
        }
        let waiting: Vec<_> = self
            .taken
            .iter_mut()
            .filter_map(|(number, seat)| Some((*number, seat.unacknowledged.take()?)))
            .collect();
        for (number, frame) in waiting {
            self.put(number, &frame);
        }
    }
}

/// A node on a virtual bus. Its frames are confirmed when at least one other node is there.
#[derive(Debug)]
pub(crate) struct VirtualPort {
    bus: Arc<Bus>,
    number: u64,
    bell: Arc<Condvar>,
}

impl CanPort for VirtualPort {
    fn is_ready(&self) -> bool {
        let seats = lock(&self.bus.seats);
        seats
            .taken
            .get(&self.number)
            .is_some_and(|seat| seat.unacknowledged.is_none() && seat.inbox.len() < REPORTS)
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        let ready = self.is_ready();
        if ready {
            lock(&self.bus.seats).put(self.number, frame);
        }
        Ok(ready)
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        let end = wait.and_then(|wait| Instant::now().checked_add(wait));
        let mut seats = lock(&self.bus.seats);
        loop {
            let Some(seat) = seats.taken.get_mut(&self.number) else { return Ok(None) };
            // First, so that a flood does not drown it.
            if std::mem::take(&mut seat.woken) {
                return Ok(Some(Received::Woken));
            }
            let count = std::mem::take(&mut seat.frames_lost);
            if count > 0 {
                return Ok(Some(Received::Notice(Notice::FramesLost { count })));
            }
            if let Some(received) = seat.inbox.pop_front() {
                return Ok(Some(received));
            }
            seats = match end {
                None => self.bell.wait(seats).unwrap_or_else(PoisonError::into_inner),
                Some(end) => {
                    let left = end.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return Ok(None);
                    }
                    let waited = self.bell.wait_timeout(seats, left);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
    }

    fn waker(&self) -> Waker {
        let (bus, number) = (Arc::downgrade(&self.bus), self.number);
        Waker::new(move || {
            let Some(bus) = bus.upgrade() else { return };
            if let Some(seat) = lock(&bus.seats).taken.get_mut(&number) {
                seat.woken = true;
                seat.bell.notify_one();
            }
        })
    }

    fn confirms(&self) -> bool {
        true
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        format!("virtual:{}", self.bus.name)
    }
}

impl Drop for VirtualPort {
    fn drop(&mut self) {
        lock(&self.bus.seats).taken.remove(&self.number);
    }
}

/// Locks, also after a thread panicked with the lock: every change under it is whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
