//! What both ends of a TCP connection need: addresses, time limits, and one place to wait.

use std::io;
use std::net::{SocketAddr, ToSocketAddrs};
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

    /// Waits for a change or a wake-up, at most `wait`. The system may round the wait up to its
    /// clock (Linux: 1 ms), and a signal may end it early.
    pub(crate) fn wait(&mut self, wait: Option<Duration>) -> Result<(), LinkError> {
        match self.poll.poll(&mut self.events, wait) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {
                self.events.clear();
                Ok(())
            }
            Err(error) => Err(LinkError::System(error)),
        }
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
