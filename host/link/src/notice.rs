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
    /// A client chose another bit rate than the segment has. A TCP segment has no bit time, so it
    /// takes part all the same; on copper it would destroy every frame.
    OtherBitRate {
        /// Where the client is.
        client: SocketAddr,
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
    /// A USB adapter collects octets for some time before it hands them over.
    AdapterHoldsBack {
        /// For how long, in milliseconds.
        milliseconds: u16,
    },
}

impl Notice {
    /// Whether something went wrong, rather than a client coming or going.
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
            Self::AdapterHoldsBack { milliseconds } => write!(
                f,
                "the adapter holds octets back for up to {milliseconds} ms, too long for most \
                 masters: run setserial PORT low_latency"
            ),
        }
    }
}
