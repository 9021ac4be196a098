//! What the master tells, in place of a log.

use std::collections::VecDeque;
use std::fmt;

use super::Service;

/// The most events that wait to be fetched.
pub const EVENTS: usize = 64;

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A slave that was absent answers.
    Online {
        /// Its address.
        address: u8,
    },
    /// A slave accepted its parameters and configuration, and exchanges data from now on.
    Configured {
        /// Its address.
        address: u8,
    },
    /// A slave reports a fault in its parameters. It is tried again and again; told once.
    ParameterError {
        /// Its address.
        address: u8,
    },
    /// A slave reports a fault in its configuration. It is tried again and again; told once.
    ConfigurationError {
        /// Its address.
        address: u8,
    },
    /// A slave answers that it does not serve what it is asked (RS): it belongs to another master,
    /// or in data exchange it went back to waiting for parameters.
    Refused {
        /// Its address.
        address: u8,
        /// What it was asked.
        service: Service,
    },
    /// A slave answers Data_Exchange with another number of inputs than its settings say: they do
    /// not belong to its configuration. Told once.
    InputLength {
        /// Its address.
        address: u8,
        /// How many octets came.
        given: usize,
        /// How many its settings say.
        expected: usize,
    },
    /// A slave's diagnosis was read, because the slave or somebody here asked for that.
    Diagnosis {
        /// Its address.
        address: u8,
    },
    /// A slave does not answer any more.
    Offline {
        /// Its address.
        address: u8,
    },
    /// Another master has this master's address: it is silent for a second, then joins anew.
    AddressCollision,
}

impl Event {
    /// Whether something went wrong that a person should look at.
    #[must_use]
    pub const fn is_trouble(&self) -> bool {
        !matches!(self, Self::Online { .. } | Self::Configured { .. } | Self::Diagnosis { .. })
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Online { address } => write!(f, "slave {address} answers"),
            Self::Configured { address } => write!(f, "slave {address} is configured"),
            Self::ParameterError { address } => {
                write!(
                    f,
                    "slave {address} refuses its parameters: read its diagnosis, compare its GSD file"
                )
            }
            Self::ConfigurationError { address } => {
                write!(
                    f,
                    "slave {address} refuses its configuration: compare the identifiers with its GSD file"
                )
            }
            Self::Refused { address, service: Service::DataExchange } => {
                write!(f, "slave {address} left data exchange and is configured anew")
            }
            Self::Refused { address, service } => {
                write!(f, "slave {address} refuses {service}: another master may own it")
            }
            Self::InputLength { address, given, expected } => write!(
                f,
                "slave {address} sends {given} octets of inputs, its settings say {expected}: \
                 compare them with its configuration"
            ),
            Self::Diagnosis { address } => write!(f, "slave {address} sent its diagnosis"),
            Self::Offline { address } => write!(f, "slave {address} does not answer"),
            Self::AddressCollision => f.write_str("another master has the address of this one"),
        }
    }
}

/// The latest events; older ones give way.
#[derive(Clone, Debug, Default)]
pub(super) struct Events {
    waiting: VecDeque<Event>,
    pub(super) lost: u64,
}

impl Events {
    pub(super) fn push(&mut self, event: Event) {
        if self.waiting.len() == EVENTS {
            self.waiting.pop_front();
            self.lost += 1;
        }
        self.waiting.push_back(event);
    }

    pub(super) fn take(&mut self) -> Option<Event> {
        self.waiting.pop_front()
    }
}
