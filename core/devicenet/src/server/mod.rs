//! A Group 2 Only Server with the predefined master/slave connection set.
//!
//! [`Server`] holds everything that is DeviceNet and nothing that is the device; the device is an
//! [`Application`], lent for one call at a time. What is owed to the wire is kept as flags and
//! built when the wire can take it, so a poll answered late is answered once, with the newest data.

mod allocation;
pub use allocation::choice;
mod connection_object;
mod objects;
mod router;

use codewheel_station::can::{self, BitRate, Filter, Frame};
use codewheel_station::{Deadline, Instant};

use crate::connection::{Connection, EXPLICIT, POLL, State};
use crate::duplicate::Change;
use crate::explicit::{Error, GeneralStatus, Header, Service};
use crate::fragment::{
    Fragment, Kind, Piece, Reassembly, Received, STATUS_OK, STATUS_TOO_MUCH_DATA, Sending,
};
use crate::identifier::{
    DUPLICATE_MAC_CHECK, EXPLICIT_REQUEST, EXPLICIT_RESPONSE, POLL_COMMAND, POLL_RESPONSE,
    UNCONNECTED_REQUEST, group_1, group_2,
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

/// A service that is answered once the device has done it.
#[derive(Clone, Copy, Debug)]
struct Pending {
    header: Header,
    service: Service,
    result: Option<Result<(), Error>>,
}

/// How far a reset by the Identity object has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Restart {
    No,
    /// The answer is not on the wire yet.
    Answering,
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
    /// The fragmented request on its way in, and the header of its fragments.
    request: Reassembly<REQUEST_OCTETS>,
    /// The response on its way out.
    response: [u8; RESPONSE_OCTETS],
    response_header: Header,
    sending: Sending,
    /// A fragment to be acknowledged: its header, count and status.
    acknowledge: Option<(Header, u8, u8)>,
    /// The response to an unconnected request: at most header and three octets.
    unconnected: Option<(Header, [u8; 3], u8)>,
    pending: Option<Pending>,
    restart: Restart,
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
            request: Reassembly::new(),
            response: [0; RESPONSE_OCTETS],
            response_header: Header(0),
            sending: Sending::IDLE,
            acknowledge: None,
            unconnected: None,
            pending: None,
            restart: Restart::No,
        }
    }

    /// A server that stays off the bus: the address switches give no MAC ID.
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
            POLL => self.poll.as_ref().map(|io| io.connection.state),
            _ => None,
        }
    }

    /// What the lamp shows.
    #[must_use]
    pub fn status(&self) -> NetworkStatus {
        if let Some(fault) = self.network.faulted() {
            NetworkStatus::Faulted(fault)
        } else if !self.network.is_on_line() {
            NetworkStatus::NotOnLine
        } else if self.poll.as_ref().is_some_and(|io| io.connection.state == State::TimedOut) {
            NetworkStatus::TimedOut
        } else if self.explicit.is_some() || self.io_is_established() {
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
            can::Input::Recovered => {}
        }
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
        if !self.network.is_on_line() {
            return;
        }
        match message {
            POLL_COMMAND => self.poll_command(now, frame.data(), app),
            EXPLICIT_REQUEST => self.explicit_request(now, frame.data(), app),
            UNCONNECTED_REQUEST => self.unconnected_request(now, frame.data(), app),
            _ => {}
        }
    }

    fn sent(&mut self, now: Instant, frame: &Frame) {
        let can::Identifier::Standard(bits) = frame.identifier() else { return };
        self.network.sent(now, bits);
        if bits == group_2(self.mac, EXPLICIT_RESPONSE) {
            self.sending.sent(now);
            let answered = self.sending.is_idle() && self.pending.is_none();
            if self.restart == Restart::Answering && answered {
                self.restart = Restart::Due;
            }
        }
    }

    fn bus_off<A: Application>(&mut self, now: Instant, app: &mut A) {
        self.bus_off_counter = self.bus_off_counter.saturating_add(1);
        self.fall_silent(now, Fault::BusOff, app);
    }

    /// Red, silent, until the next power cycle; all connections are gone.
    fn fall_silent<A: Application>(&mut self, now: Instant, fault: Fault, app: &mut A) {
        self.network.fault(fault);
        self.forget_master();
        app.notice(now, Event::Faulted(fault));
    }

    /// Runs what fell due up to `now`.
    pub fn advance<A: Application>(&mut self, now: Instant, app: &mut A) {
        if self.network.advance(now) == Some(Change::OnLine) {
            app.notice(now, Event::OnLine);
        }
        if self.poll.as_ref().is_some_and(|io| io.connection.is_inactive(now)) {
            self.poll_timed_out(now, app);
        }
        if self.explicit.as_ref().is_some_and(|connection| connection.is_inactive(now)) {
            self.explicit_timed_out(now, app);
        }
        if self.sending.advance(now) {
            app.notice(now, Event::ResponseGivenUp);
        }
    }

    fn poll_timed_out<A: Application>(&mut self, now: Instant, app: &mut A) {
        let Some(io) = &mut self.poll else { return };
        app.notice(now, Event::TimedOut { instance: POLL });
        match io.connection.watchdog_action {
            Connection::AUTO_RESET => io.connection.arm(now),
            Connection::AUTO_DELETE => self.poll = None,
            _ => {
                io.connection.state = State::TimedOut;
                io.connection.disarm();
                io.owed = false;
            }
        }
        self.settle_ownership(now, app);
    }

    fn explicit_timed_out<A: Application>(&mut self, now: Instant, app: &mut A) {
        let lives_on = self.io_is_established();
        let Some(connection) = &mut self.explicit else { return };
        app.notice(now, Event::TimedOut { instance: EXPLICIT });
        if connection.watchdog_action == Connection::DEFERRED_DELETE && lives_on {
            connection.state = State::DeferredDelete;
            connection.disarm();
        } else {
            self.end_explicit();
            self.settle_ownership(now, app);
        }
    }

    fn io_is_established(&self) -> bool {
        self.poll.as_ref().is_some_and(|io| io.connection.is_established())
    }

    fn end_explicit(&mut self) {
        self.explicit = None;
        self.request.clear();
        self.sending.stop();
        self.acknowledge = None;
        if self.pending.take().is_none() && self.restart == Restart::Answering {
            // Nobody is left to read the answer; the reset itself was accepted.
            self.restart = Restart::Due;
        }
    }

    /// Forgets the master when it holds neither the explicit nor an established I/O connection, so
    /// that one that dies in mid-configuration never locks others out.
    fn settle_ownership<A: Application>(&mut self, now: Instant, app: &mut A) {
        if self.master.is_none() || self.io_is_established() {
            return;
        }
        let explicit_lives =
            self.explicit.as_ref().is_some_and(|connection| connection.is_established());
        if !explicit_lives {
            self.forget_master();
            app.notice(now, Event::Forgotten);
        }
    }

    fn forget_master(&mut self) {
        self.end_explicit();
        self.poll = None;
        self.master = None;
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

    fn explicit_request<A: Application>(&mut self, now: Instant, data: &[u8], app: &mut A) {
        let Some((&first, rest)) = data.split_first() else { return };
        let header = Header(first);
        if self.master != Some(header.mac()) || rest.is_empty() {
            return;
        }
        let Some(connection) = &mut self.explicit else { return };
        if header.fragmented() && rest.len() < 2 {
            // A fragmentation octet with nothing behind it is no fragment.
            return;
        }
        connection.state = State::Established;
        connection.arm(now);
        if !header.fragmented() {
            self.request.clear();
            self.request(now, header, rest, app);
            return;
        }
        let Some((&second, octets)) = rest.split_first() else { return };
        let fragment = Fragment::from_octet(second);
        if fragment.kind == Kind::Acknowledge {
            if let Some(&status) = octets.first() {
                self.sending.acknowledged(fragment.count, status);
            }
            return;
        }
        match self.request.push(fragment, octets) {
            Received::Dropped => {}
            Received::Taken => self.acknowledge = Some((header, fragment.count, STATUS_OK)),
            Received::TooMuch => {
                self.acknowledge = Some((header, fragment.count, STATUS_TOO_MUCH_DATA));
            }
            Received::Complete => {
                self.acknowledge = Some((header, fragment.count, STATUS_OK));
                let mut body = [0; REQUEST_OCTETS];
                let length = self.request.body().len();
                for (to, from) in body.iter_mut().zip(self.request.body()) {
                    *to = *from;
                }
                let body = body.get(..length).unwrap_or_default();
                self.request(now, header.with_fragmented(false), body, app);
            }
        }
    }

    /// Ends a service that was answered with [`Done::Later`](crate::Done::Later). Without one
    /// pending, or when its connection is gone, nothing happens. Ask
    /// [`transmit`](Self::transmit) afterwards.
    pub fn complete(&mut self, result: Result<(), Error>) {
        if self.restart == Restart::Answering && result.is_err() {
            self.restart = Restart::No;
        }
        if let Some(pending) = &mut self.pending {
            pending.result = Some(result);
        } else if self.restart == Restart::Answering {
            self.restart = Restart::Due;
        }
    }

    /// Whether the device shall cycle its power now: a reset of the Identity object was answered.
    #[must_use]
    pub const fn power_cycle_due(&self) -> bool {
        matches!(self.restart, Restart::Due)
    }

    /// Asks `app` for a production and builds the frame, lowest identifier first.
    pub fn transmit<A: Application>(&mut self, now: Instant, app: &mut A) -> Option<Frame> {
        if let Some(io) = &mut self.poll
            && io.owed
        {
            io.owed = false;
            let mut octets = [0; 8];
            let size = app.produce(now, io.path.assembly, &mut octets);
            let identifier = group_1(POLL_RESPONSE, self.mac);
            return Some(Frame::standard(identifier, octets.get(..size).unwrap_or(&octets)));
        }
        self.explicit_frame(now).or_else(|| {
            let identity = app.identity();
            self.network.transmit(identity.vendor, identity.serial)
        })
    }

    fn explicit_frame(&mut self, now: Instant) -> Option<Frame> {
        let identifier = group_2(self.mac, EXPLICIT_RESPONSE);
        let mut octets = [0; 8];
        if let Some((header, body, length)) = self.unconnected.take() {
            let [first, rest @ ..] = &mut octets;
            *first = header.with_fragmented(false).0;
            for (to, from) in rest.iter_mut().zip(body) {
                *to = from;
            }
            let end = usize::from(length) + 1;
            return Some(Frame::standard(identifier, octets.get(..end).unwrap_or(&octets)));
        }
        if let Some((header, count, status)) = self.acknowledge.take() {
            let fragment = Fragment { kind: Kind::Acknowledge, count };
            let header = header.with_fragmented(true).0;
            return Some(Frame::standard(identifier, &[header, fragment.to_octet(), status]));
        }
        if self.sending.is_idle()
            && let Some(Pending { header, service, result: Some(result) }) = self.pending
        {
            self.pending = None;
            self.respond(header, service, result.map(|()| 0));
        }
        if !self.sending.is_owed() {
            return None;
        }
        let [first, rest @ ..] = &mut octets;
        let (end, piece) = match self.sending.next(now, &self.response)? {
            Piece::Whole(octets) => {
                *first = self.response_header.with_fragmented(false).0;
                (1, octets)
            }
            Piece::Fragment(fragment, octets) => {
                *first = self.response_header.with_fragmented(true).0;
                let [second, ..] = rest;
                *second = fragment.to_octet();
                (2, octets)
            }
        };
        for (to, from) in octets.iter_mut().skip(end).zip(piece) {
            *to = *from;
        }
        Some(Frame::standard(identifier, octets.get(..end + piece.len()).unwrap_or(&octets)))
    }

    /// Begins to send a response. `written` octets of data already stand behind the service octet
    /// in the response buffer.
    fn respond(&mut self, header: Header, service: Service, result: Result<usize, Error>) {
        let [first, second, third, ..] = &mut self.response;
        let length = match result {
            Ok(written) => {
                *first = service.response();
                written + 1
            }
            Err(error) => {
                *first = Service::ERROR.response();
                *second = error.general.0;
                *third = error.additional;
                3
            }
        };
        self.response_header = header;
        self.sending.begin(length as u16);
    }

    /// When [`advance`](Self::advance) must run.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        let explicit = self.explicit.as_ref().map_or(Deadline::NEVER, Connection::deadline);
        let poll = self.poll.as_ref().map_or(Deadline::NEVER, |io| io.connection.deadline());
        let own = self.network.deadline().min(self.sending.deadline());
        own.min(explicit).min(poll).instant()
    }
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
