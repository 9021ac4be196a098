//! A Group 2 Only Server with the predefined master/slave connection set.
//!
//! [`Server`] holds everything that is DeviceNet and nothing that is the device; the device is an
//! [`Application`], lent for one call at a time. What is owed to the wire is kept as flags and
//! built when the wire can take it, so a poll answered late is answered once, with the newest data.

mod acknowledge_handler;
mod allocation;
mod connection_object;
mod messages;
mod objects;
mod ownership;
mod production;
mod router;

use codewheel_station::can::{self, BitRate, Filter, Frame};
use codewheel_station::{Deadline, Duration, Instant};

pub use self::allocation::choice;
use self::messages::Messages;
use self::production::{AcknowledgeHandler, Production};
use crate::connection::{CHANGE_OF_STATE, Connection, EXPLICIT, POLL, State};
use crate::duplicate::Change;
use crate::explicit::{Error, GeneralStatus, Header, Service};
use crate::identifier::{
    CHANGE_ACKNOWLEDGE, CHANGE_OF_STATE_MESSAGE, DUPLICATE_MAC_CHECK, EXPLICIT_REQUEST,
    EXPLICIT_RESPONSE, POLL_COMMAND, POLL_RESPONSE, UNCONNECTED_REQUEST, group_1, group_2,
};
use crate::{Application, DuplicateMacCheck, Event, Fault, MacId, NetworkSettings, ProducedPath};

/// The longest explicit request body, connection attribute 8.
const REQUEST_OCTETS: usize = 64;
/// The longest explicit response body, connection attribute 7.
const RESPONSE_OCTETS: usize = 192;

/// What the network side of a device shows, as its lamp and a page need it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkStatus {
    /// The duplicate MAC ID check is not finished.
    NotOnLine,
    /// On-line, no connection established.
    OnLine,
    /// On-line, a connection (explicit counts) established.
    Connected,
    /// An I/O connection has timed out.
    TimedOut,
    /// Silent: duplicate MAC ID, bus-off or illegal switches.
    Faulted(Fault),
}

/// An I/O connection of the predefined set.
#[derive(Clone, Debug)]
struct Io {
    connection: Connection,
    path: ProducedPath,
    /// A production is owed to the wire.
    owed: bool,
}

/// How far a reset by the Identity object has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Restart {
    No,
    /// The device writes its defaults first.
    Writing,
    /// Accepted; the answer is not on the wire yet.
    Answering,
    /// The device is to cycle its power; nothing is heard or said any more.
    Due,
}

/// The DeviceNet side of one device.
#[derive(Clone, Debug)]
pub struct Server {
    mac: MacId,
    bit_rate: BitRate,
    settings: NetworkSettings,
    network: DuplicateMacCheck,
    bus_off_counter: u8,
    /// The owner of the connection set.
    master: Option<MacId>,
    explicit: Option<Connection>,
    poll: Option<Io>,
    production: Option<Production>,
    acknowledge_handler: AcknowledgeHandler,
    messages: Messages,
    restart: Restart,
    heartbeat_owed: bool,
    heartbeat_at: Deadline,
}

impl Server {
    /// A server that begins its duplicate MAC ID check.
    #[must_use]
    pub fn new(mac: MacId, bit_rate: BitRate, settings: NetworkSettings) -> Self {
        Self {
            mac,
            bit_rate,
            settings,
            network: DuplicateMacCheck::begin(mac),
            bus_off_counter: 0,
            master: None,
            explicit: None,
            poll: None,
            production: None,
            acknowledge_handler: AcknowledgeHandler::DEFAULT,
            messages: Messages::new(),
            restart: Restart::No,
            heartbeat_owed: false,
            heartbeat_at: Deadline::NEVER,
        }
    }

    /// A server that stays off the bus: the address switches give no MAC ID. Its
    /// [`mac`](Self::mac) and [`filter`](Self::filter) name MAC ID 63 and mean nothing.
    #[must_use]
    pub fn off_the_bus(bit_rate: BitRate, settings: NetworkSettings) -> Self {
        let mut server = Self::new(MacId::MAX, bit_rate, settings);
        server.network.fault(Fault::Switches);
        server
    }

    /// The address, as read from the switches at power-up.
    #[must_use]
    pub const fn mac(&self) -> MacId {
        self.mac
    }

    /// The bit rate, as read from the switches at power-up.
    #[must_use]
    pub const fn bit_rate(&self) -> BitRate {
        self.bit_rate
    }

    /// What the network part keeps through a power cut.
    #[must_use]
    pub const fn settings(&self) -> NetworkSettings {
        self.settings
    }

    /// The master that owns the connection set.
    #[must_use]
    pub const fn master(&self) -> Option<MacId> {
        self.master
    }

    /// The state of a connection instance; `None` while it does not exist.
    #[must_use]
    pub fn connection_state(&self, instance: u8) -> Option<State> {
        match instance {
            EXPLICIT => self.explicit.as_ref().map(|connection| connection.state),
            _ => self.io(instance).map(|io| io.connection.state),
        }
    }

    /// Whether a change of state connection is established, so that the device must watch its data
    /// closely.
    #[must_use]
    pub fn watches_changes(&self) -> bool {
        self.production.as_ref().is_some_and(|production| {
            production.io.connection.is_established()
                && production.trigger == production::Trigger::ChangeOfState
        })
    }

    /// What the lamp shows.
    #[must_use]
    pub fn status(&self) -> NetworkStatus {
        if let Some(fault) = self.network.faulted() {
            NetworkStatus::Faulted(fault)
        } else if !self.network.is_on_line() {
            NetworkStatus::NotOnLine
        } else if self.io_is(State::TimedOut) {
            NetworkStatus::TimedOut
        } else if self.explicit.is_some() || self.io_is(State::Established) {
            NetworkStatus::Connected
        } else {
            NetworkStatus::OnLine
        }
    }

    /// The frames this server wants to see: group 2 with its own MAC ID.
    #[must_use]
    pub const fn filter(&self) -> Filter {
        Filter { mask: 0x7F8, value: group_2(self.mac, 0) }
    }

    /// Takes in what the controller reports at `now`.
    pub fn handle<A: Application>(&mut self, now: Instant, input: can::Input<'_>, app: &mut A) {
        self.advance(now, app);
        match input {
            can::Input::Frame(frame) => self.frame(now, frame, app),
            can::Input::Sent(frame) => self.sent(now, frame),
            can::Input::BusOff => self.bus_off(now, app),
            can::Input::Recovered => self.recovered(),
            can::Input::Detached => self.fall_silent(now, Fault::Detached, app),
            can::Input::Attached => self.attached(),
        }
        self.look_for_changes(now, app);
    }

    fn frame<A: Application>(&mut self, now: Instant, frame: &Frame, app: &mut A) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        if !self.filter().accepts(bits) || frame.is_remote() {
            return;
        }
        let message = (bits & 7) as u8;
        if message == DUPLICATE_MAC_CHECK {
            if self.network.heard(frame.data()) == Some(Change::Duplicate) {
                self.fall_silent(now, Fault::DuplicateMac, app);
            }
            return;
        }
        let restarting = matches!(self.restart, Restart::Answering | Restart::Due);
        if !self.network.is_on_line() || restarting {
            return;
        }
        match message {
            POLL_COMMAND => self.poll_command(now, frame.data(), app),
            CHANGE_ACKNOWLEDGE => self.change_acknowledge(now, frame.data()),
            EXPLICIT_REQUEST => self.explicit_request(now, frame.data(), app),
            UNCONNECTED_REQUEST => self.unconnected_request(now, frame.data(), app),
            _ => {}
        }
    }

    fn sent(&mut self, now: Instant, frame: &Frame) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        if bits == group_1(CHANGE_OF_STATE_MESSAGE, self.mac) {
            if let Some(production) = &mut self.production {
                production.sent(now, self.acknowledge_handler);
            }
        } else if bits == group_2(self.mac, EXPLICIT_RESPONSE) {
            self.messages.sent(now, frame);
            // The reset of a connection is answered alike; while ours is still owed, it is not this.
            let answer = !self.messages.is_owed()
                && matches!(*frame.data(), [_, service] if service == Service::RESET.response());
            if self.restart == Restart::Answering && answer {
                self.restart = Restart::Due;
            }
        } else {
            self.network.sent(now, bits);
        }
    }

    /// The controller has left the bus: all connections are gone, and the node stays silent until
    /// it recovers and BOI lets it.
    fn bus_off<A: Application>(&mut self, now: Instant, app: &mut A) {
        self.bus_off_counter = self.bus_off_counter.saturating_add(1);
        self.fall_silent(now, Fault::BusOff, app);
    }

    /// With bus-off interrupt 1 the node checks its MAC ID anew. Other faults outlast a recovery.
    fn recovered(&mut self) {
        if self.settings.bus_off_interrupt && self.network.faulted() == Some(Fault::BusOff) {
            self.network = DuplicateMacCheck::begin(self.mac);
        }
    }

    /// A node whose plug is in again starts as at power-up, whatever BOI says: nobody on the network
    /// knows it any more, and its address may be taken. A duplicate MAC ID stays one.
    fn attached(&mut self) {
        if self.network.faulted() == Some(Fault::Detached) {
            self.network = DuplicateMacCheck::begin(self.mac);
        }
    }

    /// Red and silent; all connections are gone. A reset that was accepted and not carried out is
    /// off: only a power cycle ends a fault.
    fn fall_silent<A: Application>(&mut self, now: Instant, fault: Fault, app: &mut A) {
        if self.restart != Restart::Due {
            self.restart = Restart::No;
        }
        self.network.fault(fault);
        self.forget_master();
        self.messages = Messages::new();
        self.heartbeat_owed = false;
        self.heartbeat_at = Deadline::NEVER;
        app.notice(now, Event::Faulted(fault));
    }

    /// Runs what fell due up to `now`.
    pub fn advance<A: Application>(&mut self, now: Instant, app: &mut A) {
        if self.network.advance(now) == Some(Change::OnLine) {
            self.restart_heartbeat(now);
            app.notice(now, Event::OnLine);
        }
        if self.poll.as_ref().is_some_and(|io| io.connection.is_inactive(now)) {
            self.io_timed_out(now, POLL, app);
        }
        let inactive = |production: &Production| production.io.connection.is_inactive(now);
        if self.production.as_ref().is_some_and(inactive) {
            self.io_timed_out(now, CHANGE_OF_STATE, app);
        }
        if self.explicit.as_ref().is_some_and(|connection| connection.is_inactive(now)) {
            self.explicit_timed_out(now, app);
        }
        if self.messages.advance(now) {
            app.notice(now, Event::ResponseGivenUp);
        }
        if self.heartbeat_at.is_due(now) {
            self.heartbeat_owed = true;
            self.restart_heartbeat(now);
        }
        self.look_for_changes(now, app);
    }

    /// Asks the device whether its data have changed, where a change of state connection wants to
    /// know, and decides what is to be produced.
    fn look_for_changes<A: Application>(&mut self, now: Instant, app: &mut A) {
        let Some(production) = &mut self.production else { return };
        if production.watches() && app.has_changed(production.io.path.assembly) {
            production.changed();
        }
        production.advance(now, self.acknowledge_handler);
    }

    fn poll_command<A: Application>(&mut self, now: Instant, data: &[u8], app: &mut A) {
        let Some(io) = self.poll.as_mut().filter(|io| io.connection.is_established()) else {
            return;
        };
        // The consumed size is 0: what is longer is not for us and must not keep us alive.
        if !data.is_empty() {
            let length = data.len() as u8;
            app.notice(now, Event::PollTooLong { length });
            return;
        }
        io.connection.arm(now);
        io.owed = true;
    }

    /// The master's acknowledge of a change of state or cyclic production: an empty frame.
    fn change_acknowledge(&mut self, now: Instant, data: &[u8]) {
        if let Some(production) = &mut self.production
            && production.io.connection.is_established()
            && production.acknowledged
            && data.is_empty()
        {
            production.acknowledge(now);
        }
    }

    fn explicit_request<A: Application>(&mut self, now: Instant, data: &[u8], app: &mut A) {
        let [first, rest @ ..] = data else { return };
        let header = Header(*first);
        if self.master != Some(header.mac()) || rest.is_empty() {
            return;
        }
        let Some(connection) = &mut self.explicit else { return };
        connection.state = State::Established;
        connection.arm(now);
        if !header.fragmented() {
            self.messages.unfragmented();
            self.request(now, header, rest, app);
        } else if let [octet, octets @ ..] = rest
            && let Some((body, length)) = self.messages.fragment(header, *octet, octets)
        {
            self.request(now, header, body.get(..length).unwrap_or(&body), app);
            if self.explicit.is_none() {
                // The request released its own connection; its last fragment arrived all the same.
                self.messages.acknowledge(header, *octet);
            }
        }
    }

    /// Ends a service that was answered with [`Done::Later`](crate::Done::Later). When its
    /// connection is gone nobody is told. Ask [`transmit`](Self::transmit) afterwards.
    pub fn complete(&mut self, result: Result<(), Error>) {
        if self.restart == Restart::Writing {
            self.restart = match result {
                Ok(()) if self.messages.is_pending() => Restart::Answering,
                Ok(()) => Restart::Due,
                Err(_) => Restart::No,
            };
        }
        self.messages.complete(result);
    }

    /// Whether the device shall cycle its power now: a reset of the Identity object was answered.
    #[must_use]
    pub const fn power_cycle_due(&self) -> bool {
        matches!(self.restart, Restart::Due)
    }

    /// Asks `app` for a production and builds the frame, lowest identifier first.
    pub fn transmit<A: Application>(&mut self, now: Instant, app: &mut A) -> Option<Frame> {
        // A node that is not on-line has no connections, so these two are never owed there.
        if let Some(production) = &mut self.production
            && production.io.owed
        {
            let assembly = production.io.path.assembly;
            production.produced(now);
            let frame = produce(now, CHANGE_OF_STATE_MESSAGE, self.mac, assembly, app);
            app.change_produced(assembly);
            return Some(frame);
        }
        if let Some(io) = &mut self.poll
            && io.owed
        {
            io.owed = false;
            return Some(produce(now, POLL_RESPONSE, self.mac, io.path.assembly, app));
        }
        if !self.network.is_on_line() {
            let identity = app.identity();
            return self.network.transmit(identity.vendor, identity.serial);
        }
        if self.restart == Restart::Due {
            return None;
        }
        let identifier = group_2(self.mac, EXPLICIT_RESPONSE);
        if let Some(frame) = self.messages.transmit(now, identifier) {
            return Some(frame);
        }
        if self.heartbeat_owed {
            self.heartbeat_owed = false;
            return Some(self.heartbeat(identifier, app));
        }
        let identity = app.identity();
        self.network.transmit(identity.vendor, identity.serial)
    }

    /// The Device Heartbeat Message: `[MAC] [CD] [instance u16] [state] [flags] [CCV u16]`.
    fn heartbeat<A: Application>(&self, identifier: u16, app: &A) -> Frame {
        /// Response bit and service 4Dh.
        const HEARTBEAT: u8 = 0xCD;
        /// Flags bit 1: a fault that the status word names (decision; the others stay 0).
        const SYSTEM_FAULT: u8 = 1 << 1;
        const FAULTS: u16 = 0x0F00;
        let flags = if app.status() & FAULTS != 0 { SYSTEM_FAULT } else { 0 };
        let [low, high] = app.configuration_consistency().to_le_bytes();
        let state = objects::OPERATIONAL;
        Frame::standard(identifier, &[self.mac.value(), HEARTBEAT, 1, 0, state, flags, low, high])
    }

    /// The heartbeat interval begins anew.
    fn restart_heartbeat(&mut self, now: Instant) {
        self.heartbeat_at = match self.settings.heartbeat_interval {
            0 => Deadline::NEVER,
            seconds => Deadline::at(now + Duration::from_secs(u64::from(seconds))),
        };
    }

    /// When [`advance`](Self::advance) must run.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        let explicit = self.explicit.as_ref().map_or(Deadline::NEVER, Connection::deadline);
        let poll = self.poll.as_ref().map_or(Deadline::NEVER, |io| io.connection.deadline());
        let production = self.production.as_ref().map_or(Deadline::NEVER, Production::deadline);
        let own = self.network.deadline().min(self.messages.deadline()).min(self.heartbeat_at);
        own.min(explicit).min(poll).min(production).instant()
    }
}

/// The frame of group 1 that carries `assembly` as of now.
#[inline]
fn produce<A: Application>(
    now: Instant,
    message: u8,
    mac: MacId,
    assembly: u8,
    app: &mut A,
) -> Frame {
    let mut octets = [0; 8];
    let size = app.produce(now, assembly, &mut octets);
    Frame::of_octets(group_1(message, mac), octets, size)
}

/// A refusal without an additional code.
const fn refuse(general: GeneralStatus) -> Error {
    Error { general, additional: 0xFF }
}

/// Refuses data that are shorter or longer than `length` octets.
const fn expect_length(data: &[u8], length: usize) -> Result<(), Error> {
    if data.len() < length {
        Err(refuse(GeneralStatus::NOT_ENOUGH_DATA))
    } else if data.len() > length {
        Err(refuse(GeneralStatus::TOO_MUCH_DATA))
    } else {
        Ok(())
    }
}
