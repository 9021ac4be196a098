//! The scanner: a master that allocates its slaves, polls them in cycles, reads and writes their
//! attributes, notices when one is gone and brings it back.

mod exchange;
mod slave;

use codewheel_station::can::{self, Filter, Frame};
use codewheel_station::{Deadline, Duration, Instant, Station};

use self::exchange::{Outcome, Port, REQUEST_OCTETS};
use self::slave::Slave;
use crate::explicit::{Error, Header};
use crate::identifier::{
    DUPLICATE_MAC_CHECK, EXPLICIT_RESPONSE, Identifier, POLL_COMMAND, POLL_RESPONSE, group_2,
};
use crate::{CheckMessage, DuplicateMacCheck, Fault, MacId};

/// What the scanner shall do with one slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlaveSettings {
    /// Its address.
    pub mac: MacId,
    /// The expected packet rate of the poll connection in ms; 0 = no time-out on either side.
    pub expected_packet_rate: u16,
    /// The assembly that polls shall bring; `None` leaves what the slave has kept.
    pub assembly: Option<u8>,
    /// The vendor and product code the slave must have; `None` takes any.
    pub identity: Option<(u16, u16)>,
}

impl SlaveSettings {
    /// Polls `mac`, whatever it is, with an expected packet rate of 200 ms.
    #[must_use]
    pub const fn poll(mac: MacId) -> Self {
        Self { mac, expected_packet_rate: 200, assembly: None, identity: None }
    }
}

/// Who the scanner says it is when it checks its own MAC ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScannerIdentity {
    /// Vendor code.
    pub vendor: u16,
    /// Serial number.
    pub serial: u32,
}

/// Why a slave does not exchange data although it answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It refused a service.
    Service(Error),
    /// It is not the device that the settings name.
    AnotherDevice {
        /// The code it gave.
        found: u16,
        /// The code that was wanted.
        wanted: u16,
    },
}

/// Where a slave stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlaveState {
    /// It does not answer.
    Absent,
    /// It answers and is being configured.
    Configuring,
    /// It answers polls.
    Running,
    /// It answers, and refuses; tried again every two seconds.
    Refused(Refusal),
}

/// What is known of a slave now.
#[derive(Clone, Copy, Debug)]
pub struct SlaveView<'a> {
    /// Where it stands.
    pub state: SlaveState,
    /// Its latest input data; empty before the first poll response.
    pub input: &'a [u8],
    /// When the input arrived.
    pub input_at: Option<Instant>,
    /// Poll commands sent.
    pub polls: u64,
    /// Poll responses received.
    pub responses: u64,
    /// How often it was lost while running.
    pub losses: u32,
}

/// Names an explicit request until its response has been fetched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ticket(u32);

/// Why the scanner does not take a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotTaken {
    /// No slave with this MAC ID has been added.
    UnknownSlave,
    /// The slave does not exchange data yet, so there is no explicit connection to it.
    NotRunning,
    /// A request to this slave is under way, or its response has not been fetched.
    Busy,
    /// The request is longer than 64 octets, or empty.
    Length,
}

/// What came back for a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Response<'a> {
    /// The slave did it; the data of its response.
    Done(&'a [u8]),
    /// The slave refused.
    Refused(Error),
    /// The slave did not answer in time.
    NoAnswer,
}

/// How a slave cannot be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotAdded {
    /// All places are taken.
    Full,
    /// The address is the scanner's own or has been added before.
    AddressInUse,
}

/// The times of the poll cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CycleTimes {
    /// Cycles completed.
    pub count: u64,
    /// The last one, from its first poll to its last response.
    pub last: Duration,
    /// The longest one.
    pub longest: Duration,
}

/// How long the scanner waits for outstanding poll responses before it goes on without them.
const RESPONSE_TIME: Duration = Duration::from_millis(50);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cycle {
    /// Nothing is polled until then.
    Pause { until: Instant },
    /// Polls are being sent; `next` is the place of the next slave to look at.
    Polling { began: Instant, next: usize },
    /// All polls are out; responses are waited for.
    Collecting { began: Instant, until: Instant },
}

/// A DeviceNet scanner for up to `SLAVES` slaves.
#[derive(Clone, Debug)]
pub struct Scanner<const SLAVES: usize = 63> {
    mac: MacId,
    identity: ScannerIdentity,
    network: DuplicateMacCheck,
    slaves: [Option<Slave>; SLAVES],
    /// Place of each address among the slaves, plus one.
    places: [u8; 64],
    /// No slave falls due before this. It may be early, for a deadline that moves on is not noted,
    /// but is never late. So most frames need not look at every slave.
    slaves_due: Deadline,
    /// No exchange has a frame to send unless this is set. In the same way it may be set in vain.
    owed: bool,
    cycle: Cycle,
    interval: Duration,
    interscan_delay: Duration,
    times: CycleTimes,
    tickets: u32,
}

impl<const SLAVES: usize> Scanner<SLAVES> {
    /// A scanner at `mac` that polls all slaves once every `interval`, or as fast as the bus
    /// carries it with an interval of zero.
    #[must_use]
    pub fn new(mac: MacId, identity: ScannerIdentity, interval: Duration) -> Self {
        Self {
            mac,
            identity,
            network: DuplicateMacCheck::begin(mac),
            slaves: [const { None }; SLAVES],
            places: [0; 64],
            slaves_due: Deadline::NEVER,
            owed: false,
            cycle: Cycle::Pause { until: Instant::ZERO },
            interval,
            interscan_delay: Duration::ZERO,
            times: CycleTimes::default(),
            tickets: 0,
        }
    }

    /// The shortest pause between two cycles. Leave one where slaves shall be read and written
    /// while others are polled as fast as the bus carries it: explicit responses of high MAC IDs
    /// lose arbitration against every poll.
    pub const fn set_interscan_delay(&mut self, delay: Duration) {
        self.interscan_delay = delay;
    }

    /// The scanner's own address.
    #[must_use]
    pub const fn mac(&self) -> MacId {
        self.mac
    }

    /// Adds a slave to the scan list.
    ///
    /// # Errors
    /// [`NotAdded`] where there is no place, or the address is taken.
    pub fn add(&mut self, settings: SlaveSettings) -> Result<(), NotAdded> {
        let address = usize::from(settings.mac.value());
        let known = self.places.get(address).is_some_and(|place| *place != 0);
        if settings.mac == self.mac || known {
            return Err(NotAdded::AddressInUse);
        }
        let free = self.slaves.iter_mut().zip(1u8..).find(|(slave, _)| slave.is_none());
        let (Some((slave, number)), Some(place)) = (free, self.places.get_mut(address)) else {
            return Err(NotAdded::Full);
        };
        let added = slave.insert(Slave::new(settings, self.mac));
        self.slaves_due = self.slaves_due.min(added.deadline());
        *place = number;
        Ok(())
    }

    /// Whether the scanner itself is on-line.
    #[must_use]
    pub const fn is_on_line(&self) -> bool {
        self.network.is_on_line()
    }

    /// Why the scanner is silent, if it is.
    #[must_use]
    pub const fn faulted(&self) -> Option<Fault> {
        self.network.faulted()
    }

    /// The times of the poll cycle.
    #[must_use]
    pub const fn cycle_times(&self) -> CycleTimes {
        self.times
    }

    /// What is known of the slave at `mac`; `None` where none was added.
    #[must_use]
    pub fn slave(&self, mac: MacId) -> Option<SlaveView<'_>> {
        let slave = self.slaves.get(self.place(mac)?)?.as_ref()?;
        Some(SlaveView {
            state: slave.state(),
            input: slave.input(),
            input_at: slave.input_at,
            polls: slave.polls,
            responses: slave.responses,
            losses: slave.losses,
        })
    }

    /// The frames the scanner wants to see: everything of groups 1 and 2.
    #[must_use]
    pub const fn filters(&self) -> [Filter; 2] {
        [Filter { mask: 0x400, value: 0 }, Filter { mask: 0x600, value: 0x400 }]
    }

    /// Sends the explicit request `body` — service, class, instance, attribute, data — to a slave
    /// that exchanges data. It may take up to `patience` to answer; a Save takes up to 5 s.
    ///
    /// Ask [`transmit`](Station::transmit) afterwards, and [`response`](Self::response) after
    /// each input, until it comes.
    ///
    /// # Errors
    /// [`NotTaken`] says why the request cannot be sent now.
    pub fn request(
        &mut self,
        mac: MacId,
        body: &[u8],
        patience: Duration,
    ) -> Result<Ticket, NotTaken> {
        if body.is_empty() || body.len() > REQUEST_OCTETS {
            return Err(NotTaken::Length);
        }
        let ticket = Ticket(self.tickets);
        self.change(mac, |slave| {
            if slave.ticket.is_some() || slave.unanswered.is_some() {
                return Err(NotTaken::Busy);
            }
            if !slave.is_running() {
                return Err(NotTaken::NotRunning);
            }
            slave.ticket = Some(ticket);
            slave.exchange.begin(Port::Connected, body, patience);
            Ok(())
        })
        .unwrap_or(Err(NotTaken::UnknownSlave))?;
        self.tickets = self.tickets.wrapping_add(1);
        Ok(ticket)
    }

    /// What came back for `ticket`; `None` while nothing has, or for a ticket that was fetched.
    /// `with` sees the response; afterwards the slave can be asked again.
    pub fn response<T>(
        &mut self,
        ticket: Ticket,
        with: impl FnOnce(Response<'_>) -> T,
    ) -> Option<T> {
        let slave = self.slaves.iter_mut().flatten().find(|slave| slave.ticket == Some(ticket))?;
        let seen = with(match slave.exchange.outcome()? {
            Outcome::Done(data) => Response::Done(data),
            Outcome::Refused(error) => Response::Refused(error),
            Outcome::NoAnswer => Response::NoAnswer,
        });
        slave.ticket = None;
        slave.exchange.stop();
        Some(seen)
    }

    fn place(&self, mac: MacId) -> Option<usize> {
        let place = self.places.get(usize::from(mac.value())).copied()?;
        usize::from(place).checked_sub(1)
    }

    /// Changes the slave at `mac`, and notes what it has to send and when it falls due then; `None`
    /// where none was added.
    fn change<T>(&mut self, mac: MacId, change: impl FnOnce(&mut Slave) -> T) -> Option<T> {
        let place = self.place(mac)?;
        let slave = self.slaves.get_mut(place)?.as_mut()?;
        let result = change(slave);
        self.slaves_due = self.slaves_due.min(slave.deadline());
        self.owed |= slave.exchange.is_owed();
        Some(result)
    }

    fn frame(&mut self, now: Instant, frame: &Frame) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        if frame.is_remote() {
            return;
        }
        match Identifier::from_bits(bits) {
            Identifier::Group2 { mac, message: DUPLICATE_MAC_CHECK } => {
                if mac == self.mac {
                    self.network.heard(frame.data());
                } else if CheckMessage::parse(frame.data()).is_ok_and(|check| !check.response) {
                    self.change(mac, |slave| slave.booted(now));
                }
            }
            _ if !self.network.is_on_line() => {}
            Identifier::Group1 { message: POLL_RESPONSE, source } => {
                self.change(source, |slave| slave.response(now, frame.data()));
                self.close_cycle(now);
            }
            Identifier::Group2 { mac, message: EXPLICIT_RESPONSE } => {
                if let [first, rest @ ..] = frame.data() {
                    self.change(mac, |slave| {
                        slave.exchange.heard(now, Header(*first), rest);
                        slave.advance(now);
                    });
                }
            }
            _ => {}
        }
    }

    /// Ends the cycle when every polled slave has answered or the time for it is over.
    fn close_cycle(&mut self, now: Instant) {
        let Cycle::Collecting { began, until } = self.cycle else { return };
        let outstanding = self.slaves.iter().flatten().any(|slave| slave.awaited);
        if outstanding && now < until {
            return;
        }
        self.times.count += 1;
        self.times.last = now.since(began);
        self.times.longest = self.times.longest.max(self.times.last);
        let until = (began + self.interval).max(now + self.interscan_delay);
        self.cycle = Cycle::Pause { until };
    }

    fn next_poll(&mut self, now: Instant) -> Option<Frame> {
        if let Cycle::Pause { until } = self.cycle
            && now >= until
            && self.slaves.iter().flatten().any(Slave::is_running)
        {
            self.cycle = Cycle::Polling { began: now, next: 0 };
        }
        let Cycle::Polling { began, next } = self.cycle else { return None };
        for (place, slave) in self.slaves.iter_mut().enumerate().skip(next) {
            let Some(slave) = slave.as_mut().filter(|slave| slave.is_running()) else { continue };
            slave.awaited = true;
            slave.polls += 1;
            self.cycle = Cycle::Polling { began, next: place + 1 };
            return Some(Frame::standard(group_2(slave.settings.mac, POLL_COMMAND), &[]));
        }
        self.cycle = Cycle::Collecting { began, until: now + RESPONSE_TIME };
        self.close_cycle(now);
        None
    }
}

impl<const SLAVES: usize> Station for Scanner<SLAVES> {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;

    fn handle(&mut self, now: Instant, input: can::Input<'_>) {
        self.advance(now);
        match input {
            can::Input::Frame(frame) => self.frame(now, frame),
            can::Input::Sent(frame) => {
                if let can::Identifier::Standard(bits) = frame.identifier() {
                    self.network.sent(now, bits);
                }
            }
            can::Input::BusOff => self.network.fault(Fault::BusOff),
            can::Input::Recovered => {}
        }
    }

    fn advance(&mut self, now: Instant) {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return;
        }
        self.network.advance(now);
        if !self.network.is_on_line() {
            return;
        }
        if self.slaves_due.take_due(now) {
            for slave in self.slaves.iter_mut().flatten() {
                slave.advance(now);
                self.slaves_due = self.slaves_due.min(slave.deadline());
            }
            self.owed = true;
        }
        self.close_cycle(now);
    }

    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        if !self.network.is_on_line() {
            return self.network.transmit(self.identity.vendor, self.identity.serial);
        }
        if let Some(frame) = self.network.transmit(self.identity.vendor, self.identity.serial) {
            return Some(frame);
        }
        if self.owed {
            for slave in self.slaves.iter_mut().flatten() {
                if let Some(frame) = slave.exchange.transmit(now) {
                    self.slaves_due = self.slaves_due.min(slave.deadline());
                    return Some(frame);
                }
            }
            self.owed = false;
        }
        self.next_poll(now)
    }

    fn deadline(&self) -> Option<Instant> {
        if !self.network.is_on_line() {
            return self.network.deadline().instant();
        }
        let cycle = match self.cycle {
            Cycle::Pause { until } => {
                let running = self.slaves.iter().flatten().any(Slave::is_running);
                Deadline::from(running.then_some(until))
            }
            Cycle::Polling { .. } => Deadline::NEVER,
            Cycle::Collecting { until, .. } => Deadline::at(until),
        };
        cycle.min(self.slaves_due).instant()
    }
}
