//! A toy slave, a thread that drives it, and a master that speaks by hand.

use std::fmt::Write;
use std::net::SocketAddr;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use codewheel_link::{
    Clock, LinkError, Notice, Rs485Loop, Rs485Port, Rs485Received, Waker, open_rs485,
};
use codewheel_station::rs485::{BaudRate, Input, Node, Transmission};
use codewheel_station::{Instant as Time, Station};

/// Longer than anything here takes, short enough that a hang is a failed test.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);

/// A request to the slave: station 7 is to say that it is there.
pub(crate) const REQUEST: [u8; 6] = [0x10, 0x07, 0x02, 0x49, 0x52, 0x16];

/// What it says: station 2 hears that 7 is there.
pub(crate) const ANSWER: [u8; 6] = [0x10, 0x02, 0x07, 0x00, 0x09, 0x16];

/// Answers each [`REQUEST`] with [`ANSWER`] after T_SDR, unless another octet comes first.
#[derive(Debug)]
pub(crate) struct Slave {
    pub(crate) rate: BaudRate,
    /// In bits.
    pub(crate) t_sdr: u32,
    pub(crate) heard: Vec<u8>,
    pub(crate) broken: usize,
    pub(crate) due: Option<Time>,
    /// Answers that another octet took the word from.
    pub(crate) dropped: usize,
    /// When it was asked to speak and did: the time, and when the answer was due.
    pub(crate) spoke: Vec<(Time, Time)>,
}

impl Slave {
    pub(crate) fn at(rate: BaudRate, t_sdr: u32) -> Self {
        let (heard, spoke) = (Vec::new(), Vec::new());
        Self { rate, t_sdr, heard, broken: 0, due: None, dropped: 0, spoke }
    }
}

impl Station for Slave {
    type Input<'a> = Input<'a>;
    type Output = Transmission;

    fn handle(&mut self, now: Time, input: Input<'_>) {
        self.dropped += usize::from(self.due.take().is_some());
        match input {
            Input::BrokenCharacter => self.broken += 1,
            Input::Octets(octets) => {
                self.heard.extend_from_slice(octets);
                if self.heard.ends_with(&REQUEST) {
                    self.due = Some(now + self.rate.bits(self.t_sdr));
                }
            }
        }
    }

    fn advance(&mut self, _: Time) {}

    fn transmit(&mut self, now: Time) -> Option<Transmission> {
        let due = self.due.take_if(|due| *due <= now)?;
        self.spoke.push((now, due));
        Transmission::new(&ANSWER)
    }

    fn deadline(&self) -> Option<Time> {
        self.due
    }
}

impl Node for Slave {
    fn baud_rate(&self) -> BaudRate {
        self.rate
    }
}

/// A [`Slave`] on its own thread, until it is stopped.
pub(crate) struct Running {
    pub(crate) address: Option<SocketAddr>,
    waker: Waker,
    thread: JoinHandle<(Slave, Vec<Notice>, usize)>,
}

impl Running {
    pub(crate) fn on(uri: &str, mut slave: Slave) -> Self {
        let mut port = open_rs485(&uri.parse().unwrap(), slave.rate).unwrap();
        let (address, waker) = (port.local_address(), port.waker());
        let thread = std::thread::spawn(move || {
            let (mut drive, mut notices, mut turns) = (Rs485Loop::new(Clock::new()), Vec::new(), 0);
            loop {
                let outcome = drive.turn(&mut slave, port.as_mut(), None).unwrap();
                turns += 1;
                notices.extend(outcome.notices);
                if outcome.woken {
                    return (slave, notices, turns);
                }
            }
        });
        Self { address, waker, thread }
    }

    pub(crate) fn listening() -> Self {
        Self::on("rs485-listen:127.0.0.1:0", Slave::at(BaudRate::Mbit12, 11))
    }

    /// A master on the same line.
    pub(crate) fn client(&self) -> Client {
        Client::on(&format!("rs485:{}", self.address.unwrap()))
    }

    /// So many of them, each known to be on the line, and with nothing left to hear.
    pub(crate) fn clients(&self, count: usize) -> Vec<Client> {
        let mut clients: Vec<Client> = Vec::new();
        for _ in 0..count {
            let mut client = self.client();
            client.join();
            for other in &mut clients {
                other.expect(&[REQUEST, ANSWER].concat());
            }
            clients.push(client);
        }
        clients
    }

    /// The slave, what was told to people, and how many turns it took.
    pub(crate) fn stop(self) -> (Slave, Vec<Notice>, usize) {
        self.waker.wake();
        self.thread.join().unwrap()
    }
}

/// Somebody on the line that says and expects octets.
pub(crate) struct Client {
    pub(crate) port: Box<dyn Rs485Port>,
    heard: Vec<u8>,
    pub(crate) notices: Vec<Notice>,
}

impl Client {
    pub(crate) fn on(uri: &str) -> Self {
        let port = open_rs485(&uri.parse().unwrap(), BaudRate::Kbit187_5).unwrap();
        Self { port, heard: Vec::new(), notices: Vec::new() }
    }

    pub(crate) fn say(&mut self, octets: &[u8]) {
        self.port.send(&Transmission::new(octets).unwrap()).unwrap();
    }

    /// Listens until `count` octets were heard or `patience` is over.
    fn listen(&mut self, count: usize, patience: Duration) -> Result<(), LinkError> {
        let start = Instant::now();
        while self.heard.len() < count {
            let left = patience.saturating_sub(start.elapsed());
            match self.port.receive(Some(left))? {
                Some(Rs485Received::Octets(octets)) => self.heard.extend(octets),
                Some(Rs485Received::Notice(notice)) => self.notices.push(notice),
                Some(other) => panic!("{other:?} on a line of octets"),
                None => break,
            }
        }
        Ok(())
    }

    /// The next `count` octets; panics when they do not come in time.
    pub(crate) fn hear(&mut self, count: usize) -> Vec<u8> {
        self.listen(count, PATIENCE).unwrap();
        assert!(self.heard.len() >= count, "only {} came", hex(&self.heard));
        self.heard.drain(..count).collect()
    }

    pub(crate) fn expect(&mut self, octets: &[u8]) {
        assert_eq!(hex(&self.hear(octets.len())), hex(octets));
    }

    pub(crate) fn expect_nothing(&mut self) {
        self.listen(1, Duration::from_millis(30)).unwrap();
        assert_eq!(hex(&self.heard), "");
    }

    /// Why the line is lost, which it is in time.
    pub(crate) fn expect_loss(&mut self) -> String {
        self.expect_notice(|notice| match notice {
            Notice::BusLost { .. } => Some(notice.to_string()),
            _ => None,
        })
    }

    /// The first notice that `wanted` knows; panics when none comes in time.
    pub(crate) fn expect_notice<T>(&mut self, wanted: impl Fn(&Notice) -> Option<T>) -> T {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(found) = self.notices.drain(..).find_map(|notice| wanted(&notice)) {
                return found;
            }
            match self.port.receive(Some(PATIENCE)).unwrap() {
                Some(Rs485Received::Notice(notice)) => self.notices.push(notice),
                Some(Rs485Received::Octets(octets)) => self.heard.extend(octets),
                Some(other) => panic!("{other:?} on a line of octets"),
                None => {}
            }
        }
        panic!("nothing was told");
    }

    /// Asks until the slave answers, so that it is known to have this client on the line.
    pub(crate) fn join(&mut self) {
        self.say(&REQUEST);
        self.expect(&ANSWER);
    }
}

/// As the books print telegrams.
pub(crate) fn hex(octets: &[u8]) -> String {
    octets.iter().fold(String::new(), |mut text, octet| {
        write!(text, "{octet:02X} ").unwrap();
        text
    })
}
