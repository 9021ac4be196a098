//! A CAN segment made of software: what one of its guests says, the station and all other guests
//! hear. What the guests speak is the affair of their language.

use std::collections::VecDeque;
use std::fmt;
use std::net::SocketAddr;
use std::time::{Duration, Instant, SystemTime};

use codewheel_station::can::{BitRate, Frame};

use crate::clients::{Clients, OCTETS_PER_TURN};
use crate::output::Portion;
use crate::socket::Limit;
use crate::{CanPort, Endpoint, LinkError, Notice, Received, Waker};

/// Openings of one client that people hear of: one that opens and closes for ever is no news.
const OPENINGS_TOLD: u8 = 4;

/// Reports kept for a station that only sends and never receives.
const REPORTS: usize = 4096;

/// What a guest's words lead to, in the order in which it must be done. `W` is what is said to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect<W> {
    /// Write this to the client.
    Answer(W),
    /// Put this on the bus.
    Transmit(Frame),
    /// The client takes part from now on.
    Opened {
        /// Whether it can only listen.
        listen_only: bool,
        /// The bit rate it chose, in bits per second; `None` when it joins at the segment's.
        bit_rate: Option<u32>,
    },
    /// The client no longer takes part.
    Closed,
}

/// When a frame was on the segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Milliseconds since the segment is there.
    pub(crate) milliseconds: u64,
    /// Since the beginning of 1970, UTC.
    pub(crate) since_1970: Duration,
}

/// One guest of the segment: what it speaks, and how far it has come. Does no I/O.
pub(crate) trait Guest: Default + Send + fmt::Debug {
    /// What is said to it, a whole line or word at a time.
    type Word: Portion + Send + fmt::Debug;
    /// How its segment is called in a bus URI, as `slcan-listen`.
    const KIND: &'static str;

    /// What it is greeted with.
    fn greeting() -> Option<Self::Word> {
        None
    }

    /// Takes octets of the guest, in pieces of any size, and tells `effect` what to do.
    fn hear(&mut self, octets: &[u8], effect: impl FnMut(Effect<Self::Word>));

    /// What brings a frame of the bus to the guest, or `None` while it takes no part.
    fn tell(&mut self, frame: &Frame, at: Moment) -> Option<Self::Word>;
}

/// Binds `endpoint` and serves a segment at `rate`.
pub(crate) fn listen<G: Guest>(
    endpoint: &Endpoint,
    rate: BitRate,
) -> Result<ListenPort<G>, LinkError> {
    Ok(ListenPort {
        rate,
        started: Instant::now(),
        clients: Clients::listen(endpoint, G::greeting)?,
        inbox: VecDeque::new(),
    })
}

/// A bus whose wire is this object: what one takes part with, all others hear, in one order.
#[derive(Debug)]
pub(crate) struct ListenPort<G: Guest> {
    rate: BitRate,
    started: Instant,
    clients: Clients<Membership<G>, G::Word>,
    inbox: VecDeque<Received>,
}

/// What a client is to the bus.
#[derive(Debug, Default)]
struct Membership<G> {
    guest: G,
    openings_told: u8,
}

/// The time now, for a segment that is there since `started`.
pub(crate) fn moment(started: Instant) -> Moment {
    Moment {
        milliseconds: started.elapsed().as_millis() as u64,
        // A clock that was never set is no reason to say nothing.
        since_1970: SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default(),
    }
}

impl<G: Guest> ListenPort<G> {
    /// Reads a piece from every client that has something, once around.
    fn serve(&mut self) {
        for _ in 0..self.clients.unread() {
            let mut buffer = [0; OCTETS_PER_TURN];
            if let Some((token, count)) = self.clients.read(&mut buffer) {
                self.hear(token, buffer.get(..count).unwrap_or_default());
            }
        }
    }

    /// Does what the octets of a client lead to.
    fn hear(&mut self, token: usize, octets: &[u8]) {
        let Some(client) = self.clients.get_mut(token) else { return };
        let mut effects = Vec::new();
        client.state.guest.hear(octets, |effect| effects.push(effect));
        for effect in effects {
            match effect {
                Effect::Answer(word) => {
                    if let Some(client) = self.clients.get_mut(token) {
                        client.output.push(word);
                    }
                }
                Effect::Transmit(frame) => {
                    self.broadcast(&frame, Some(token));
                    self.inbox.push_back(Received::Frame(frame));
                }
                Effect::Opened { listen_only, bit_rate } => {
                    self.tell_opening(token, listen_only, bit_rate);
                }
                Effect::Closed => {}
            }
        }
    }

    fn tell_opening(&mut self, token: usize, listen_only: bool, bit_rate: Option<u32>) {
        let Some(client) = self.clients.get_mut(token) else { return };
        if client.state.openings_told >= OPENINGS_TOLD {
            return;
        }
        client.state.openings_told += 1;
        let (client, segment) = (client.address, self.rate);
        self.tell(Notice::ClientOpened { client, listen_only });
        if let Some(chosen) = bit_rate.filter(|chosen| *chosen != segment.bits_per_second()) {
            self.tell(Notice::OtherBitRate { client: client.to_string(), chosen, segment });
        }
    }

    /// Brings a frame to all open clients but the one it comes from.
    fn broadcast(&mut self, frame: &Frame, from: Option<usize>) {
        let moment = moment(self.started);
        for client in self.clients.others(from) {
            let Some(word) = client.state.guest.tell(frame, moment) else { continue };
            if client.output.push(word) {
                let notice = Notice::ClientTooSlow { client: client.address };
                self.inbox.push_back(Received::Notice(notice));
            }
        }
    }

    fn flush(&mut self) {
        self.clients.flush(
            &mut |notice| self.inbox.push_back(Received::Notice(notice)),
            |client, frames_lost| Notice::ClientLeft { client, frames_lost },
        );
    }

    fn tell(&mut self, notice: Notice) {
        self.inbox.push_back(Received::Notice(notice));
    }
}

impl<G: Guest> CanPort for ListenPort<G> {
    fn is_ready(&self) -> bool {
        self.inbox.len() < REPORTS
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        if !self.is_ready() {
            return Ok(false);
        }
        self.broadcast(frame, None);
        self.inbox.push_back(Received::Sent(*frame));
        self.flush();
        Ok(true)
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        let limit = Limit::after(wait);
        loop {
            // First, so that a flood does not drown it.
            if self.clients.take_woken() {
                return Ok(Some(Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            let tell = &mut |notice| self.inbox.push_back(Received::Notice(notice));
            self.clients.wait(limit.remaining(), tell)?;
            self.serve();
            self.flush();
            // A client that sends nothing but garbage must not hold up the station's time.
            if self.inbox.is_empty() && limit.is_over() {
                return Ok(None);
            }
        }
    }

    fn waker(&self) -> Waker {
        self.clients.waker()
    }

    /// The segment acknowledges each frame itself, clients or none.
    fn confirms(&self) -> bool {
        true
    }

    fn local_address(&self) -> Option<SocketAddr> {
        Some(self.clients.address())
    }

    fn describe(&self) -> String {
        format!("{}:{}", G::KIND, self.clients.address())
    }
}
