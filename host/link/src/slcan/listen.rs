//! `slcan-listen:HOST:PORT`: we play the adapter, for any number of clients.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use codewheel_station::can::{BitRate, Frame};

use super::channel::{Channel, Effect};
use super::line::Line;
use crate::clients::{Clients, OCTETS_PER_TURN};
use crate::socket::Limit;
use crate::{CanPort, Endpoint, LinkError, Notice, Received, Waker};

/// Openings of one client that people hear of: one that opens and closes for ever is no news.
const OPENINGS_TOLD: u8 = 4;

/// Reports kept for a station that only sends and never receives.
const REPORTS: usize = 4096;

/// Binds `endpoint` and serves a segment at `rate`.
pub(crate) fn listen(endpoint: &Endpoint, rate: BitRate) -> Result<ListenPort, LinkError> {
    Ok(ListenPort {
        rate,
        started: Instant::now(),
        clients: Clients::listen(endpoint)?,
        inbox: VecDeque::new(),
    })
}

/// A bus whose wire is this object: what one takes part with, all others hear, in one order.
#[derive(Debug)]
pub(crate) struct ListenPort {
    rate: BitRate,
    started: Instant,
    clients: Clients<Membership, Line>,
    inbox: VecDeque<Received>,
}

/// What a client is to the bus.
#[derive(Debug, Default)]
struct Membership {
    channel: Channel,
    openings_told: u8,
}

impl ListenPort {
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
        client.state.channel.receive(octets, |effect| effects.push(effect));
        for effect in effects {
            match effect {
                Effect::Answer(line) => {
                    if let Some(client) = self.clients.get_mut(token) {
                        client.output.push(line);
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
            self.tell(Notice::OtherBitRate { client, chosen, segment });
        }
    }

    /// Brings a frame to all open clients but the one it comes from.
    fn broadcast(&mut self, frame: &Frame, from: Option<usize>) {
        let milliseconds = self.started.elapsed().as_millis() as u64;
        for client in self.clients.others(from) {
            let Some(line) = client.state.channel.deliver(frame, milliseconds) else { continue };
            if client.output.push(line) {
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

impl CanPort for ListenPort {
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

    /// The adapter acknowledges each frame itself, clients or none.
    fn confirms(&self) -> bool {
        true
    }

    fn local_address(&self) -> Option<SocketAddr> {
        Some(self.clients.address())
    }

    fn describe(&self) -> String {
        format!("slcan-listen:{}", self.clients.address())
    }
}
