//! The unconnected port, and allocation and release of the predefined master/slave connection set.

use codewheel_station::{Instant, Writer};

use super::production::{AcknowledgeHandler, Production, Trigger};
use super::router::put;
use super::{Io, Server, expect_length, refuse};
use crate::application::Done;
use crate::connection::{CHANGE_OF_STATE, Connection, EXPLICIT, POLL, State};
use crate::explicit::{Error, GeneralStatus, Header, Service, class};
use crate::{Application, Event, MacId, ProducedPath};

/// The bits of the allocation and release choice octets.
pub mod choice {
    /// Bit 0: the explicit connection.
    pub const EXPLICIT: u8 = 0x01;
    /// Bit 1: the poll connection.
    pub const POLL: u8 = 0x02;
    /// Bit 2: the bit-strobe connection.
    pub const BIT_STROBE: u8 = 0x04;
    /// Bit 3: the multicast poll connection.
    pub const MULTICAST_POLL: u8 = 0x08;
    /// Bit 4: the change of state connection.
    pub const CHANGE_OF_STATE: u8 = 0x10;
    /// Bit 5: the cyclic connection.
    pub const CYCLIC: u8 = 0x20;
    /// Bit 6: change of state or cyclic data are not acknowledged.
    pub const ACKNOWLEDGE_SUPPRESSION: u8 = 0x40;
}

/// What this server can allocate.
const SUPPORTED: u8 = choice::EXPLICIT
    | choice::POLL
    | choice::CHANGE_OF_STATE
    | choice::CYCLIC
    | choice::ACKNOWLEDGE_SUPPRESSION;
/// The bits that name connection instance 4.
const CHANGE: u8 = choice::CHANGE_OF_STATE | choice::CYCLIC;

/// Additional code 01: the set belongs to another master.
const ALLOCATION_CONFLICT: u8 = 0x01;
/// Additional code 02: the choice octet makes no sense here.
const INVALID_CHOICE: u8 = 0x02;
/// Additional code 03: the unconnected port takes only Allocate and Release.
const NOT_FOR_UNCONNECTED_PORT: u8 = 0x03;

impl Server {
    /// A message on the Group 2 Only unconnected port.
    pub(super) fn unconnected_request<A: Application>(
        &mut self,
        now: Instant,
        data: &[u8],
        app: &mut A,
    ) {
        let Some((&first, body)) = data.split_first() else { return };
        let header = Header(first);
        let Some((&service, rest)) = body.split_first() else { return };
        if !header.fragmented() && service >= 0x80 {
            return;
        }
        let service = Service(service);
        let mut octets = [0; 2];
        let mut out = Writer::new(&mut octets);
        let result = match (header.fragmented(), service, rest) {
            (false, Service::ALLOCATE, [class::DEVICENET, 1, data @ ..]) => {
                self.allocate(now, data, &mut out, app)
            }
            (false, Service::RELEASE, [class::DEVICENET, 1, data @ ..]) => {
                self.release(now, data, header.mac(), app)
            }
            (false, Service::ALLOCATE | Service::RELEASE, [] | [_]) => {
                Err(refuse(GeneralStatus::NOT_ENOUGH_DATA))
            }
            _ => Err(Error::with(GeneralStatus::RESOURCE_UNAVAILABLE, NOT_FOR_UNCONNECTED_PORT)),
        };
        let written = out.len();
        let [octet, ..] = octets;
        let result = result.map(|_| (octet, written));
        self.messages.respond_unconnected(header, service, result);
    }

    /// The connections that exist, as an allocation choice octet.
    pub(super) fn allocation_choice(&self) -> u8 {
        self.choice_of(|_| true)
    }

    /// The connections that exist and may not be allocated anew.
    fn occupied(&self) -> u8 {
        self.choice_of(|state| !matches!(state, State::TimedOut | State::DeferredDelete))
    }

    fn choice_of(&self, counts: impl Fn(State) -> bool) -> u8 {
        let exists = |instance| self.connection_state(instance).is_some_and(&counts);
        let mut choice = 0;
        if exists(EXPLICIT) {
            choice |= choice::EXPLICIT;
        }
        if exists(POLL) {
            choice |= choice::POLL;
        }
        if exists(CHANGE_OF_STATE)
            && let Some(production) = &self.production
        {
            choice |= match production.trigger {
                Trigger::ChangeOfState => choice::CHANGE_OF_STATE,
                Trigger::Cyclic => choice::CYCLIC,
            };
            if !production.acknowledged {
                choice |= choice::ACKNOWLEDGE_SUPPRESSION;
            }
        }
        choice
    }

    /// A path that was kept, unless the device has no such assembly.
    fn path<A: Application>(kept: ProducedPath, app: &A) -> ProducedPath {
        match app.assembly_size(kept.assembly) {
            Some(_) => kept,
            None => ProducedPath::default(),
        }
    }

    /// Allocate_Master/Slave_Connection_Set: data `[choice] [allocator's MAC ID]`.
    pub(super) fn allocate<A: Application>(
        &mut self,
        now: Instant,
        data: &[u8],
        out: &mut Writer<'_>,
        app: &mut A,
    ) -> Result<Done, Error> {
        expect_length(data, 2)?;
        let &[wanted, allocator] = data else {
            return Err(refuse(GeneralStatus::NOT_ENOUGH_DATA));
        };
        if self.master.is_some_and(|owner| owner.value() != allocator) {
            return Err(Error::with(GeneralStatus::OBJECT_STATE_CONFLICT, ALLOCATION_CONFLICT));
        }
        // Decision: an allocator address above 63 is no node, so nobody would own the set.
        let allocator =
            MacId::new(allocator).ok_or(refuse(GeneralStatus::INVALID_ATTRIBUTE_VALUE))?;
        let nonsense = Error::with(GeneralStatus::INVALID_ATTRIBUTE_VALUE, INVALID_CHOICE);
        if wanted == 0 {
            return Err(nonsense);
        }
        if wanted & choice::ACKNOWLEDGE_SUPPRESSION != 0 && wanted & CHANGE == 0 {
            return Err(nonsense);
        }
        if wanted & !SUPPORTED != 0 {
            return Err(Error::with(GeneralStatus::RESOURCE_UNAVAILABLE, INVALID_CHOICE));
        }
        if wanted & choice::EXPLICIT == 0 && self.explicit.is_none() {
            return Err(nonsense);
        }
        if wanted & CHANGE == CHANGE {
            return Err(nonsense);
        }
        // Change of state and cyclic are two ways to use the same connection.
        let occupied = self.occupied();
        let occupied = if occupied & CHANGE != 0 { occupied | CHANGE } else { occupied };
        if wanted & occupied & !choice::ACKNOWLEDGE_SUPPRESSION != 0 {
            return Err(Error::with(GeneralStatus::ALREADY_IN_STATE, INVALID_CHOICE));
        }
        // The answer is written before anything changes, so a full buffer allocates nothing.
        let done = put(out.u8(0))?;
        self.master = Some(allocator);
        if wanted & choice::EXPLICIT != 0 {
            self.end_explicit();
            self.explicit = Some(Connection::explicit(now));
        }
        if wanted & choice::POLL != 0 {
            let path = Self::path(self.settings.poll_path, app);
            self.poll = Some(Io { connection: Connection::io(), path, owed: false });
        }
        if wanted & CHANGE != 0 {
            if self.production.is_none() {
                self.acknowledge_handler = AcknowledgeHandler::DEFAULT;
            }
            let trigger =
                if wanted & choice::CYCLIC == 0 { Trigger::ChangeOfState } else { Trigger::Cyclic };
            let acknowledged = wanted & choice::ACKNOWLEDGE_SUPPRESSION == 0;
            let path = Self::path(self.settings.change_path, app);
            self.production = Some(Production::new(trigger, acknowledged, path));
        }
        app.notice(now, Event::Allocated { master: allocator, choice: wanted });
        Ok(done)
    }

    /// Release_Master/Slave_Connection_Set: data `[choice]`, asked for by `from`.
    pub(super) fn release<A: Application>(
        &mut self,
        now: Instant,
        data: &[u8],
        from: MacId,
        app: &mut A,
    ) -> Result<Done, Error> {
        expect_length(data, 1)?;
        let &[released] = data else {
            return Err(refuse(GeneralStatus::NOT_ENOUGH_DATA));
        };
        // Bit 6 says how a connection is used and names none.
        let connections = released & !choice::ACKNOWLEDGE_SUPPRESSION;
        if connections == 0 {
            return Err(Error::with(GeneralStatus::INVALID_ATTRIBUTE_VALUE, INVALID_CHOICE));
        }
        if released & !SUPPORTED != 0 {
            return Err(Error::with(GeneralStatus::RESOURCE_UNAVAILABLE, INVALID_CHOICE));
        }
        if connections & !self.allocation_choice() != 0 {
            return Err(Error::with(GeneralStatus::ALREADY_IN_STATE, INVALID_CHOICE));
        }
        if self.master != Some(from) {
            return Err(Error::with(GeneralStatus::OBJECT_STATE_CONFLICT, ALLOCATION_CONFLICT));
        }
        app.notice(now, Event::Released { choice: released });
        if released & choice::POLL != 0 {
            self.poll = None;
        }
        if released & CHANGE != 0 {
            self.production = None;
        }
        if released & choice::EXPLICIT != 0 {
            self.end_explicit();
        }
        self.settle_ownership(now, app);
        Ok(Done::Now)
    }
}
