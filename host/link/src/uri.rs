//! Names of buses, as people write them on a command line or in a file.

use std::fmt;
use std::net::Ipv6Addr;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use thiserror::Error;

/// The name of a bus: where the frames or octets go and how to get there.
///
/// Written and read as `virtual:NAME`; for CAN as `socketcan:INTERFACE`, `slcan:PATH`,
/// `slcan:PATH@SPEED`, `slcan:HOST:PORT`, `slcan-listen:HOST:PORT`, `slcan-listen:pty:PATH` or
/// `socketcand-listen:HOST:PORT`; for RS-485 as `rs485-listen:HOST:PORT`, `rs485-listen:pty:PATH`,
/// `rs485:HOST:PORT` or `rs485:PATH`. A path begins with `/` or `.`, as `/dev/ttyUSB0` and `./line`
/// do.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BusUri {
    /// `virtual:NAME`: a bus inside this process, shared by all who give the same name.
    Virtual(String),
    /// `socketcan:can0`: a CAN interface of this machine's Linux.
    SocketCan(String),
    /// `slcan-listen:HOST:PORT`: we play the SLCAN adapter that others connect to; port 0 takes
    /// any free one.
    SlcanListen(Endpoint),
    /// `slcan-listen:pty:PATH`: we play the SLCAN adapter, and PATH becomes the serial port at which
    /// a program on this machine finds it.
    SlcanListenPty(PathBuf),
    /// `slcan:HOST:PORT`: we connect to an SLCAN adapter; the port is 1 … 65535.
    Slcan(Endpoint),
    /// `slcan:/dev/ttyACM0`, `slcan:/dev/ttyUSB0@57600`: an SLCAN adapter at a serial port of this
    /// machine.
    SlcanDevice {
        /// The serial port.
        path: PathBuf,
        /// How fast adapter and computer talk, in bit/s; [`SLCAN_SPEED`](Self::SLCAN_SPEED) where
        /// the text says nothing. Adapters with a USB port of their own ignore it. It is none of the
        /// bit rate of the bus.
        speed: u32,
    },
    /// `socketcand-listen:HOST:PORT`: we play the socketcand server that others connect to; port 0
    /// takes any free one.
    SocketcandListen(Endpoint),
    /// `rs485-listen:HOST:PORT`: we are the line, as raw octets, that others connect to; port 0
    /// takes any free one.
    Rs485Listen(Endpoint),
    /// `rs485-listen:pty:PATH`: we are the line, and PATH becomes a serial port at which a program
    /// on this machine finds it.
    Rs485ListenPty(PathBuf),
    /// `rs485:HOST:PORT`: we connect to a line that passes raw octets; the port is 1 … 65535.
    Rs485(Endpoint),
    /// `rs485:/dev/ttyUSB0`: a serial port of this machine.
    Rs485Device(PathBuf),
}

/// What a bus carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Medium {
    /// CAN frames.
    Can,
    /// Octets of an RS-485 line.
    Rs485,
    /// Whatever its stations speak: a `virtual:` bus is what it is used as.
    Any,
}

/// A host and a TCP port: `localhost:4001`, `127.0.0.1:4001`, `[::1]:4001`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Endpoint {
    host: String,
    port: u16,
}

/// How a CAN segment is written.
const CAN_FORMS: &str = "socketcan:can0, slcan:/dev/tty…, slcan:HOST:PORT, slcan-listen:HOST:PORT, \
                         slcan-listen:pty:PATH or socketcand-listen:HOST:PORT for CAN";

/// How an RS-485 line is written.
const RS485_FORMS: &str = "rs485-listen:HOST:PORT, rs485-listen:pty:PATH, rs485:HOST:PORT or \
                           rs485:/dev/tty… for RS-485";

/// A text that names no bus; its message says what was given and which forms there are.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{given:?} names no bus{why}: write virtual:NAME, {CAN_FORMS}, {RS485_FORMS}, with an IPv6 host \
     in brackets"
)]
pub struct InvalidBusUri {
    given: String,
    why: &'static str,
}

impl Endpoint {
    /// The host name or address, an IPv6 address without its brackets.
    #[must_use]
    pub fn host(&self) -> &str {
        &self.host
    }

    /// The TCP port, 0 … 65535; 0 means any free port and is for listening only.
    #[must_use]
    pub const fn port(&self) -> u16 {
        self.port
    }

    fn parse(text: &str) -> Result<Self, &'static str> {
        let (host, port) = if let Some(rest) = text.strip_prefix('[') {
            let (host, port) = rest.split_once("]:").ok_or(" (\"[\" without \"]:PORT\")")?;
            host.parse::<Ipv6Addr>().map_err(|_| " (no IPv6 address between the brackets)")?;
            (host, port)
        } else {
            let (host, port) = text.rsplit_once(':').ok_or(" (the port is missing)")?;
            let spelled = |letter: char| letter.is_alphanumeric() || "-._".contains(letter);
            if host.is_empty() || !host.chars().all(spelled) {
                return Err(" (that is no host)");
            }
            (host, port)
        };
        // `u16::from_str` would also take a sign.
        if !port.bytes().all(|octet| octet.is_ascii_digit()) {
            return Err(" (the port is no number)");
        }
        let port = port.parse().map_err(|_| " (a port is a number from 0 to 65535)")?;
        Ok(Self { host: host.to_owned(), port })
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{}:{}", self.host, self.port)
        }
    }
}

impl BusUri {
    /// How fast a serial port talks to an SLCAN adapter where the text does not say: 115 200 bit/s.
    pub const SLCAN_SPEED: u32 = 115_200;

    /// What the bus carries, so that a device of another kind can be refused in time.
    #[must_use]
    pub const fn medium(&self) -> Medium {
        match self {
            Self::Virtual(_) => Medium::Any,
            Self::SocketCan(_)
            | Self::SlcanListen(_)
            | Self::SlcanListenPty(_)
            | Self::Slcan(_)
            | Self::SlcanDevice { .. }
            | Self::SocketcandListen(_) => Medium::Can,
            Self::Rs485Listen(_)
            | Self::Rs485ListenPty(_)
            | Self::Rs485(_)
            | Self::Rs485Device(_) => Medium::Rs485,
        }
    }
}

impl Medium {
    /// The forms of [`BusUri`] with this medium alone, in words for a message.
    #[must_use]
    pub const fn forms(self) -> &'static str {
        match self {
            Self::Can => CAN_FORMS,
            Self::Rs485 => RS485_FORMS,
            Self::Any => "virtual:NAME",
        }
    }
}

impl fmt::Display for Medium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Can => "CAN",
            Self::Rs485 => "RS-485",
            Self::Any => "any",
        })
    }
}

/// Whether `text` is meant as a path, which no host begins like.
fn is_path(text: &str) -> bool {
    text.starts_with(['/', '.'])
}

/// The path that `text` is.
fn path(text: &str) -> Result<PathBuf, &'static str> {
    if !is_path(text) {
        return Err(" (a path begins with / or .)");
    }
    if text.contains(char::is_control) {
        return Err(" (a path has no control characters)");
    }
    match Path::new(text).file_name() {
        Some(_) if !text.ends_with('/') => Ok(PathBuf::from(text)),
        _ => Err(" (that path is a directory)"),
    }
}

/// The name of a network interface: 1 … 15 octets, none of them a blank or `/` (Linux,
/// `dev_valid_name`).
fn interface(text: &str) -> Result<String, &'static str> {
    let spelled = |octet: u8| octet.is_ascii_graphic() && octet != b'/' && octet != b':';
    match text {
        "" => Err(" (the interface is missing)"),
        "." | ".." => Err(" (that is no interface)"),
        _ if text.len() > 15 => Err(" (an interface has at most 15 letters)"),
        _ if !text.bytes().all(spelled) => Err(" (that is no interface)"),
        _ => Ok(text.to_owned()),
    }
}

/// The serial port of an adapter, and its speed.
fn adapter(text: &str) -> Result<BusUri, &'static str> {
    let (path_text, speed) = match text.rsplit_once('@') {
        Some((path, digits)) if digits.bytes().all(|octet| octet.is_ascii_digit()) => {
            let speed = digits.parse().ok().filter(|speed| *speed > 0);
            (path, speed.ok_or(" (that is no speed of a serial port)")?)
        }
        _ => (text, BusUri::SLCAN_SPEED),
    };
    Ok(BusUri::SlcanDevice { path: path(path_text)?, speed })
}

/// The endpoint that somebody else listens on.
fn remote(text: &str) -> Result<Endpoint, &'static str> {
    match Endpoint::parse(text)? {
        Endpoint { port: 0, .. } => Err(" (nobody listens on port 0)"),
        endpoint => Ok(endpoint),
    }
}

impl FromStr for BusUri {
    type Err = InvalidBusUri;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let invalid = |why| InvalidBusUri { given: text.to_owned(), why };
        let (kind, rest) = text.split_once(':').ok_or_else(|| invalid(""))?;
        match kind {
            "virtual" if rest.is_empty() => Err(invalid(" (the name is missing)")),
            "virtual"
                if rest.contains(|letter: char| letter.is_whitespace() || letter.is_control()) =>
            {
                Err(invalid(" (a name has no blanks)"))
            }
            "virtual" => Ok(Self::Virtual(rest.to_owned())),
            "socketcan" => interface(rest).map(Self::SocketCan).map_err(invalid),
            "slcan-listen" => match rest.strip_prefix("pty:") {
                Some(link) => path(link).map(Self::SlcanListenPty).map_err(invalid),
                None => Endpoint::parse(rest).map(Self::SlcanListen).map_err(invalid),
            },
            "socketcand-listen" => {
                Endpoint::parse(rest).map(Self::SocketcandListen).map_err(invalid)
            }
            "slcan" if is_path(rest) => adapter(rest).map_err(invalid),
            "slcan" => remote(rest).map(Self::Slcan).map_err(invalid),
            "rs485-listen" => match rest.strip_prefix("pty:") {
                Some(link) => path(link).map(Self::Rs485ListenPty).map_err(invalid),
                None => Endpoint::parse(rest).map(Self::Rs485Listen).map_err(invalid),
            },
            "rs485" if is_path(rest) => path(rest).map(Self::Rs485Device).map_err(invalid),
            "rs485" => remote(rest).map(Self::Rs485).map_err(invalid),
            _ => Err(invalid("")),
        }
    }
}

impl fmt::Display for BusUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Virtual(name) => write!(f, "virtual:{name}"),
            Self::SocketCan(interface) => write!(f, "socketcan:{interface}"),
            Self::SlcanListen(endpoint) => write!(f, "slcan-listen:{endpoint}"),
            Self::SlcanListenPty(path) => write!(f, "slcan-listen:pty:{}", path.display()),
            Self::SlcanDevice { path, speed: Self::SLCAN_SPEED } => {
                write!(f, "slcan:{}", path.display())
            }
            Self::SlcanDevice { path, speed } => write!(f, "slcan:{}@{speed}", path.display()),
            Self::SocketcandListen(endpoint) => write!(f, "socketcand-listen:{endpoint}"),
            Self::Slcan(endpoint) => write!(f, "slcan:{endpoint}"),
            Self::Rs485Listen(endpoint) => write!(f, "rs485-listen:{endpoint}"),
            Self::Rs485ListenPty(path) => write!(f, "rs485-listen:pty:{}", path.display()),
            Self::Rs485(endpoint) => write!(f, "rs485:{endpoint}"),
            Self::Rs485Device(path) => write!(f, "rs485:{}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bus_is_written_as_it_is_read() {
        for text in [
            "virtual:lab",
            "virtual:line:2",
            "slcan-listen:127.0.0.1:4001",
            "slcan-listen:localhost:0",
            "slcan-listen:[::1]:4001",
            "slcan:adapter-7.plant.example:65535",
            "slcan:[fe80::1]:4001",
            "slcan:/dev/ttyACM0",
            "slcan:/dev/ttyUSB0@57600",
            "slcan:/dev/serial/by-id/usb-CANable@home-if00",
            "slcan-listen:pty:/tmp/adapter",
            "socketcan:can0",
            "socketcan:vcan-1.2",
            "socketcand-listen:127.0.0.1:29536",
            "rs485-listen:127.0.0.1:4002",
            "rs485-listen:[::1]:0",
            "rs485-listen:pty:/tmp/line",
            "rs485-listen:pty:./my line",
            "rs485:gateway.plant.example:4002",
            "rs485:[fe80::1]:4002",
            "rs485:/dev/ttyUSB0",
            "rs485:/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0",
            "rs485:../line",
        ] {
            let uri: BusUri = text.parse().unwrap();
            assert_eq!(uri.to_string(), text);
        }
    }

    #[test]
    fn a_bus_tells_what_it_carries() {
        for (text, medium) in [
            ("virtual:lab", Medium::Any),
            ("slcan-listen:127.0.0.1:0", Medium::Can),
            ("slcan:127.0.0.1:4001", Medium::Can),
            ("slcan:/dev/ttyACM0", Medium::Can),
            ("slcan-listen:pty:./adapter", Medium::Can),
            ("socketcan:can0", Medium::Can),
            ("socketcand-listen:[::1]:0", Medium::Can),
            ("rs485-listen:127.0.0.1:0", Medium::Rs485),
            ("rs485-listen:pty:/tmp/line", Medium::Rs485),
            ("rs485:127.0.0.1:4002", Medium::Rs485),
            ("rs485:/dev/ttyS0", Medium::Rs485),
        ] {
            assert_eq!(text.parse::<BusUri>().unwrap().medium(), medium, "{text}");
        }
    }

    #[test]
    fn an_adapter_has_the_speed_that_is_said_or_the_usual_one() {
        let speed = |text: &str| match text.parse() {
            Ok(BusUri::SlcanDevice { speed, .. }) => speed,
            other => panic!("{other:?}"),
        };
        assert_eq!(speed("slcan:/dev/ttyUSB0"), 115_200);
        assert_eq!(speed("slcan:/dev/ttyUSB0@57600"), 57_600);
        assert_eq!("slcan:/a@115200".parse::<BusUri>().unwrap().to_string(), "slcan:/a");
    }

    #[test]
    fn what_names_no_bus_is_answered_with_the_forms_there_are() {
        for text in [
            "",
            "can0",
            "virtual:",
            "virtual:a b",
            "slcan:",
            "slcan:4001",
            "slcan:host:",
            "slcan:host:0",
            "slcan:host:65536",
            "slcan:host:+1",
            "slcan:::1:4001",
            "slcan:[::1]4001",
            "slcan:[host]:4001",
            "slcan:ttyACM0",
            "slcan:/dev/",
            "slcan:/dev/ttyACM0@0",
            "slcan:/dev/ttyACM0@99999999999",
            "slcan-listen::4001",
            "slcan-listen:/dev/ttyACM0",
            "slcan-listen:pty:adapter",
            "socketcan:",
            "socketcan:can 0",
            "socketcan:../can0",
            "socketcan:an-interface-too-long",
            "socketcand-listen:can0",
            "SLCAN:host:1",
            "/dev/ttyUSB0",
            "rs485:",
            "rs485:ttyUSB0",
            "rs485:/",
            "rs485:/dev/",
            "rs485:..",
            "rs485:/dev/tty\n",
            "rs485:127.0.0.1:0",
            "rs485:pty:/tmp/line",
            "rs485-listen:4002",
            "rs485-listen:/dev/ttyUSB0",
            "rs485-listen:pty:",
            "rs485-listen:pty:line",
            "rs485-listen:pty:/tmp/",
        ] {
            let error = text.parse::<BusUri>().expect_err(text).to_string();
            assert!(error.starts_with(&format!("{text:?} names no bus")), "{error}");
            for form in [
                "virtual:NAME",
                "socketcan:can0",
                "slcan:/dev/tty",
                "slcan:HOST:PORT",
                "slcan-listen:HOST:PORT",
                "slcan-listen:pty:PATH",
                "socketcand-listen:HOST:PORT",
                "rs485-listen:HOST:PORT",
                "rs485-listen:pty:PATH",
                "rs485:HOST:PORT",
                "rs485:/dev/tty",
            ] {
                assert!(error.contains(form), "{form} is missing: {error}");
            }
        }
    }
}
