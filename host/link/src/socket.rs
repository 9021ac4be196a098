//! What both ends of a connection need: addresses, time limits, and one place to wait.

use std::io;
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use mio::{Events, Poll, Registry, Token};

use crate::{Endpoint, LinkError, Waker};

/// The token of the waker; every socket has a greater one.
const WAKER: Token = Token(0);

/// The addresses of `endpoint`, at least one.
pub(crate) fn resolve(endpoint: &Endpoint) -> Result<Vec<SocketAddr>, LinkError> {
    let unknown = |reason| LinkError::Resolve { endpoint: endpoint.to_string(), reason };
    let found: Vec<_> =
        (endpoint.host(), endpoint.port()).to_socket_addrs().map_err(unknown)?.collect();
    if found.is_empty() {
        return Err(unknown(io::Error::new(io::ErrorKind::NotFound, "the name has no address")));
    }
    Ok(found)
}

/// How long a connection may take.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

/// From here on mio waits, and leaves the last millisecond to a finer clock.
#[cfg(unix)]
const COARSE: Duration = Duration::from_millis(2);

/// Connects to `endpoint`: tries one of its addresses after the other, together for 5 s.
pub(crate) fn connect_to(endpoint: &Endpoint) -> Result<TcpStream, LinkError> {
    let addresses = resolve(endpoint)?;
    let limit = Limit::after(Some(CONNECT_LIMIT));
    let mut reason = io::Error::from(io::ErrorKind::TimedOut);
    for address in addresses {
        let left = limit.remaining().unwrap_or(CONNECT_LIMIT);
        if left.is_zero() {
            break;
        }
        match TcpStream::connect_timeout(&address, left) {
            Ok(stream) => return Ok(stream),
            Err(error) => reason = error,
        }
    }
    Err(LinkError::Connect { endpoint: endpoint.to_string(), reason })
}

/// When a wait ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit(Option<Instant>);

impl Limit {
    /// `wait` from now; `None`, and a span beyond the clock's range, is never.
    pub(crate) fn after(wait: Option<Duration>) -> Self {
        Self(wait.and_then(|wait| Instant::now().checked_add(wait)))
    }

    /// What is left, rounded by nobody; `None` for a wait without limit.
    pub(crate) fn remaining(self) -> Option<Duration> {
        self.0.map(|end| end.saturating_duration_since(Instant::now()))
    }

    pub(crate) fn is_over(self) -> bool {
        self.remaining() == Some(Duration::ZERO)
    }
}

/// One place to wait for sockets and wake-ups.
#[derive(Debug)]
pub(crate) struct Watch {
    poll: Poll,
    events: Events,
    waker: Arc<mio::Waker>,
    woken: Arc<AtomicBool>,
}

/// What a socket has become since the last wait.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change {
    pub(crate) token: Token,
    pub(crate) readable: bool,
    pub(crate) writable: bool,
}

impl Watch {
    pub(crate) fn new() -> Result<Self, LinkError> {
        let poll = Poll::new().map_err(LinkError::System)?;
        let waker = mio::Waker::new(poll.registry(), WAKER).map_err(LinkError::System)?;
        Ok(Self {
            poll,
            events: Events::with_capacity(128),
            waker: Arc::new(waker),
            woken: Arc::default(),
        })
    }

    pub(crate) fn registry(&self) -> &Registry {
        self.poll.registry()
    }

    pub(crate) fn waker(&self) -> Waker {
        let (waker, woken) = (Arc::clone(&self.waker), Arc::clone(&self.woken));
        Waker::new(move || {
            woken.store(true, Ordering::Release);
            // The flag is up; where the system cannot end the wait, the next input will.
            let _ = waker.wake();
        })
    }

    /// Whether the waker was used since the last call.
    pub(crate) fn take_woken(&self) -> bool {
        self.woken.swap(false, Ordering::AcqRel)
    }

    /// Waits for a change or a wake-up, at most `wait`. It may end early, so look at the time; on
    /// Unix it ends some 0.1 ms late at most, elsewhere a tick of the system.
    pub(crate) fn wait(&mut self, wait: Option<Duration>) -> Result<(), LinkError> {
        let rest = self.wait_finely(wait)?;
        match self.poll.poll(&mut self.events, rest) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {
                self.events.clear();
                Ok(())
            }
            Err(error) => Err(LinkError::System(error)),
        }
    }

    /// Waits for less than [`COARSE`] as finely as the system can, and gives what is left to be
    /// waited with mio, which knows milliseconds only and rounds up.
    #[cfg(unix)]
    fn wait_finely(&self, wait: Option<Duration>) -> Result<Option<Duration>, LinkError> {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};
        let Some(wait) = wait.filter(|wait| !wait.is_zero()) else { return Ok(wait) };
        if wait >= COARSE {
            let whole = u64::try_from(wait.as_millis()).unwrap_or(u64::MAX);
            return Ok(Some(Duration::from_millis(whole - 1)));
        }
        let limit = Timespec { tv_sec: 0, tv_nsec: wait.subsec_nanos().into() };
        match poll(&mut [PollFd::new(self.registry(), PollFlags::IN)], Some(&limit)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => Ok(Some(Duration::ZERO)),
            Err(error) => Err(LinkError::System(error.into())),
        }
    }

    #[cfg(not(unix))]
    #[allow(clippy::unused_self, clippy::unnecessary_wraps, reason = "as on Unix")]
    fn wait_finely(&self, wait: Option<Duration>) -> Result<Option<Duration>, LinkError> {
        Ok(wait)
    }

    /// What changed in the last [`wait`](Self::wait).
    pub(crate) fn changes(&self) -> impl Iterator<Item = Change> {
        self.events.iter().filter(|event| event.token() != WAKER).map(|event| Change {
            token: event.token(),
            // A closed or broken connection is found by reading it.
            readable: event.is_readable() || event.is_read_closed() || event.is_error(),
            writable: event.is_writable(),
        })
    }
}
