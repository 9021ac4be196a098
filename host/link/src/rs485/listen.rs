//! `rs485-listen:HOST:PORT`: we are the line, for any number of clients.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use codewheel_station::rs485::{BaudRate, Transmission};

use super::port::{Rs485Port, Rs485Received};
use crate::clients::{Clients, OCTETS_PER_TURN};
use crate::output::Portion;
use crate::socket::Limit;
use crate::{Endpoint, LinkError, Notice, Waker};

/// Binds `endpoint` and is a line.
pub(super) fn listen(endpoint: &Endpoint) -> Result<ListenPort, LinkError> {
    Ok(ListenPort { clients: Clients::listen(endpoint, || None)?, inbox: VecDeque::new() })
}

/// A line whose wire is this object: what one says, all others hear, in one order. Two who speak at
/// once are heard piece by piece, as on copper nobody would hear either.
#[derive(Debug)]
pub(super) struct ListenPort {
    clients: Clients<(), Piece>,
    inbox: VecDeque<Rs485Received>,
}

/// Octets that one said, on their way to all others.
type Piece = Arc<[u8]>;

impl Portion for Piece {
    fn as_octets(&self) -> &[u8] {
        self
    }

    fn loss(&self) -> u64 {
        self.len() as u64
    }
}

impl ListenPort {
    /// Reads a piece from every client that has something, once around.
    fn serve(&mut self) {
        for _ in 0..self.clients.unread() {
            let mut buffer = [0; OCTETS_PER_TURN];
            if let Some((token, count)) = self.clients.read(&mut buffer) {
                let octets = buffer.get(..count).unwrap_or_default();
                self.broadcast(octets, Some(token));
                self.inbox.push_back(Rs485Received::Octets(octets.to_vec()));
            }
        }
    }

    /// Brings octets to all clients but the one they come from.
    fn broadcast(&mut self, octets: &[u8], from: Option<usize>) {
        let mut shared = None;
        for client in self.clients.others(from) {
            let piece = shared.get_or_insert_with(|| Piece::from(octets));
            if client.output.push(Arc::clone(piece)) {
                let notice = Notice::ClientTooSlow { client: client.address };
                self.inbox.push_back(Rs485Received::Notice(notice));
            }
        }
    }

    fn flush(&mut self) {
        self.clients.flush(
            &mut |notice| self.inbox.push_back(Rs485Received::Notice(notice)),
            |client, octets_lost| match octets_lost {
                0 => Notice::ClientLeft { client, frames_lost: 0 },
                _ => Notice::ClientLeftShort { client, octets_lost },
            },
        );
    }
}

impl Rs485Port for ListenPort {
    fn send(&mut self, transmission: &Transmission) -> Result<(), LinkError> {
        self.broadcast(transmission.octets(), None);
        self.flush();
        Ok(())
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Rs485Received>, LinkError> {
        let limit = Limit::after(wait);
        loop {
            // First, so that a flood does not drown it.
            if self.clients.take_woken() {
                return Ok(Some(Rs485Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            let tell = &mut |notice| self.inbox.push_back(Rs485Received::Notice(notice));
            self.clients.wait(limit.remaining(), tell)?;
            self.serve();
            self.flush();
            if self.inbox.is_empty() && limit.is_over() {
                return Ok(None);
            }
        }
    }

    fn waker(&self) -> Waker {
        self.clients.waker()
    }

    fn has_rate(&self) -> bool {
        false
    }

    fn set_baud_rate(&mut self, _: BaudRate) -> Result<(), LinkError> {
        Ok(())
    }

    fn local_address(&self) -> Option<SocketAddr> {
        Some(self.clients.address())
    }

    fn describe(&self) -> String {
        format!("rs485-listen:{}", self.clients.address())
    }
}
