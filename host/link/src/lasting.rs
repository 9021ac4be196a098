//! A port that outlives what leads to its bus: an adapter that was pulled out, a connection that
//! broke, an interface that went down.

use std::collections::VecDeque;
use std::fmt;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use codewheel_station::can::Frame;
use codewheel_station::rs485::{BaudRate, Transmission};

use crate::socket::{Limit, Watch};
use crate::{BusUri, CanPort, LinkError, Notice, Received, Rs485Port, Rs485Received, Waker};

/// The pause before the first attempt.
const FIRST_PAUSE: Duration = Duration::from_millis(500);

/// The longest pause between two attempts.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// What lasted so long had really been there: the next loss is a new one.
const SETTLED: Duration = Duration::from_secs(10);

/// What the two kinds of ports differ in here.
pub(crate) trait Port: Send {
    /// What it gives to its owner.
    type Received: Send + fmt::Debug;
    /// What it must be told again when it is back.
    type State: Default + Send + fmt::Debug;

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Self::Received>, LinkError>;
    fn waker(&self) -> Waker;
    fn resume(&mut self, state: &Self::State) -> Result<(), LinkError>;

    fn notice(notice: Notice) -> Self::Received;
    fn woken() -> Self::Received;
    fn is_woken(received: &Self::Received) -> bool;
    /// What the station must know of a loss, and of its end.
    fn lost() -> Option<Self::Received>;
    fn back() -> Option<Self::Received>;
}

/// Opens a port once more.
type Open<P> = Arc<dyn Fn() -> Result<Box<P>, LinkError> + Send + Sync>;

/// Joins the bus `uri` with `open`, and again whenever it is lost.
///
/// # Errors
/// What `open` says the first time: a name with a slip of the pen in it is not tried for ever.
pub(crate) fn lasting<P: Port + ?Sized + 'static>(
    uri: &BusUri,
    open: impl Fn() -> Result<Box<P>, LinkError> + Send + Sync + 'static,
) -> Result<Lasting<P>, LinkError> {
    let port = open()?;
    let wake = Arc::new(Wake { woken: AtomicBool::new(false), current: Mutex::new(port.waker()) });
    Ok(Lasting {
        bus: uri.to_string(),
        open: Arc::new(open),
        state: P::State::default(),
        watch: Watch::new()?,
        wake,
        inbox: VecDeque::new(),
        place: Place::Here { port, since: Instant::now() },
        pause: Duration::ZERO,
        was_lost: false,
    })
}

/// A port that is there, or is sought.
pub(crate) struct Lasting<P: Port + ?Sized> {
    bus: String,
    open: Open<P>,
    state: P::State,
    /// Where the owner waits while there is no port.
    watch: Watch,
    wake: Arc<Wake>,
    inbox: VecDeque<P::Received>,
    place: Place<P>,
    /// The pause before the last attempt.
    pause: Duration,
    was_lost: bool,
}

enum Place<P: Port + ?Sized> {
    Here {
        port: Box<P>,
        since: Instant,
    },
    Sought {
        attempts: Receiver<Result<Box<P>, LinkError>>,
        /// Why the last attempt failed, as people heard it.
        told: Option<String>,
        /// The search ends when this is gone.
        _stop: Sender<()>,
    },
}

/// Ends a wait, wherever the owner waits.
struct Wake {
    woken: AtomicBool,
    current: Mutex<Waker>,
}

impl Wake {
    fn wake(&self) {
        self.woken.store(true, Ordering::Release);
        self.current.lock().unwrap_or_else(PoisonError::into_inner).wake();
    }

    /// Whether it was used since the last call.
    fn take(&self) -> bool {
        self.woken.swap(false, Ordering::AcqRel)
    }

    fn lead_to(&self, waker: Waker) {
        *self.current.lock().unwrap_or_else(PoisonError::into_inner) = waker;
    }
}

impl<P: Port + ?Sized> fmt::Debug for Lasting<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Lasting").field("bus", &self.bus).finish_non_exhaustive()
    }
}

impl<P: Port + ?Sized + 'static> Lasting<P> {
    fn port(&self) -> Option<&P> {
        match &self.place {
            Place::Here { port, .. } => Some(port),
            Place::Sought { .. } => None,
        }
    }

    fn port_mut(&mut self) -> Option<&mut P> {
        match &mut self.place {
            Place::Here { port, .. } => Some(port),
            Place::Sought { .. } => None,
        }
    }

    fn wait_for(&mut self, wait: Option<Duration>) -> Result<Option<P::Received>, LinkError> {
        let limit = Limit::after(wait);
        loop {
            // First, so that a flood does not drown it.
            if self.wake.take() {
                return Ok(Some(P::woken()));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            match &mut self.place {
                Place::Here { port, since } => match port.receive(limit.remaining()) {
                    // Who woke it raised our flag before.
                    Ok(Some(received)) if P::is_woken(&received) => {}
                    Ok(received) => return Ok(received),
                    // An adapter that refuses is to be heard of; later it may only need time.
                    Err(error) if error.is_loss() || self.was_lost => {
                        let lived = since.elapsed();
                        self.lose(&error, lived)?;
                    }
                    Err(error) => return Err(error),
                },
                Place::Sought { .. } => {
                    self.look()?;
                    if !self.inbox.is_empty() {
                        continue;
                    }
                    if limit.is_over() {
                        return Ok(None);
                    }
                    self.watch.wait(limit.remaining())?;
                    // What it was woken for, our flag says.
                    self.watch.take_woken();
                }
            }
        }
    }

    /// The port is gone after so long: the search begins.
    fn lose(&mut self, error: &LinkError, lived: Duration) -> Result<(), LinkError> {
        let reason = match error {
            LinkError::Lost { reason, .. } => reason.clone(),
            error => error.to_string(),
        };
        self.was_lost = true;
        self.pause = if lived >= SETTLED { FIRST_PAUSE } else { longer(self.pause) };
        self.wake.lead_to(self.watch.waker());
        let (stop, stopped) = channel();
        let (report, attempts) = channel();
        let (open, waker, pause) = (Arc::clone(&self.open), self.watch.waker(), self.pause);
        // Opening may take seconds, which the station's time does not wait for.
        thread::Builder::new()
            .name(format!("seeking {}", self.bus))
            .spawn(move || seek(&open, pause, &stopped, &report, &waker))
            .map_err(LinkError::System)?;
        self.place = Place::Sought { attempts, told: None, _stop: stop };
        self.inbox.push_back(P::notice(Notice::BusLost { bus: self.bus.clone(), reason }));
        self.inbox.extend(P::lost());
        Ok(())
    }

    /// Takes in what came of the search.
    fn look(&mut self) -> Result<(), LinkError> {
        let Place::Sought { attempts, told, .. } = &mut self.place else { return Ok(()) };
        match attempts.try_recv() {
            Ok(Ok(mut port)) => {
                port.resume(&self.state)?;
                self.wake.lead_to(port.waker());
                self.place = Place::Here { port, since: Instant::now() };
                self.inbox.push_back(P::notice(Notice::BusBack { bus: self.bus.clone() }));
                self.inbox.extend(P::back());
            }
            Ok(Err(error)) => {
                self.pause = longer(self.pause);
                let reason = error.to_string();
                if told.as_ref() != Some(&reason) {
                    *told = Some(reason.clone());
                    self.inbox.push_back(P::notice(Notice::BusStillLost { reason }));
                }
            }
            // The search goes on; one whose thread is gone has said so before.
            Err(_) => {}
        }
        Ok(())
    }
}

/// Opens until it succeeds or nobody wants it any more, with pauses that grow.
fn seek<P: Port + ?Sized>(
    open: &Open<P>,
    mut pause: Duration,
    stopped: &Receiver<()>,
    report: &Sender<Result<Box<P>, LinkError>>,
    waker: &Waker,
) {
    while stopped.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
        let attempt = open();
        let is_done = attempt.is_ok();
        if report.send(attempt).is_err() {
            return;
        }
        waker.wake();
        if is_done {
            return;
        }
        pause = longer(pause);
    }
}

fn longer(pause: Duration) -> Duration {
    (pause * 2).clamp(FIRST_PAUSE, LONGEST_PAUSE)
}

impl Port for dyn CanPort {
    type Received = Received;
    type State = ();

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        CanPort::receive(self, wait)
    }

    fn waker(&self) -> Waker {
        CanPort::waker(self)
    }

    fn resume(&mut self, (): &()) -> Result<(), LinkError> {
        Ok(())
    }

    fn notice(notice: Notice) -> Received {
        Received::Notice(notice)
    }

    fn woken() -> Received {
        Received::Woken
    }

    fn is_woken(received: &Received) -> bool {
        *received == Received::Woken
    }

    fn lost() -> Option<Received> {
        Some(Received::Detached)
    }

    fn back() -> Option<Received> {
        Some(Received::Attached)
    }
}

impl CanPort for Lasting<dyn CanPort> {
    fn is_ready(&self) -> bool {
        // A station that has yet to hear that it was away says nothing.
        self.inbox.is_empty() && self.port().is_some_and(CanPort::is_ready)
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        if !self.is_ready() {
            return Ok(false);
        }
        // A port that is gone says so in `receive`, after what had arrived.
        Ok(self.port_mut().is_some_and(|port| port.send(frame).unwrap_or_default()))
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        self.wait_for(wait)
    }

    fn waker(&self) -> Waker {
        let wake = Arc::clone(&self.wake);
        Waker::new(move || wake.wake())
    }

    fn confirms(&self) -> bool {
        self.port().is_none_or(CanPort::confirms)
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        self.bus.clone()
    }
}

/// A rate that the station asked for, and whether the line has one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LineState {
    rate: Option<BaudRate>,
    has_rate: bool,
}

impl Port for dyn Rs485Port {
    type Received = Rs485Received;
    type State = LineState;

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Rs485Received>, LinkError> {
        Rs485Port::receive(self, wait)
    }

    fn waker(&self) -> Waker {
        Rs485Port::waker(self)
    }

    fn resume(&mut self, state: &LineState) -> Result<(), LinkError> {
        state.rate.map_or(Ok(()), |rate| self.set_baud_rate(rate))
    }

    fn notice(notice: Notice) -> Rs485Received {
        Rs485Received::Notice(notice)
    }

    fn woken() -> Rs485Received {
        Rs485Received::Woken
    }

    fn is_woken(received: &Rs485Received) -> bool {
        *received == Rs485Received::Woken
    }

    /// A line does not say who is on it: masters and watchdogs find out.
    fn lost() -> Option<Rs485Received> {
        None
    }

    fn back() -> Option<Rs485Received> {
        None
    }
}

impl Rs485Port for Lasting<dyn Rs485Port> {
    fn send(&mut self, transmission: &Transmission) -> Result<(), LinkError> {
        // Without a line it is gone, as without a plug; a port that is gone says so in `receive`.
        if let Some(port) = self.port_mut() {
            let _ = port.send(transmission);
        }
        Ok(())
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Rs485Received>, LinkError> {
        self.wait_for(wait)
    }

    fn waker(&self) -> Waker {
        let wake = Arc::clone(&self.wake);
        Waker::new(move || wake.wake())
    }

    fn has_rate(&self) -> bool {
        self.port().map_or(self.state.has_rate, Rs485Port::has_rate)
    }

    fn set_baud_rate(&mut self, rate: BaudRate) -> Result<(), LinkError> {
        self.state = LineState { rate: Some(rate), has_rate: self.has_rate() };
        self.port_mut().map_or(Ok(()), |port| port.set_baud_rate(rate))
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        self.bus.clone()
    }
}
