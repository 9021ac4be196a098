//! `slcan-listen:HOST:PORT`: we play the adapter, for any number of clients.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Read};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use codewheel_station::can::{BitRate, Frame};
use mio::net::{TcpListener, TcpStream};
use mio::{Interest, Token};

use super::channel::{Channel, Effect};
use super::output::Output;
use super::socket::{Limit, Watch, resolve};
use crate::{CanPort, Endpoint, LinkError, Notice, Received, Waker};

const LISTENER: Token = Token(1);
const FIRST_CLIENT: usize = 2;

/// Clients served at once; each may cost some 130 KiB.
const CLIENTS: usize = 64;

/// Openings of one client that people hear of: one that opens and closes for ever is no news.
const OPENINGS_TOLD: u8 = 4;

/// Octets read from one client before the next has its turn: some 30 polls, so that a client that
/// floods delays the others by microseconds.
const OCTETS_PER_TURN: usize = 512;

/// Reports kept for a station that only sends and never receives.
const REPORTS: usize = 4096;

/// Binds `endpoint` and serves a segment at `rate`.
pub(crate) fn listen(endpoint: &Endpoint, rate: BitRate) -> Result<ListenPort, LinkError> {
    let failed = |reason| LinkError::Listen { endpoint: endpoint.to_string(), reason };
    // The standard library's listener tries all addresses of a name, mio's takes one.
    let listener = std::net::TcpListener::bind(resolve(endpoint)?.as_slice()).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    let address = listener.local_addr().map_err(failed)?;
    let mut listener = TcpListener::from_std(listener);
    let watch = Watch::new()?;
    watch
        .registry()
        .register(&mut listener, LISTENER, Interest::READABLE)
        .map_err(LinkError::System)?;
    Ok(ListenPort {
        address,
        rate,
        started: Instant::now(),
        listener,
        watch,
        clients: BTreeMap::new(),
        next_token: FIRST_CLIENT,
        unread: VecDeque::new(),
        inbox: VecDeque::new(),
    })
}

/// A bus whose wire is this object: what one takes part with, all others hear, in one order.
#[derive(Debug)]
pub(crate) struct ListenPort {
    address: SocketAddr,
    rate: BitRate,
    started: Instant,
    listener: TcpListener,
    watch: Watch,
    clients: BTreeMap<usize, Client>,
    next_token: usize,
    /// Clients that may have more to read: a socket tells once, and not again before it was read
    /// to its end.
    unread: VecDeque<usize>,
    inbox: VecDeque<Received>,
}

#[derive(Debug)]
struct Client {
    stream: TcpStream,
    address: SocketAddr,
    channel: Channel,
    output: Output,
    openings_told: u8,
    /// Whether it stands in `unread`.
    is_unread: bool,
    is_gone: bool,
}

impl ListenPort {
    /// Takes in what the sockets report.
    fn take_changes(&mut self) {
        let mut connecting = false;
        for change in self.watch.changes() {
            if change.token == LISTENER {
                connecting = true;
                continue;
            }
            let Some(client) = self.clients.get_mut(&change.token.0) else { continue };
            if change.writable {
                client.output.unblock();
            }
            if change.readable && !client.is_unread {
                client.is_unread = true;
                self.unread.push_back(change.token.0);
            }
        }
        if connecting {
            self.accept();
        }
    }

    fn accept(&mut self) {
        loop {
            match self.listener.accept() {
                Ok((_, client)) if self.clients.len() >= CLIENTS => {
                    self.tell(Notice::ClientTurnedAway { client, limit: CLIENTS });
                }
                Ok((stream, address)) => match self.admit(stream, address) {
                    Ok(()) => self.tell(Notice::ClientConnected { client: address }),
                    Err(error) => {
                        self.tell(Notice::ClientNotAccepted { reason: error.to_string() });
                    }
                },
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock => return,
                    // The client gave up before its turn came.
                    io::ErrorKind::Interrupted
                    | io::ErrorKind::ConnectionAborted
                    | io::ErrorKind::ConnectionReset => {}
                    _ => {
                        self.tell(Notice::ClientNotAccepted { reason: error.to_string() });
                        return;
                    }
                },
            }
        }
    }

    fn admit(&mut self, mut stream: TcpStream, address: SocketAddr) -> io::Result<()> {
        // Frames are small and urgent; waiting to fill a packet would add tens of milliseconds.
        stream.set_nodelay(true)?;
        let token = self.next_token;
        let interest = Interest::READABLE | Interest::WRITABLE;
        self.watch.registry().register(&mut stream, Token(token), interest)?;
        self.next_token += 1;
        self.clients.insert(
            token,
            Client {
                stream,
                address,
                channel: Channel::default(),
                output: Output::default(),
                openings_told: 0,
                is_unread: false,
                is_gone: false,
            },
        );
        Ok(())
    }

    /// Reads a piece from every client that has something, once around.
    fn serve(&mut self) {
        for _ in 0..self.unread.len() {
            let Some(token) = self.unread.pop_front() else { break };
            let Some(client) = self.clients.get_mut(&token) else { continue };
            let mut buffer = [0; OCTETS_PER_TURN];
            let more = match client.stream.read(&mut buffer) {
                Ok(0) => {
                    client.is_gone = true;
                    false
                }
                Ok(count) => {
                    self.hear(token, buffer.get(..count).unwrap_or_default());
                    true
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => true,
                Err(error) => {
                    client.is_gone = error.kind() != io::ErrorKind::WouldBlock;
                    false
                }
            };
            if more {
                self.unread.push_back(token);
            } else if let Some(client) = self.clients.get_mut(&token) {
                client.is_unread = false;
            }
        }
    }

    /// Does what the octets of a client lead to.
    fn hear(&mut self, token: usize, octets: &[u8]) {
        let Some(client) = self.clients.get_mut(&token) else { return };
        let mut effects = Vec::new();
        client.channel.receive(octets, |effect| effects.push(effect));
        for effect in effects {
            match effect {
                Effect::Answer(line) => {
                    if let Some(client) = self.clients.get_mut(&token) {
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
        let Some(client) = self.clients.get_mut(&token) else { return };
        if client.openings_told >= OPENINGS_TOLD {
            return;
        }
        client.openings_told += 1;
        let (client, segment) = (client.address, self.rate);
        self.tell(Notice::ClientOpened { client, listen_only });
        if let Some(chosen) = bit_rate.filter(|chosen| *chosen != segment.bits_per_second()) {
            self.tell(Notice::OtherBitRate { client, chosen, segment });
        }
    }

    /// Brings a frame to all open clients but the one it comes from.
    fn broadcast(&mut self, frame: &Frame, from: Option<usize>) {
        let milliseconds = self.started.elapsed().as_millis() as u64;
        for (token, client) in &mut self.clients {
            if Some(*token) == from {
                continue;
            }
            let Some(line) = client.channel.deliver(frame, milliseconds) else { continue };
            let lost = client.output.frames_lost();
            client.output.push(line);
            if lost == 0 && client.output.frames_lost() > 0 {
                let notice = Notice::ClientTooSlow { client: client.address };
                self.inbox.push_back(Received::Notice(notice));
            }
        }
    }

    /// Writes what the clients take, and lets those go that are gone: one that only closed its
    /// sending side still gets the answers to what it sent.
    fn flush(&mut self) {
        let mut gone = Vec::new();
        for (token, client) in &mut self.clients {
            if client.output.flush(&mut client.stream).is_err() || client.is_gone {
                gone.push(*token);
            }
        }
        for token in &gone {
            let Some(mut client) = self.clients.remove(token) else { continue };
            // Closing the socket ends the registration in any case.
            let _ = self.watch.registry().deregister(&mut client.stream);
            let frames_lost = client.output.frames_lost();
            self.tell(Notice::ClientLeft { client: client.address, frames_lost });
        }
        if !gone.is_empty() {
            // One that could not be let in for want of sockets is not announced again.
            self.accept();
        }
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
            if self.watch.take_woken() {
                return Ok(Some(Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            let pause =
                if self.unread.is_empty() { limit.remaining() } else { Some(Duration::ZERO) };
            self.watch.wait(pause)?;
            self.take_changes();
            self.serve();
            self.flush();
            // A client that sends nothing but garbage must not hold up the station's time.
            if self.inbox.is_empty() && limit.is_over() {
                return Ok(None);
            }
        }
    }

    fn waker(&self) -> Waker {
        self.watch.waker()
    }

    /// The adapter acknowledges each frame itself, clients or none.
    fn confirms(&self) -> bool {
        true
    }

    fn local_address(&self) -> Option<SocketAddr> {
        Some(self.address)
    }

    fn describe(&self) -> String {
        format!("slcan-listen:{}", self.address)
    }
}
