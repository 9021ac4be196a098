//! The listening side of TCP: any number of clients that share one bus.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Read};
use std::net::SocketAddr;
use std::time::Duration;

use mio::net::{TcpListener, TcpStream};
use mio::{Interest, Token};

use crate::output::{Output, Portion};
use crate::socket::{Watch, resolve};
use crate::{Endpoint, LinkError, Notice, Waker};

const LISTENER: Token = Token(1);
const FIRST_CLIENT: usize = 2;

/// Clients served at once; each may cost some 200 KiB.
const CLIENTS: usize = 64;

/// Octets read from one client before the next has its turn: some 30 polls, so that a client that
/// floods delays the others by microseconds.
pub(crate) const OCTETS_PER_TURN: usize = 512;

/// The sockets of one bus: the listener, its clients, and the place to wait for all of them.
///
/// `S` is what the bus keeps for each client, `P` what it sends them.
#[derive(Debug)]
pub(crate) struct Clients<S, P> {
    address: SocketAddr,
    listener: TcpListener,
    watch: Watch,
    clients: BTreeMap<usize, Client<S, P>>,
    next_token: usize,
    /// What a client is told first.
    greeting: fn() -> Option<P>,
    /// Clients that may have more to read: a socket tells once, and not again before it was read
    /// to its end.
    unread: VecDeque<usize>,
}

#[derive(Debug)]
pub(crate) struct Client<S, P> {
    stream: TcpStream,
    pub(crate) address: SocketAddr,
    pub(crate) output: Output<P>,
    pub(crate) state: S,
    /// Whether it stands in `unread`.
    is_unread: bool,
    is_gone: bool,
}

impl<S: Default, P: Portion> Clients<S, P> {
    /// Binds `endpoint`; who comes is told the `greeting` first.
    pub(crate) fn listen(
        endpoint: &Endpoint,
        greeting: fn() -> Option<P>,
    ) -> Result<Self, LinkError> {
        let failed = |reason| LinkError::Listen { endpoint: endpoint.to_string(), reason };
        // The standard library's listener tries all addresses of a name, mio's takes one.
        let listener = std::net::TcpListener::bind(resolve(endpoint)?.as_slice());
        let listener = listener.map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let mut listener = TcpListener::from_std(listener);
        let watch = Watch::new()?;
        watch
            .registry()
            .register(&mut listener, LISTENER, Interest::READABLE)
            .map_err(LinkError::System)?;
        let clients = BTreeMap::new();
        let unread = VecDeque::new();
        let next_token = FIRST_CLIENT;
        Ok(Self { address, listener, watch, clients, next_token, greeting, unread })
    }

    /// Where clients connect to, with the port the system chose where 0 was asked.
    pub(crate) const fn address(&self) -> SocketAddr {
        self.address
    }

    pub(crate) fn waker(&self) -> Waker {
        self.watch.waker()
    }

    /// Whether the waker was used since the last call.
    pub(crate) fn take_woken(&self) -> bool {
        self.watch.take_woken()
    }

    /// How many clients may have more to read.
    pub(crate) fn unread(&self) -> usize {
        self.unread.len()
    }

    pub(crate) fn get_mut(&mut self, token: usize) -> Option<&mut Client<S, P>> {
        self.clients.get_mut(&token)
    }

    /// All clients but the one that `except` names.
    pub(crate) fn others(
        &mut self,
        except: Option<usize>,
    ) -> impl Iterator<Item = &mut Client<S, P>> {
        let others = self.clients.iter_mut().filter(move |(token, _)| Some(**token) != except);
        others.map(|(_, client)| client)
    }

    /// Waits for input, a wake-up or room to write, at most `wait` and not at all while there is
    /// something to read, and lets in who knocks.
    pub(crate) fn wait(
        &mut self,
        wait: Option<Duration>,
        tell: &mut impl FnMut(Notice),
    ) -> Result<(), LinkError> {
        let wait = if self.unread.is_empty() { wait } else { Some(Duration::ZERO) };
        self.watch.wait(wait)?;
        let mut is_knocking = false;
        for change in self.watch.changes() {
            if change.token == LISTENER {
                is_knocking = true;
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
        if is_knocking {
            self.accept(tell);
        }
        Ok(())
    }

    fn accept(&mut self, tell: &mut impl FnMut(Notice)) {
        loop {
            match self.listener.accept() {
                Ok((_, client)) if self.clients.len() >= CLIENTS => {
                    tell(Notice::ClientTurnedAway { client, limit: CLIENTS });
                }
                Ok((stream, address)) => match self.admit(stream, address) {
                    Ok(()) => tell(Notice::ClientConnected { client: address }),
                    Err(error) => tell(Notice::ClientNotAccepted { reason: error.to_string() }),
                },
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock => return,
                    // The client gave up before its turn came.
                    io::ErrorKind::Interrupted
                    | io::ErrorKind::ConnectionAborted
                    | io::ErrorKind::ConnectionReset => {}
                    _ => {
                        tell(Notice::ClientNotAccepted { reason: error.to_string() });
                        return;
                    }
                },
            }
        }
    }

    fn admit(&mut self, mut stream: TcpStream, address: SocketAddr) -> io::Result<()> {
        // What goes over a bus is small and urgent; waiting to fill a packet would add tens of
        // milliseconds.
        stream.set_nodelay(true)?;
        let token = self.next_token;
        let interest = Interest::READABLE | Interest::WRITABLE;
        self.watch.registry().register(&mut stream, Token(token), interest)?;
        self.next_token += 1;
        let (mut output, state) = (Output::default(), S::default());
        if let Some(greeting) = (self.greeting)() {
            output.push(greeting);
        }
        self.clients.insert(
            token,
            Client { stream, address, output, state, is_unread: false, is_gone: false },
        );
        Ok(())
    }

    /// Reads a piece from the client whose turn it is into `buffer`: who it is and how many octets
    /// came. Ask [`unread`](Self::unread) times for once around.
    pub(crate) fn read(&mut self, buffer: &mut [u8]) -> Option<(usize, usize)> {
        let token = self.unread.pop_front()?;
        let client = self.clients.get_mut(&token)?;
        let (count, has_more) = match client.stream.read(buffer) {
            Ok(0) => {
                client.is_gone = true;
                (0, false)
            }
            Ok(count) => (count, true),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => (0, true),
            Err(error) => {
                client.is_gone = error.kind() != io::ErrorKind::WouldBlock;
                (0, false)
            }
        };
        client.is_unread = has_more;
        if has_more {
            self.unread.push_back(token);
        }
        (count > 0).then_some((token, count))
    }

    /// Writes what the clients take, and lets those go that are gone: one that only closed its
    /// sending side still gets what it is owed. `left` says what people hear of one that is gone,
    /// from its address and what it lost.
    pub(crate) fn flush(
        &mut self,
        tell: &mut impl FnMut(Notice),
        left: impl Fn(SocketAddr, u64) -> Notice,
    ) {
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
            tell(left(client.address, client.output.lost()));
        }
        if !gone.is_empty() {
            // One that could not be let in for want of sockets is not announced again.
            self.accept(tell);
        }
    }
}
