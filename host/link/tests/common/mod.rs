//! A toy encoder, a thread that drives it, and a client that speaks SLCAN by hand.
#![allow(dead_code, reason = "every test file takes what it needs")]
#![allow(clippy::unwrap_used)]

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use codewheel_link::{CanPort, Clock, Loop, Notice, Received, Waker, open};
use codewheel_station::can::{self, BitRate, Frame};
use codewheel_station::{Instant as Time, Station};

/// Longer than anything here takes, short enough that a hang is a failed test.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);

/// Answers each poll `42D#` (MAC ID 5) with `3C5#` and the number of polls so far.
#[derive(Debug, Default)]
pub(crate) struct Echo {
    pub(crate) polls: u16,
    pub(crate) owed: bool,
    pub(crate) heard: Vec<Frame>,
    pub(crate) sent: Vec<Frame>,
}

impl Station for Echo {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, _: Time, input: can::Input<'_>) {
        match input {
            can::Input::Frame(frame) => {
                self.heard.push(*frame);
                if frame.identifier() == can::Identifier::Standard(0x42D) {
                    self.polls = self.polls.wrapping_add(1);
                    self.owed = true;
                }
            }
            can::Input::Sent(frame) => self.sent.push(*frame),
            _ => {}
        }
    }

    fn advance(&mut self, _: Time) {}

    fn transmit(&mut self, _: Time) -> Option<Frame> {
        std::mem::take(&mut self.owed).then(|| Frame::standard(0x3C5, &self.polls.to_be_bytes()))
    }

    fn deadline(&self) -> Option<Time> {
        None
    }
}

/// An [`Echo`] on its own thread, until it is stopped.
pub(crate) struct Running {
    pub(crate) address: Option<SocketAddr>,
    waker: Waker,
    thread: JoinHandle<(Echo, Vec<Notice>, usize)>,
}

impl Running {
    pub(crate) fn on(uri: &str) -> Self {
        let mut port = open(&uri.parse().unwrap(), BitRate::Kbit125).unwrap();
        let (address, waker) = (port.local_address(), port.waker());
        let thread = std::thread::spawn(move || {
            let (mut echo, mut notices, mut turns) = (Echo::default(), Vec::new(), 0);
            let mut drive = Loop::new(Clock::new());
            loop {
                let outcome = drive.turn(&mut echo, port.as_mut(), None).unwrap();
                turns += 1;
                notices.extend(outcome.notices);
                if outcome.woken {
                    return (echo, notices, turns);
                }
            }
        });
        Self { address, waker, thread }
    }

    pub(crate) fn listening() -> Self {
        Self::on("slcan-listen:127.0.0.1:0")
    }

    pub(crate) fn client(&self) -> Client {
        Client::new(TcpStream::connect(self.address.unwrap()).unwrap())
    }

    /// The station, what was told to people, and how many turns it took.
    pub(crate) fn stop(self) -> (Echo, Vec<Notice>, usize) {
        self.waker.wake();
        self.thread.join().unwrap()
    }
}

/// A TCP stream that says and expects octet strings.
pub(crate) struct Client {
    pub(crate) stream: TcpStream,
}

impl Client {
    pub(crate) fn new(stream: TcpStream) -> Self {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.set_nodelay(true).unwrap();
        Self { stream }
    }

    pub(crate) fn say(&mut self, octets: &str) {
        self.stream.write_all(octets.as_bytes()).unwrap();
    }

    pub(crate) fn expect(&mut self, octets: &str) {
        let mut buffer = vec![0; octets.len()];
        let mut length = 0;
        while length < buffer.len() {
            match self.stream.read(&mut buffer[length..]) {
                Ok(0) => panic!("closed after {}", buffer[..length].escape_ascii()),
                Ok(count) => length += count,
                Err(error) => panic!("{error} after {}", buffer[..length].escape_ascii()),
            }
        }
        assert_eq!(buffer.escape_ascii().to_string(), octets.as_bytes().escape_ascii().to_string());
    }

    /// Reads to `end`, and that too.
    pub(crate) fn skip_to(&mut self, end: u8) {
        let mut octet = [0];
        while octet != [end] {
            self.stream.read_exact(&mut octet).unwrap();
        }
    }

    pub(crate) fn expect_nothing(&mut self) {
        self.stream.set_read_timeout(Some(Duration::from_millis(30))).unwrap();
        let mut buffer = [0; 64];
        match self.stream.read(&mut buffer) {
            Ok(count) => panic!("unexpected {}", buffer[..count].escape_ascii()),
            Err(error) => {
                assert!(matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut));
            }
        }
        self.stream.set_read_timeout(Some(PATIENCE)).unwrap();
    }

    /// Opens the channel at the segment's rate.
    pub(crate) fn join(&mut self) {
        self.say("S4\rO\r");
        self.expect("\r\r");
    }
}

/// A listening socket that a test plays the adapter on.
pub(crate) fn adapter() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let uri = format!("slcan:{}", listener.local_addr().unwrap());
    (listener, uri)
}

/// The next report that is no notice; panics when there is none in time.
pub(crate) fn next(port: &mut dyn CanPort) -> Received {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        match port.receive(Some(PATIENCE)).unwrap() {
            Some(Received::Notice(_)) | None => {}
            Some(received) => return received,
        }
    }
    panic!("nothing arrived");
}
