//! What the scanner shall do with its slaves, and why it may not.

use crate::MacId;
use crate::explicit::Error;
use crate::server::choice;

/// What the scanner shall do with one slave.
///
/// Start from [`poll`](Self::poll), [`change_of_state`](Self::change_of_state),
/// [`cyclic`](Self::cyclic) or [`explicit`](Self::explicit) and change what differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlaveSettings {
    /// Its address.
    pub mac: MacId,
    /// The poll connection, instance 2; `None` where the slave is not polled.
    pub poll: Option<PollSettings>,
    /// The change of state or cyclic connection, instance 4; `None` where there shall be none.
    pub change: Option<ChangeSettings>,
    /// The device the slave must be; `None` takes any.
    pub identity: Option<DeviceIdentity>,
}

/// How a slave is polled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PollSettings {
    /// The expected packet rate in ms; 0 = no time-out on either side, but ten polls without an
    /// answer lose the slave.
    pub expected_packet_rate: u16,
    /// The assembly that polls shall bring; `None` leaves what the slave has kept.
    pub assembly: Option<u8>,
}

/// What makes a slave produce of its own accord.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// A change of its data, and the expected packet rate as the longest pause.
    ChangeOfState,
    /// The expected packet rate alone.
    Cyclic,
}

/// How a slave produces of its own accord.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChangeSettings {
    /// Change of state or cyclic.
    pub trigger: Trigger,
    /// Whether the scanner acknowledges each production; otherwise acknowledges are suppressed
    /// (allocation choice bit 6).
    pub acknowledged: bool,
    /// The expected packet rate in ms; 0 = no time-out on either side.
    pub expected_packet_rate: u16,
    /// The shortest pause between two productions in ms; 0 leaves what the slave has.
    pub production_inhibit: u16,
    /// The assembly to be produced; `None` leaves what the slave has kept.
    pub assembly: Option<u8>,
}

/// Which device a slave must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceIdentity {
    /// Identity attribute 1.
    pub vendor: u16,
    /// Identity attribute 3.
    pub product_code: u16,
}

impl SlaveSettings {
    /// Polls `mac`, whatever it is, with an expected packet rate of 200 ms.
    #[must_use]
    pub const fn poll(mac: MacId) -> Self {
        let poll = PollSettings { expected_packet_rate: 200, assembly: None };
        Self { mac, poll: Some(poll), change: None, identity: None }
    }

    /// Lets `mac`, whatever it is, produce what changes, and at least every second, acknowledged.
    #[must_use]
    pub const fn change_of_state(mac: MacId) -> Self {
        let change = ChangeSettings {
            trigger: Trigger::ChangeOfState,
            acknowledged: true,
            expected_packet_rate: 1_000,
            production_inhibit: 0,
            assembly: None,
        };
        Self { mac, poll: None, change: Some(change), identity: None }
    }

    /// Lets `mac`, whatever it is, produce every `rate_ms` ms, acknowledged.
    #[must_use]
    pub const fn cyclic(mac: MacId, rate_ms: u16) -> Self {
        let change = ChangeSettings {
            trigger: Trigger::Cyclic,
            acknowledged: true,
            expected_packet_rate: rate_ms,
            production_inhibit: 0,
            assembly: None,
        };
        Self { mac, poll: None, change: Some(change), identity: None }
    }

    /// Keeps an explicit connection to `mac`, whatever it is, and exchanges no I/O data.
    #[must_use]
    pub const fn explicit(mac: MacId) -> Self {
        Self { mac, poll: None, change: None, identity: None }
    }

    /// The allocation choice octet.
    #[must_use]
    pub const fn choice(&self) -> u8 {
        let poll = if self.poll.is_some() { choice::POLL } else { 0 };
        let change = match self.change {
            None => 0,
            Some(ChangeSettings { trigger, acknowledged, .. }) => {
                let kind = match trigger {
                    Trigger::ChangeOfState => choice::CHANGE_OF_STATE,
                    Trigger::Cyclic => choice::CYCLIC,
                };
                if acknowledged { kind } else { kind | choice::ACKNOWLEDGE_SUPPRESSION }
            }
        };
        choice::EXPLICIT | poll | change
    }
}

/// Who the scanner says it is when it checks its own MAC ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScannerIdentity {
    /// Vendor code.
    pub vendor: u16,
    /// Serial number.
    pub serial: u32,
}

/// Which of its codes makes a slave another device than the one wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IdentityCode {
    /// Identity attribute 1.
    Vendor,
    /// Identity attribute 3.
    ProductCode,
}

/// Why a slave does not exchange data although it answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It refused a service.
    Service(Error),
    /// It is not the device that the settings name.
    AnotherDevice {
        /// What differs.
        code: IdentityCode,
        /// The code it gave.
        found: u16,
        /// The code that was wanted.
        wanted: u16,
    },
    /// It wants class and instance in a form that the scanner does not write.
    BodyFormat {
        /// The message body format that it answered the allocation with.
        format: u8,
    },
    /// It produces more than a scanner takes.
    InputTooLong {
        /// The size of its production; the scanner takes [`IO_DATA_OCTETS`](super::IO_DATA_OCTETS).
        octets: u16,
    },
    /// It does not consume as many octets as the output that was set for it has.
    OutputLength {
        /// What it consumes.
        consumes: u16,
        /// What was set.
        set: u16,
    },
}

/// How a slave cannot be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotAdded {
    /// All places are taken.
    Full,
    /// The address is the scanner's own or has been added before.
    AddressInUse,
}

/// Why output data are not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotSet {
    /// No polled slave with this MAC ID has been added.
    UnknownSlave,
    /// The slave consumes another number of octets, or they are more than
    /// [`IO_DATA_OCTETS`](super::IO_DATA_OCTETS).
    Length,
}

/// Why the scanner does not take a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotTaken {
    /// No slave with this MAC ID has been added.
    UnknownSlave,
    /// The slave does not exchange data yet, so there is no explicit connection to it.
    NotRunning,
    /// A request to this slave is under way, or its response has not been fetched.
    Busy,
    /// The request is longer than 64 octets, or empty.
    Length,
    /// The scanner itself is not on-line.
    OffLine,
}
