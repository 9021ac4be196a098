//! Names of buses, as people write them on a command line or in a file.

use std::fmt;
use std::net::Ipv6Addr;
use std::str::FromStr;

use thiserror::Error;

/// The name of a bus: where the frames go and how to get there.
///
/// Written and read as `virtual:NAME`, `slcan-listen:HOST:PORT` or `slcan:HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum BusUri {
    /// `virtual:NAME`: a bus inside this process, shared by all who give the same name.
    Virtual(String),
    /// `slcan-listen:HOST:PORT`: we play the SLCAN adapter that others connect to; port 0 takes
    /// any free one.
    SlcanListen(Endpoint),
    /// `slcan:HOST:PORT`: we connect to an SLCAN adapter; the port is 1 … 65535.
    Slcan(Endpoint),
}

/// A host and a TCP port: `localhost:4001`, `127.0.0.1:4001`, `[::1]:4001`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Endpoint {
    host: String,
    port: u16,
}

/// A text that names no bus; its message says what was given and which forms there are.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{given:?} names no bus{why}: write virtual:NAME, slcan-listen:HOST:PORT or slcan:HOST:PORT, \
     with an IPv6 host in brackets"
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
            "slcan-listen" => Endpoint::parse(rest).map(Self::SlcanListen).map_err(invalid),
            "slcan" => match Endpoint::parse(rest) {
                Ok(endpoint) if endpoint.port == 0 => Err(invalid(" (nobody listens on port 0)")),
                Ok(endpoint) => Ok(Self::Slcan(endpoint)),
                Err(why) => Err(invalid(why)),
            },
            _ => Err(invalid("")),
        }
    }
}

impl fmt::Display for BusUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Virtual(name) => write!(f, "virtual:{name}"),
            Self::SlcanListen(endpoint) => write!(f, "slcan-listen:{endpoint}"),
            Self::Slcan(endpoint) => write!(f, "slcan:{endpoint}"),
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
        ] {
            let uri: BusUri = text.parse().unwrap();
            assert_eq!(uri.to_string(), text);
        }
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
            "slcan:/dev/ttyACM0",
            "slcan-listen::4001",
            "SLCAN:host:1",
        ] {
            let error = text.parse::<BusUri>().expect_err(text).to_string();
            assert!(error.starts_with(&format!("{text:?} names no bus")), "{error}");
            assert!(error.contains("virtual:NAME, slcan-listen:HOST:PORT or slcan:HOST:PORT"));
        }
    }
}
