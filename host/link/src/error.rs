//! Why a port cannot be opened or is lost.

use std::io;
use std::path::PathBuf;

use codewheel_station::can::BitRate;
use thiserror::Error;

use crate::{BusUri, InterfaceTrouble, Medium};

/// Why a port cannot be opened or is lost: what was tried, what came back, what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The host name leads to no address.
    #[error("cannot find the host of {endpoint}: {}; check its name", phrase(.reason))]
    Resolve {
        /// Host and port as given.
        endpoint: String,
        /// What the system said.
        reason: io::Error,
    },
    /// The TCP port cannot be listened on.
    #[error("cannot listen on {endpoint}: {}{}", phrase(.reason), listen_advice(.reason))]
    Listen {
        /// Host and port as given.
        endpoint: String,
        /// What the system said.
        reason: io::Error,
    },
    /// The adapter cannot be reached.
    #[error("cannot connect to {endpoint}: {}{}", phrase(.reason), connect_advice(.reason))]
    Connect {
        /// Host and port as given.
        endpoint: String,
        /// What the system said.
        reason: io::Error,
    },
    /// The adapter refused to open its channel.
    #[error(
        "the adapter of {bus} refused to open its channel (it answered O with BEL): another \
         program may hold it, or it lacks the bit rate; free the adapter and try again"
    )]
    Refused {
        /// The bus as a URI.
        bus: String,
    },
    /// What leads to the bus is gone. Ports that others can be had for again do not end with it.
    #[error("{bus} was lost: {reason}; start this program again")]
    Lost {
        /// The bus as a URI.
        bus: String,
        /// What the system said, or that the other side closed it.
        reason: String,
    },
    /// A CAN interface cannot be used as it is, and setting it up needs rights that this program
    /// does not ask for.
    #[error("cannot use the CAN interface {interface}: {}", .trouble.phrase(.interface))]
    Interface {
        /// Its name as given.
        interface: String,
        /// What is wrong with it, and what to type.
        trouble: InterfaceTrouble,
    },
    /// The virtual bus runs at another bit rate.
    #[error(
        "cannot join virtual:{name} at {asked}: the bus runs at {actual}; \
         take that rate, or another name"
    )]
    OtherBitRate {
        /// The name of the bus.
        name: String,
        /// The rate asked for.
        asked: BitRate,
        /// The rate of those who joined before.
        actual: BitRate,
    },
    /// The URI names a bus of another kind than is asked for, or one that no port leads to.
    #[error("{uri} is no {wanted} bus to connect to: write {}", .wanted.forms())]
    OtherMedium {
        /// The bus as given.
        uri: BusUri,
        /// What the port was to carry.
        wanted: Medium,
    },
    /// A serial port, or a pty, cannot be opened or set up.
    #[error("cannot open the serial port {}: {}{}", .path.display(), phrase(.reason),
        device_advice(.reason))]
    Device {
        /// Its path as given.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// The name of a pty cannot be put where it is wanted.
    #[error("cannot put a serial port at {}: {reason}; remove what is there, or choose another path",
        .path.display())]
    Name {
        /// The path as given.
        path: PathBuf,
        /// What is in the way.
        reason: String,
    },
    /// This operating system has no such port.
    #[error("{uri} needs {needs}; here write {instead}")]
    NotHere {
        /// The bus as given.
        uri: BusUri,
        /// The system that has it.
        needs: &'static str,
        /// What can be written on any system.
        instead: &'static str,
    },
    /// The operating system cannot watch sockets.
    #[error(
        "the operating system cannot watch the sockets of the bus: {0}; close other \
         programs and try again"
    )]
    System(io::Error),
}

impl LinkError {
    /// Whether what led to the bus is gone, and may come back.
    pub(crate) const fn is_loss(&self) -> bool {
        matches!(self, Self::Lost { .. })
    }
}

/// What went wrong, without the number that the system appends.
pub(crate) fn phrase(reason: &io::Error) -> String {
    match reason.kind() {
        io::ErrorKind::AddrInUse => "address already in use".to_owned(),
        io::ErrorKind::AddrNotAvailable => "no such address on this machine".to_owned(),
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::ConnectionRefused => "connection refused".to_owned(),
        io::ErrorKind::TimedOut => "no answer".to_owned(),
        _ => reason.to_string(),
    }
}

fn listen_advice(reason: &io::Error) -> &'static str {
    match reason.kind() {
        io::ErrorKind::AddrInUse => "; another program holds the port: choose another or stop it",
        io::ErrorKind::AddrNotAvailable => "; give an address that this machine has",
        io::ErrorKind::PermissionDenied => "; choose a port from 1024 on",
        _ => "; choose another address or port",
    }
}

fn device_advice(reason: &io::Error) -> &'static str {
    match reason.kind() {
        io::ErrorKind::NotFound => "; plug the adapter in and look in /dev for its name",
        io::ErrorKind::PermissionDenied => {
            "; you need the right to use it, on most systems by joining the group dialout"
        }
        io::ErrorKind::ResourceBusy => "; another program uses it alone: stop that one first",
        _ => "; check that the path is that of a serial port",
    }
}

fn connect_advice(reason: &io::Error) -> &'static str {
    match reason.kind() {
        io::ErrorKind::ConnectionRefused => "; nothing listens there: start the adapter first",
        _ => "; check the address, the network and that the adapter is running",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_say_what_was_tried_what_came_back_and_what_to_do() {
        let endpoint = || "adapter:4001".to_owned();
        let error = LinkError::Resolve {
            endpoint: endpoint(),
            reason: io::Error::new(io::ErrorKind::NotFound, "no such name"),
        };
        assert_eq!(
            error.to_string(),
            "cannot find the host of adapter:4001: no such name; check its name"
        );
        let error =
            LinkError::Connect { endpoint: endpoint(), reason: io::ErrorKind::TimedOut.into() };
        assert_eq!(
            error.to_string(),
            "cannot connect to adapter:4001: no answer; check the address, the network and that \
             the adapter is running"
        );
        let error = LinkError::Listen {
            endpoint: endpoint(),
            reason: io::ErrorKind::AddrNotAvailable.into(),
        };
        assert_eq!(
            error.to_string(),
            "cannot listen on adapter:4001: no such address on this machine; give an address that \
             this machine has"
        );
    }
}
