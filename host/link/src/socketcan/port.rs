//! The port to a CAN interface.

use std::collections::VecDeque;
use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::os::fd::AsRawFd;
use std::time::{Duration, Instant};

use codewheel_station::can::{BitRate, Frame};
use mio::unix::SourceFd;
use mio::{Interest, Token};
use rustix::io::Errno;
use rustix::net::{RecvAncillaryBuffer, RecvFlags, recvmsg, sockopt};
use socketcan::{CanSocket, Socket, SocketOptions};

use super::frame::{ERRORS, LENGTH, Report, Said, decode, encode};
use super::netlink::{Interface, look_up};
use crate::error::phrase;
use crate::socket::{Limit, Watch};
use crate::{CanPort, ControllerState, InterfaceTrouble, LinkError, Notice, Received, Waker};

const SOCKET: Token = Token(1);

/// `MSG_CONFIRM`: what was received is what this socket sent (Linux,
/// Documentation/networking/can.rst).
const CONFIRM: u32 = 0x800;

/// How long a frame may be on its way before the next may follow: one whose report was lost for want
/// of room must not be the last.
const ON_ITS_WAY: Duration = Duration::from_secs(1);

/// When a full queue of the interface is tried again.
const FULL_PAUSE: Duration = Duration::from_millis(5);

/// Octets that wait for a station that is not driven: as many as every user may have, and some 500
/// frames.
const RECEIVE_BUFFER: usize = 212_992;

/// How far a bit rate may be from what was asked for, in percent: drivers tell what their clock
/// gives.
const RATE_TOLERANCE: u32 = 1;

/// Joins the bus of `interface`, which must be up and have the bit rate `rate`.
pub(crate) fn open(interface: &str, rate: BitRate) -> Result<InterfacePort, LinkError> {
    let failed = |trouble| LinkError::Interface { interface: interface.to_owned(), trouble };
    let system = |reason| failed(InterfaceTrouble::System(reason));
    let found = look_up(interface).map_err(|error| {
        failed(match error.raw_os_error() {
            Some(errno) if errno == Errno::NODEV.raw_os_error() => InterfaceTrouble::Missing,
            _ => InterfaceTrouble::System(error),
        })
    })?;
    judge(&found, rate).map_err(failed)?;
    let socket = CanSocket::open_iface(found.index).map_err(system)?;
    socket.set_nonblocking(true).map_err(system)?;
    socket.set_recv_own_msgs(true).map_err(system)?;
    socket.set_error_filter(ERRORS).map_err(system)?;
    sockopt::set_socket_recv_buffer_size(&socket, RECEIVE_BUFFER)
        .map_err(|error| system(error.into()))?;
    let watch = Watch::new()?;
    watch
        .registry()
        .register(&mut SourceFd(&socket.as_raw_fd()), SOCKET, Interest::READABLE)
        .map_err(LinkError::System)?;
    let mut port = InterfacePort {
        interface: interface.to_owned(),
        restarts: found.restarts,
        socket,
        watch,
        is_unread: true,
        on_its_way: None,
        full_until: None,
        state: ControllerState::Active,
        was_overrun: false,
        inbox: VecDeque::new(),
        end: None,
    };
    if !has_no_rate(&found) && found.bit_rate.is_none() {
        let interface = interface.to_owned();
        port.tell(Notice::BitRateUnknown { interface, wanted: rate });
    }
    Ok(port)
}

/// Whether it is made of software alone.
fn has_no_rate(interface: &Interface) -> bool {
    matches!(interface.kind.as_str(), "vcan" | "vxcan")
}

/// Whether `interface` can be used as it is.
fn judge(interface: &Interface, rate: BitRate) -> Result<(), InterfaceTrouble> {
    let asked = rate.bits_per_second();
    if !interface.is_can {
        return Err(InterfaceTrouble::NoCan);
    }
    if !interface.is_up {
        return Err(InterfaceTrouble::Down { rate: (!has_no_rate(interface)).then_some(rate) });
    }
    if let Some(actual) = interface.bit_rate
        && actual.abs_diff(asked) > asked / 100 * RATE_TOLERANCE
    {
        return Err(InterfaceTrouble::OtherBitRate { asked: rate, actual });
    }
    if interface.listens_only {
        return Err(InterfaceTrouble::ListensOnly { rate });
    }
    if interface.is_bus_off && !interface.restarts {
        return Err(InterfaceTrouble::BusOff);
    }
    Ok(())
}

/// A socket on a CAN interface.
///
/// The controller reports each frame that another node acknowledged. Until then one frame is on its
/// way, so that the next is built when it can go.
#[derive(Debug)]
pub(crate) struct InterfacePort {
    interface: String,
    /// Whether the controller restarts by itself after a bus-off.
    restarts: bool,
    socket: CanSocket,
    watch: Watch,
    /// The socket may hold more: it tells once, and not again before it was read to its end.
    is_unread: bool,
    /// When the frame was handed over that is on its way.
    on_its_way: Option<Instant>,
    /// Until then the queue of the interface counts as full.
    full_until: Option<Instant>,
    state: ControllerState,
    /// Whether an overrun was told since the socket was last read to its end.
    was_overrun: bool,
    inbox: VecDeque<Received>,
    /// Why there is nothing more to be had.
    end: Option<String>,
}

impl InterfacePort {
    /// Reads one frame and takes it in.
    fn read(&mut self) {
        let mut buffer = [0; LENGTH];
        let received = recvmsg(
            &self.socket,
            &mut [IoSliceMut::new(&mut buffer)],
            &mut RecvAncillaryBuffer::default(),
            RecvFlags::empty(),
        );
        match received {
            Ok(received) => {
                let is_ours = received.flags.bits() & CONFIRM != 0;
                match buffer.get(..received.bytes).and_then(decode) {
                    Some(Said::Frame(frame)) if is_ours => {
                        self.on_its_way = None;
                        self.inbox.push_back(Received::Sent(frame));
                    }
                    Some(Said::Frame(frame)) => self.inbox.push_back(Received::Frame(frame)),
                    Some(Said::Controller(report)) => self.heed(report),
                    None => {}
                }
            }
            Err(Errno::AGAIN) => {
                self.is_unread = false;
                self.was_overrun = false;
            }
            Err(Errno::INTR) => {}
            Err(error) => self.lose(error),
        }
    }

    /// Takes in what the controller reports.
    fn heed(&mut self, report: Report) {
        if report.overrun && !self.was_overrun {
            self.was_overrun = true;
            let interface = self.interface.clone();
            self.tell(Notice::ControllerOverrun { interface });
        }
        if report.bus_off {
            self.on_its_way = None;
            self.state = ControllerState::Active;
            self.inbox.push_back(Received::BusOff);
            if !self.restarts {
                let interface = self.interface.clone();
                self.tell(Notice::ControllerStaysOff { interface });
            }
        } else if let Some(state) = report.state.filter(|state| *state != self.state) {
            self.state = state;
            let interface = self.interface.clone();
            self.tell(Notice::ControllerState { interface, state });
        }
        if report.restarted {
            self.inbox.push_back(Received::Recovered);
        }
    }

    fn lose(&mut self, error: Errno) {
        self.is_unread = false;
        let reason = match error {
            Errno::NETDOWN => "the interface went down".to_owned(),
            Errno::NODEV | Errno::NXIO => "the interface is gone".to_owned(),
            error => phrase(&io::Error::from(error)),
        };
        self.end.get_or_insert(reason);
    }

    fn lost(&self, reason: &str) -> LinkError {
        LinkError::Lost { bus: self.describe(), reason: reason.to_owned() }
    }

    fn tell(&mut self, notice: Notice) {
        self.inbox.push_back(Received::Notice(notice));
    }

    /// When a frame can be taken again without a report.
    fn ready_at(&self) -> Option<Instant> {
        let confirmed = self.on_its_way.map(|since| since + ON_ITS_WAY);
        confirmed.max(self.full_until)
    }
}

impl CanPort for InterfacePort {
    fn is_ready(&self) -> bool {
        self.end.is_none() && self.ready_at().is_none_or(|ready| ready <= Instant::now())
    }

    fn send(&mut self, frame: &Frame) -> Result<bool, LinkError> {
        if let Some(end) = &self.end {
            return Err(self.lost(end));
        }
        if !self.is_ready() {
            return Ok(false);
        }
        match rustix::io::write(&self.socket, &encode(frame)) {
            Ok(_) => {
                self.on_its_way = Some(Instant::now());
                self.full_until = None;
                Ok(true)
            }
            Err(Errno::AGAIN | Errno::NOBUFS | Errno::INTR) => {
                self.full_until = Some(Instant::now() + FULL_PAUSE);
                Ok(false)
            }
            // Reported by `receive`, after what had arrived.
            Err(error) => {
                self.lose(error);
                Ok(false)
            }
        }
    }

    fn receive(&mut self, wait: Option<Duration>) -> Result<Option<Received>, LinkError> {
        let limit = Limit::after(wait);
        let was_ready = self.is_ready();
        // To look is to read: asking whether there is something to read costs as much.
        self.is_unread |= wait == Some(Duration::ZERO) && self.end.is_none();
        loop {
            // First, so that a flood does not drown it.
            if self.watch.take_woken() {
                return Ok(Some(Received::Woken));
            }
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            if let Some(end) = &self.end {
                return Err(self.lost(end));
            }
            if self.is_unread {
                self.read();
                continue;
            }
            if limit.is_over() || (!was_ready && self.is_ready()) {
                return Ok(None);
            }
            let ready = self
                .ready_at()
                .filter(|_| !was_ready)
                .map(|ready| ready.saturating_duration_since(Instant::now()));
            let pause = match (limit.remaining(), ready) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
            self.watch.wait(pause)?;
            self.is_unread |= self.watch.changes().any(|change| change.readable);
        }
    }

    fn waker(&self) -> Waker {
        self.watch.waker()
    }

    fn confirms(&self) -> bool {
        true
    }

    fn local_address(&self) -> Option<SocketAddr> {
        None
    }

    fn describe(&self) -> String {
        format!("socketcan:{}", self.interface)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn up() -> Interface {
        Interface {
            index: 3,
            is_can: true,
            is_up: true,
            kind: "can".into(),
            ..Interface::default()
        }
    }

    #[test]
    fn an_interface_at_the_rate_of_the_bus_or_without_one_is_taken() {
        let rate = BitRate::Kbit125;
        for bit_rate in [None, Some(125_000), Some(124_999)] {
            assert!(judge(&Interface { bit_rate, ..up() }, rate).is_ok());
        }
        let restarting = Interface { is_bus_off: true, restarts: true, ..up() };
        assert!(judge(&restarting, rate).is_ok());
    }

    #[test]
    fn an_interface_that_cannot_be_used_is_refused_with_the_reason() {
        let judged = |interface| judge(&interface, BitRate::Kbit125).unwrap_err();
        assert!(matches!(judged(Interface { is_can: false, ..up() }), InterfaceTrouble::NoCan));
        assert!(matches!(
            judged(Interface { is_up: false, ..up() }),
            InterfaceTrouble::Down { rate: Some(BitRate::Kbit125) }
        ));
        assert!(matches!(
            judged(Interface { is_up: false, kind: "vcan".into(), ..up() }),
            InterfaceTrouble::Down { rate: None }
        ));
        assert!(matches!(
            judged(Interface { bit_rate: Some(500_000), ..up() }),
            InterfaceTrouble::OtherBitRate { actual: 500_000, .. }
        ));
        assert!(matches!(
            judged(Interface { listens_only: true, ..up() }),
            InterfaceTrouble::ListensOnly { .. }
        ));
        assert!(matches!(judged(Interface { is_bus_off: true, ..up() }), InterfaceTrouble::BusOff));
    }
}
