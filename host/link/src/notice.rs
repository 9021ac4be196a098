//! What a port has to tell people.

use std::fmt;
use std::net::SocketAddr;

use codewheel_station::can::{BitRate, Frame};
use codewheel_station::rs485::BaudRate;

/// Something on a port that people may want to hear of; its text is one sentence without a full
/// stop. No notice stops the port.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Notice {
    /// A client connected to us. With SLCAN its channel is still closed; on an RS-485 line it hears
    /// and is heard from now on.
    ClientConnected {
        /// Where the client is.
        client: SocketAddr,
    },
    /// A client opened its channel and sees the bus from now on; told for its first few openings.
    ClientOpened {
        /// Where the client is.
        client: SocketAddr,
        /// Whether it can only listen (`L` instead of `O`).
        listen_only: bool,
    },
    /// A client chose another bit rate than the segment has. A segment made of software has no bit
    /// time, so it takes part all the same; on copper it would destroy every frame.
    OtherBitRate {
        /// Where the client is: its address, or `at` the path of a pty.
        client: String,
        /// What it chose, in bits per second.
        chosen: u32,
        /// What the segment has.
        segment: BitRate,
    },
    /// A client is gone.
    ClientLeft {
        /// Where it was.
        client: SocketAddr,
        /// How many frames it did not fetch in time and lost.
        frames_lost: u64,
    },
    /// A client of an RS-485 line is gone that did not fetch everything in time.
    ClientLeftShort {
        /// Where it was.
        client: SocketAddr,
        /// How many octets it lost.
        octets_lost: u64,
    },
    /// A client was turned away because there are too many already.
    ClientTurnedAway {
        /// Where it is.
        client: SocketAddr,
        /// How many are served at once.
        limit: usize,
    },
    /// A connection could not be taken up.
    ClientNotAccepted {
        /// What the system said.
        reason: String,
    },
    /// A client reads too slowly and has begun to lose what is oldest; told once per client.
    ClientTooSlow {
        /// Where it is.
        client: SocketAddr,
    },
    /// This port was not asked for too long and lost the oldest frames.
    FramesLost {
        /// How many since the last such notice.
        count: u64,
    },
    /// The adapter refused a command while it was set up, and stays as it was.
    CommandRefused {
        /// The command, such as `S4`.
        command: String,
    },
    /// The adapter refused a frame; it is handed over once more. Told once until the adapter takes
    /// a frame again.
    FrameRefused {
        /// The frame.
        frame: Frame,
    },
    /// The adapter refused a frame twice; it is given up and counts as sent, so that nobody waits
    /// for it for ever. Told once until the adapter takes a frame again.
    FrameGivenUp {
        /// The frame.
        frame: Frame,
    },
    /// The adapter used to confirm frames and stopped; from now on a time-out stands in for it.
    AdapterSilent,
    /// The adapter sent lines that are no SLCAN; told once per port.
    AdapterGarbled,
    /// The other side of an RS-485 line does not read what is sent, and what it has not read is
    /// thrown away; told once per port.
    LineUnread,
    /// A serial port took another rate than it was told.
    RateNotTaken {
        /// The rate it was told.
        asked: BaudRate,
        /// What it has now, in bits per second.
        taken: u32,
    },
    /// A serial port did not take characters of eight bits with even parity and one stop bit. What
    /// it brings is taken all the same; parity errors pass unseen. A pty is such a port.
    ParityNotTaken,
    /// A serial port cannot switch the transmitter of an RS-485 driver itself. Adapters that do it
    /// in hardware, as those for USB do, need nothing more.
    TransmitterNotSwitched {
        /// What the system said.
        reason: String,
    },
    /// A serial port talks to an SLCAN adapter at another speed than it was told.
    SpeedNotTaken {
        /// The speed it was told, in bits per second.
        asked: u32,
        /// What it has now.
        taken: u32,
    },
    /// What leads to the bus is gone. The port tries to get it back, and has nothing until then.
    BusLost {
        /// The bus as a URI.
        bus: String,
        /// What the system said, or that the other side closed it.
        reason: String,
    },
    /// What leads to the bus cannot be had yet; told when the reason changes.
    BusStillLost {
        /// What was tried, what came back and what to do.
        reason: String,
    },
    /// The port has its bus again.
    BusBack {
        /// The bus as a URI.
        bus: String,
    },
    /// A CAN controller changed its state by the count of its errors; bus-off is told by the
    /// station that it concerns.
    ControllerState {
        /// The interface.
        interface: String,
        /// What its controller says of itself.
        state: ControllerState,
    },
    /// A CAN controller is bus-off, and the interface does not restart it by itself.
    ControllerStaysOff {
        /// The interface.
        interface: String,
    },
    /// A CAN controller or its driver had no room for frames that arrived, and lost them; told once
    /// until the port was quiet.
    ControllerOverrun {
        /// The interface.
        interface: String,
    },
    /// A CAN interface does not tell its bit rate, so nobody knows whether it is that of the bus.
    BitRateUnknown {
        /// The interface.
        interface: String,
        /// The rate that the bus is to have.
        wanted: BitRate,
    },
    /// A USB adapter collects octets for some time before it hands them over.
    AdapterHoldsBack {
        /// For how long, in milliseconds.
        milliseconds: u16,
    },
}

/// What a CAN controller says of itself, by the count of its errors (ISO 11898-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerState {
    /// Few errors: it takes part.
    Active,
    /// A count of errors reached 96.
    Warning,
    /// A count of errors reached 128: it signals errors passively, and waits longer between frames.
    Passive,
}

impl Notice {
    /// Whether something went wrong, or is right again, rather than a client coming or going.
    #[must_use]
    pub const fn is_trouble(&self) -> bool {
        !matches!(
            self,
            Self::ClientConnected { .. }
                | Self::ClientOpened { .. }
                | Self::ClientLeft { frames_lost: 0, .. }
                | Self::TransmitterNotSwitched { .. }
        )
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ClientConnected { client } => write!(f, "client {client} connected"),
            Self::ClientOpened { client, listen_only: false } => {
                write!(f, "client {client} opened its channel")
            }
            Self::ClientOpened { client, listen_only: true } => {
                write!(f, "client {client} opened its channel to listen only")
            }
            Self::OtherBitRate { client, chosen, segment } => write!(
                f,
                "client {client} chose {chosen} bit/s where the segment has {}: it takes part \
                 here, on copper it would be a bus of errors",
                segment.bits_per_second()
            ),
            Self::ClientLeft { client, frames_lost: 0 } => write!(f, "client {client} left"),
            Self::ClientLeft { client, frames_lost } => {
                write!(f, "client {client} left; it had lost {frames_lost} frames")
            }
            Self::ClientLeftShort { client, octets_lost } => {
                write!(f, "client {client} left; it had lost {octets_lost} octets")
            }
            Self::ClientTurnedAway { client, limit } => {
                write!(f, "client {client} was turned away: {limit} clients are served at once")
            }
            Self::ClientNotAccepted { reason } => {
                write!(f, "a client could not be let in: {reason}")
            }
            Self::ClientTooSlow { client } => {
                write!(f, "client {client} does not read fast enough and loses what is oldest")
            }
            Self::FramesLost { count } => {
                write!(f, "{count} received frames were lost: the station was not driven in time")
            }
            Self::CommandRefused { command } => {
                write!(f, "the adapter refused {command} and keeps the setting it has")
            }
            Self::FrameRefused { frame } => {
                write!(f, "the adapter refused the frame {frame}; it is tried once more")
            }
            Self::FrameGivenUp { frame } => {
                write!(f, "the adapter refused the frame {frame} again; it is given up")
            }
            Self::AdapterSilent => {
                f.write_str("the adapter stopped confirming frames; a time-out stands in")
            }
            Self::AdapterGarbled => f.write_str("the adapter sends lines that are no SLCAN"),
            Self::LineUnread => f.write_str(
                "the other side does not read what is sent; what it has not read is thrown away",
            ),
            Self::RateNotTaken { asked, taken } => write!(
                f,
                "the serial port runs at {taken} bit/s where the line has {}: another adapter is \
                 needed for this rate",
                asked.bits_per_second()
            ),
            Self::ParityNotTaken => f.write_str(
                "the serial port does not take even parity; broken characters pass unseen (a pty is \
                 such a port)",
            ),
            Self::TransmitterNotSwitched { reason } => write!(
                f,
                "the serial port has no RS-485 mode ({reason}): the adapter must switch its \
                 transmitter itself"
            ),
            Self::SpeedNotTaken { asked, taken } => write!(
                f,
                "the serial port talks at {taken} bit/s where the adapter was to have {asked}: \
                 write its speed behind the path, as in slcan:/dev/ttyUSB0@57600"
            ),
            Self::BusLost { bus, reason } => {
                write!(f, "{bus} was lost: {reason}; it is tried until it is back")
            }
            Self::BusStillLost { reason } => write!(f, "not back yet: {reason}"),
            Self::BusBack { bus } => write!(f, "{bus} is back"),
            Self::ControllerState { interface, state } => match state {
                ControllerState::Active => write!(f, "the controller of {interface} has recovered"),
                ControllerState::Warning => write!(
                    f,
                    "the controller of {interface} counts many errors: check bit rate, termination \
                     and wiring"
                ),
                ControllerState::Passive => write!(
                    f,
                    "the controller of {interface} is error passive: nobody acknowledges, or check \
                     bit rate, termination and wiring"
                ),
            },
            Self::ControllerStaysOff { interface } => write!(
                f,
                "the controller of {interface} is bus-off and stays so; type: sudo ip link set \
                 {interface} type can restart"
            ),
            Self::ControllerOverrun { interface } => {
                write!(f, "the controller of {interface} had no room for frames and lost some")
            }
            Self::BitRateUnknown { interface, wanted } => write!(
                f,
                "{interface} does not tell its bit rate: make sure that it is {}",
                wanted.bits_per_second()
            ),
            Self::AdapterHoldsBack { milliseconds } => write!(
                f,
                "the adapter holds octets back for up to {milliseconds} ms, too long for most \
                 masters: run setserial PORT low_latency"
            ),
        }
    }
}
