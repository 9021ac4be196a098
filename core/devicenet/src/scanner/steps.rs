//! The steps that bring a slave to data exchange, and what each asks.

use super::settings::{ChangeSettings, SlaveSettings};
use crate::explicit::{Service, class};
use crate::server::choice;
use crate::{MacId, connection};

/// Instance number of the change of state or cyclic connection.
const CHANGE: u8 = connection::CHANGE_OF_STATE;

/// One step from an unknown slave to data exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Allocate the explicit and the I/O connections.
    Allocate,
    /// Allocate the poll connection of a slave that has the explicit one already.
    AllocatePoll,
    /// Identity attributes 1 and 3, where the settings name them.
    Vendor,
    ProductCode,
    /// Keep the explicit connection alive by the I/O connections (watchdog action 3).
    DeferredDelete,
    /// Choose what the slave answers polls with, where the settings name it.
    PollPath,
    /// Learn how much that is.
    PollSize,
    /// Learn how much a poll may carry.
    ConsumedSize,
    /// Choose what it produces of its own accord, where the settings name it.
    ChangePath,
    /// Learn how much that is.
    ChangeSize,
    /// Set the production inhibit time, before the rate.
    ChangeInhibit,
    /// Set the expected packet rate: the connection is established.
    PollRate,
    ChangeRate,
}

/// The steps in their order. The rates come last: until then nothing times out.
const ORDER: [Step; 13] = [
    Step::Allocate,
    Step::AllocatePoll,
    Step::Vendor,
    Step::ProductCode,
    Step::DeferredDelete,
    Step::PollPath,
    Step::PollSize,
    Step::ConsumedSize,
    Step::ChangePath,
    Step::ChangeSize,
    Step::ChangeInhibit,
    Step::PollRate,
    Step::ChangeRate,
];

/// What an earlier life of ours may hold, in the order of its release. The explicit connection goes
/// last: with it the slave forgets its master.
pub(super) const RELEASES: [u8; 4] =
    [choice::POLL, choice::CHANGE_OF_STATE, choice::CYCLIC, choice::EXPLICIT];

/// The octets of a request of our own.
pub(super) type Body = ([u8; 8], usize);

impl Step {
    /// The step after this one; `None` when the slave exchanges data.
    pub(super) fn next(self, settings: &SlaveSettings) -> Option<Self> {
        let later = ORDER.iter().skip_while(|step| **step != self).skip(1);
        later.copied().find(|step| step.is_needed(settings))
    }

    fn is_needed(self, settings: &SlaveSettings) -> bool {
        let SlaveSettings { poll, change, identity, .. } = settings;
        match self {
            Self::Allocate => true,
            // An allocation of everything has brought it; it is a beginning of its own.
            Self::AllocatePoll => false,
            Self::Vendor | Self::ProductCode => identity.is_some(),
            Self::DeferredDelete => poll.is_some() || change.is_some(),
            Self::PollPath => poll.is_some_and(|poll| poll.assembly.is_some()),
            Self::PollSize | Self::ConsumedSize | Self::PollRate => poll.is_some(),
            Self::ChangePath => change.is_some_and(|change| change.assembly.is_some()),
            Self::ChangeInhibit => change.is_some_and(|change| change.production_inhibit != 0),
            Self::ChangeSize | Self::ChangeRate => change.is_some(),
        }
    }

    /// What the step asks of the slave.
    pub(super) fn request(self, settings: &SlaveSettings, master: MacId) -> Body {
        let change = |value: fn(&ChangeSettings) -> u16| settings.change.as_ref().map_or(0, value);
        let rate = settings.poll.map_or(0, |poll| poll.expected_packet_rate);
        let poll_assembly = settings.poll.and_then(|poll| poll.assembly);
        let change_assembly = settings.change.and_then(|change| change.assembly);
        match self {
            Self::Allocate => allocate(settings.choice(), master),
            Self::AllocatePoll => allocate(choice::POLL, master),
            Self::Vendor => get(class::IDENTITY, 1, 1),
            Self::ProductCode => get(class::IDENTITY, 1, 3),
            Self::DeferredDelete => defer_delete(),
            Self::PollPath => set_path(connection::POLL, poll_assembly),
            Self::PollSize => get(class::CONNECTION, connection::POLL, 7),
            Self::ConsumedSize => get(class::CONNECTION, connection::POLL, 8),
            Self::ChangePath => set_path(CHANGE, change_assembly),
            Self::ChangeSize => get(class::CONNECTION, CHANGE, 7),
            Self::ChangeInhibit => set_time(CHANGE, 17, change(|change| change.production_inhibit)),
            Self::PollRate => set_time(connection::POLL, 9, rate),
            Self::ChangeRate => set_time(CHANGE, 9, change(|change| change.expected_packet_rate)),
        }
    }
}

const SET: u8 = Service::SET_ATTRIBUTE_SINGLE.0;

/// Allocates the connections of `choice` for `master`.
pub(super) const fn allocate(choice: u8, master: MacId) -> Body {
    let allocate = Service::ALLOCATE.0;
    ([allocate, class::DEVICENET, 1, choice, master.value(), 0, 0, 0], 5)
}

/// Releases the connections of `choice`.
pub(super) const fn release(choice: u8) -> Body {
    ([Service::RELEASE.0, class::DEVICENET, 1, choice, 0, 0, 0, 0], 4)
}

/// Sets the watchdog action of the explicit connection to 3, deferred delete.
pub(super) const fn defer_delete() -> Body {
    let action = connection::Connection::DEFERRED_DELETE;
    ([SET, class::CONNECTION, connection::EXPLICIT, 12, action, 0, 0, 0], 5)
}

/// Asks for the state of the explicit connection, to keep it alive.
pub(super) const fn keep_alive() -> Body {
    get(class::CONNECTION, connection::EXPLICIT, 1)
}

const fn get(class: u8, instance: u8, attribute: u8) -> Body {
    ([Service::GET_ATTRIBUTE_SINGLE.0, class, instance, attribute, 0, 0, 0, 0], 4)
}

fn set_path(connection: u8, assembly: Option<u8>) -> Body {
    let assembly = assembly.unwrap_or(1);
    ([SET, class::CONNECTION, connection, 14, 0x20, class::ASSEMBLY, 0x24, assembly], 8)
}

const fn set_time(connection: u8, attribute: u8, time_ms: u16) -> Body {
    let [low, high] = time_ms.to_le_bytes();
    ([SET, class::CONNECTION, connection, attribute, low, high, 0, 0], 6)
}
