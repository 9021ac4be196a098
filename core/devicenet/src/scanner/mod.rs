//! The scanner: a master that allocates its slaves, exchanges data with them, reads and writes
//! their attributes, notices when one is gone and brings it back.
//!
//! | subject | |
//! |---|---|
//! | [`SlaveSettings`] | polled, change of state, cyclic, or explicit messages alone |
//! | [`Scanner::slave`] | what came in, and where the slave stands |
//! | [`Scanner::request`] | explicit messages, each with a [`Ticket`] |
//! | [`Scanner::scan`] | the live list of all 64 addresses |
//! | [`ParameterWalk`] | what a device never seen before can be told |

mod cycle;
mod exchange;
mod io;
mod live_list;
mod parameters;
mod settings;
mod slave;
mod station;
mod steps;
mod view;

use codewheel_station::can::Filter;
use codewheel_station::{Deadline, Duration, Instant};

use self::cycle::Cycle;
use self::io::LongPoll;
use self::live_list::LiveScan;
use self::slave::{REQUEST_OCTETS, Slave};
use crate::explicit::{Path, Service};
use crate::{DuplicateMacCheck, Fault, MacId};

pub use self::exchange::ANSWER_TIME;
pub use self::io::IO_DATA_OCTETS;
pub use self::live_list::{LiveList, Presence, Probing, ScanProgress};
pub use self::parameters::{
    DataType, Octets, PARAMETER, Parameter, ParameterWalk, Text, Value, Walked,
};
pub use self::settings::{
    ChangeSettings, DeviceIdentity, IdentityCode, NotAdded, NotSet, NotTaken, PollSettings,
    Refusal, ScannerIdentity, SlaveSettings, Trigger,
};
pub use self::view::{CycleTimes, Response, SlaveState, SlaveView, Ticket};

/// How long [`Scanner::set`] lets a slave take to answer: some write their memory first.
pub const SET_TIME: Duration = Duration::from_secs(3);

/// A DeviceNet scanner for up to `SLAVES` slaves, 64 at most.
///
/// It checks its own MAC ID first, then brings all slaves of its scan list to data exchange. When
/// it leaves the bus, all of them are left, and requests under way end with
/// [`Response::NoAnswer`]. After a bus-off it begins anew when the controller reports itself
/// recovered; where another node has its MAC ID, it stays silent until [`restart`](Self::restart).
#[derive(Clone, Debug)]
pub struct Scanner<const SLAVES: usize = 63> {
    mac: MacId,
    identity: ScannerIdentity,
    network: DuplicateMacCheck,
    slaves: [Option<Slave>; SLAVES],
    /// Place of each address among the slaves, plus one.
    places: [u8; 64],
    /// When each slave falls due, and the earliest of that. With these, and the bits below, not
    /// every frame looks at every slave; they may be too early, never too late.
    due: [Deadline; SLAVES],
    slaves_due: Deadline,
    /// Who, by place, may have an explicit message to be sent.
    owing: u64,
    /// Whose production, by place, is to be acknowledged.
    acknowledging: u64,
    cycle: Cycle<SLAVES>,
    long_poll: LongPoll,
    live: LiveScan,
    tickets: u32,
}

impl<const SLAVES: usize> Scanner<SLAVES> {
    /// A scanner at `mac` that polls all slaves once every `interval`, or as fast as the bus
    /// carries it with an interval of zero.
    #[must_use]
    pub fn new(mac: MacId, identity: ScannerIdentity, interval: Duration) -> Self {
        const { assert!(SLAVES <= 64, "a segment has 64 addresses") };
        Self {
            mac,
            identity,
            network: DuplicateMacCheck::begin(mac),
            slaves: [const { None }; SLAVES],
            places: [0; 64],
            due: [Deadline::NEVER; SLAVES],
            slaves_due: Deadline::NEVER,
            owing: 0,
            acknowledging: 0,
            cycle: Cycle::new(interval),
            long_poll: LongPoll::idle(mac),
            live: LiveScan::new(mac),
            tickets: 0,
        }
    }

    /// The shortest pause between two cycles. Leave one where slaves shall be read and written
    /// while others are polled as fast as the bus carries it: explicit responses of high MAC IDs
    /// lose arbitration against every poll.
    pub const fn set_interscan_delay(&mut self, delay: Duration) {
        self.cycle.interscan_delay = delay;
    }

    /// The scanner's own address.
    #[must_use]
    pub const fn mac(&self) -> MacId {
        self.mac
    }

    /// The frames the scanner wants to see: all, since each says who is there.
    #[must_use]
    pub const fn filters(&self) -> [Filter; 1] {
        [Filter::ALL]
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

    /// Checks the MAC ID anew and begins again, as after switching on: the way out of
    /// [`Fault::DuplicateMac`]. Ask [`transmit`](codewheel_station::Station::transmit) afterwards.
    pub fn restart(&mut self) {
        self.network = DuplicateMacCheck::begin(self.mac);
        self.leave_all();
    }

    /// Adds a slave to the scan list. Read the
    /// [`deadline`](codewheel_station::Station::deadline) anew afterwards.
    ///
    /// # Errors
    /// [`NotAdded`] where there is no place, or the address is taken; a slave that was
    /// [removed](Self::remove) keeps it until it is released.
    pub fn add(&mut self, settings: SlaveSettings) -> Result<(), NotAdded> {
        let address = usize::from(settings.mac.value());
        if settings.mac == self.mac || self.place(settings.mac).is_some() {
            return Err(NotAdded::AddressInUse);
        }
        let free = self.slaves.iter().zip(0u8..).find(|(slave, _)| slave.is_none());
        let Some((_, place)) = free else { return Err(NotAdded::Full) };
        if let (Some(slave), Some(number)) =
            (self.slaves.get_mut(usize::from(place)), self.places.get_mut(address))
        {
            *slave = Some(Slave::new(settings, self.mac));
            *number = place + 1;
        }
        self.note(usize::from(place));
        Ok(())
    }

    /// Takes a slave off the scan list: its connections are released, then it is forgotten and
    /// [`slave`](Self::slave) gives `None`. Requests to it end with [`Response::NoAnswer`]. Ask
    /// [`transmit`](codewheel_station::Station::transmit) afterwards. Returns whether there was
    /// one.
    pub fn remove(&mut self, mac: MacId) -> bool {
        let on_line = self.is_on_line();
        self.change(mac, |slave| slave.remove(on_line)).is_some()
    }

    /// Begins to poll a slave that runs without: allocates the poll connection besides what it has,
    /// which stays. Meanwhile it is [configured](SlaveState::Configuring). One that refuses is
    /// [refused](SlaveState::Refused), and all it has is released. Ask
    /// [`transmit`](codewheel_station::Station::transmit) afterwards.
    ///
    /// # Errors
    /// [`NotTaken`] says why it cannot be done now; a slave that is polled has [`NotTaken::Busy`].
    pub fn begin_polling(&mut self, mac: MacId, poll: PollSettings) -> Result<(), NotTaken> {
        if !self.is_on_line() {
            return Err(NotTaken::OffLine);
        }
        self.change(mac, |slave| match slave.settings.poll {
            Some(_) => Err(NotTaken::Busy),
            None => slave.begin_polling(poll),
        })
        .unwrap_or(Err(NotTaken::UnknownSlave))
    }

    /// Ends the polls of a slave: releases the poll connection, and keeps what else there is. Of a
    /// slave without polls nothing is wanted. Ask
    /// [`transmit`](codewheel_station::Station::transmit) afterwards.
    ///
    /// # Errors
    /// [`NotTaken`] says why it cannot be done now.
    pub fn end_polling(&mut self, mac: MacId) -> Result<(), NotTaken> {
        if !self.is_on_line() {
            return Err(NotTaken::OffLine);
        }
        self.change(mac, |slave| match slave.settings.poll {
            Some(_) => slave.end_polling(),
            None => Ok(()),
        })
        .unwrap_or(Err(NotTaken::UnknownSlave))
    }

    /// The times of the poll cycle.
    #[must_use]
    pub const fn cycle_times(&self) -> CycleTimes {
        self.cycle.times
    }

    /// What is known of the slave at `mac`; `None` where none was added.
    #[must_use]
    pub fn slave(&self, mac: MacId) -> Option<SlaveView<'_>> {
        Some(self.slaves.get(self.place(mac)?)?.as_ref()?.view())
    }

    /// Sets what polls carry to the slave at `mac`, in fragments where it does not fit a frame.
    /// Without data, and by default, polls are empty, which slaves with outputs take as idle.
    ///
    /// # Errors
    /// [`NotSet`] where no such slave is polled, or it consumes another number of octets. What it
    /// consumes is known once it runs; data set earlier that do not fit make it
    /// [refused](Refusal::OutputLength).
    pub fn set_output(&mut self, mac: MacId, data: &[u8]) -> Result<(), NotSet> {
        let place = self.place(mac).ok_or(NotSet::UnknownSlave)?;
        let slave = self.slaves.get_mut(place).and_then(Option::as_mut);
        let slave = slave.filter(|slave| slave.settings.poll.is_some());
        if slave.ok_or(NotSet::UnknownSlave)?.set_output(data) {
            Ok(())
        } else {
            Err(NotSet::Length)
        }
    }

    /// Sends the explicit request `body` — service, class, instance, attribute, data — to a slave
    /// that exchanges data. It may take up to `patience` to answer; a Save takes up to 5 s.
    ///
    /// Without an answer, the explicit connection is allocated anew. Only where the slave had lost
    /// it, so that it cannot have seen the request, the request is repeated, once.
    ///
    /// Ask [`transmit`](codewheel_station::Station::transmit) afterwards, and
    /// [`response`](Self::response) after each input and each deadline, until it comes.
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
        if self.place(mac).is_none() {
            return Err(NotTaken::UnknownSlave);
        }
        if !self.is_on_line() {
            return Err(NotTaken::OffLine);
        }
        let ticket = Ticket { mac, number: self.tickets };
        self.change(mac, |slave| slave.request(ticket, body, patience))
            .unwrap_or(Err(NotTaken::UnknownSlave))?;
        self.tickets = self.tickets.wrapping_add(1);
        Ok(ticket)
    }

    /// Reads an attribute: [`request`](Self::request) of Get_Attribute_Single with a patience of
    /// [`ANSWER_TIME`].
    ///
    /// # Errors
    /// [`NotTaken`] says why the request cannot be sent now.
    pub fn get(&mut self, mac: MacId, path: Path) -> Result<Ticket, NotTaken> {
        let Path { class, instance, attribute } = path;
        let body = [Service::GET_ATTRIBUTE_SINGLE.0, class, instance, attribute];
        self.request(mac, &body, ANSWER_TIME)
    }

    /// Writes an attribute: [`request`](Self::request) of Set_Attribute_Single with a patience of
    /// [`SET_TIME`]. `data` has 60 octets at most.
    ///
    /// # Errors
    /// [`NotTaken`] says why the request cannot be sent now.
    pub fn set(&mut self, mac: MacId, path: Path, data: &[u8]) -> Result<Ticket, NotTaken> {
        let Path { class, instance, attribute } = path;
        let head = [Service::SET_ATTRIBUTE_SINGLE.0, class, instance, attribute];
        let mut body = [0; REQUEST_OCTETS];
        for (to, from) in body.iter_mut().zip(head.iter().chain(data)) {
            *to = *from;
        }
        let body = body.get(..head.len() + data.len()).ok_or(NotTaken::Length)?;
        self.request(mac, body, SET_TIME)
    }

    /// What came back for `ticket`; `None` while nothing has. `with` sees the response; afterwards
    /// the slave can be asked again, and the ticket says [`Response::NoAnswer`], as one of a slave
    /// that was removed does.
    pub fn response<T>(
        &mut self,
        ticket: Ticket,
        with: impl FnOnce(Response<'_>) -> T,
    ) -> Option<T> {
        let place = self.place(ticket.mac);
        let slave = place.and_then(|place| self.slaves.get_mut(place)?.as_mut());
        let Some(slave) = slave.filter(|slave| slave.holds(ticket)) else {
            return Some(with(Response::NoAnswer));
        };
        let seen = with(slave.outcome()?);
        slave.cancel();
        Some(seen)
    }

    /// Gives a request up: its response, if it still comes, is dropped, and the slave can be asked
    /// again. Whether the slave has done what it was asked for stays unknown. Returns whether the
    /// ticket was still good.
    pub fn cancel(&mut self, ticket: Ticket) -> bool {
        self.change(ticket.mac, |slave| {
            let held = slave.holds(ticket);
            if held {
                slave.cancel();
            }
            held
        })
        .unwrap_or(false)
    }

    /// Begins to look who is on the segment: the scanner listens for 1.1 s, then asks each address
    /// that has not answered; see [`Probing`]. After about four seconds, and ten at the most,
    /// [`live_list`](Self::live_list) is complete. Slaves of the scan list are not probed, they
    /// are known. Polls and requests go on.
    ///
    /// # Errors
    /// [`NotTaken::OffLine`].
    pub fn scan(&mut self, now: Instant, probing: Probing) -> Result<(), NotTaken> {
        if !self.is_on_line() {
            return Err(NotTaken::OffLine);
        }
        self.live.begin(now, probing);
        Ok(())
    }

    /// Who is on the segment, as far as is known. Without a [`scan`](Self::scan), or before it is
    /// complete, that is what was heard so far.
    #[must_use]
    pub fn live_list(&self) -> LiveList {
        let mut list = self.live.list();
        for slave in self.slaves.iter().flatten() {
            let address = usize::from(slave.settings.mac.value());
            let answers = slave.view().state != SlaveState::Absent;
            if let Some(node) = list.nodes.get_mut(address).filter(|_| answers) {
                *node = Presence::Answers;
            }
        }
        list
    }

    fn place(&self, mac: MacId) -> Option<usize> {
        let place = self.places.get(usize::from(mac.value())).copied()?;
        usize::from(place).checked_sub(1)
    }

    /// Changes the slave at `mac`, and notes what has come of it; `None` where none was added.
    fn change<T>(&mut self, mac: MacId, change: impl FnOnce(&mut Slave) -> T) -> Option<T> {
        let place = self.place(mac)?;
        let result = change(self.slaves.get_mut(place)?.as_mut()?);
        self.note(place);
        Some(result)
    }

    /// Notes what the slave at `place` has to send, and when it falls due; frees the place of one
    /// that is gone.
    fn note(&mut self, place: usize) {
        let Some(slot) = self.slaves.get_mut(place) else { return };
        if let Some(slave) = slot.take_if(|slave| slave.is_gone())
            && let Some(number) = self.places.get_mut(usize::from(slave.settings.mac.value()))
        {
            *number = 0;
        }
        let slave = slot.as_ref();
        set(&mut self.owing, place, slave.is_some_and(Slave::is_owed));
        set(&mut self.acknowledging, place, slave.is_some_and(|slave| slave.acknowledge));
        self.cycle.set_polled(place, slave.is_some_and(Slave::is_polled));
        let due = slave.map_or(Deadline::NEVER, Slave::deadline);
        if let Some(noted) = self.due.get_mut(place) {
            *noted = due;
        }
        self.slaves_due = self.slaves_due.min(due);
    }

    /// The scanner has left the bus: so have, for it, all slaves.
    fn leave_all(&mut self) {
        self.live.abort();
        self.long_poll.stop();
        for place in 0..SLAVES {
            if let Some(slave) = self.slaves.get_mut(place).and_then(Option::as_mut) {
                slave.fall_silent();
                self.note(place);
            }
        }
        self.cycle.reset();
    }
}

/// Sets or clears the bit of a place.
const fn set(bits: &mut u64, place: usize, on: bool) {
    *bits = *bits & !(1 << place) | (on as u64) << place;
}
