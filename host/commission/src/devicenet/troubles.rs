//! What goes wrong on DeviceNet, in words.

use codewheel_devicenet::explicit::{Error, GeneralStatus};
use codewheel_devicenet::scanner::Refusal;
use codewheel_devicenet::{Fault, MacId};

use crate::{Kind, Owner, Trouble};

/// Additional code of 0C: another master has the connection set.
const ALLOCATION_CONFLICT: u8 = 0x01;

/// The console cannot be heard.
pub(super) fn fault(tried: &str, fault: Fault, own: Option<MacId>) -> Trouble {
    let (came, remedy) = match fault {
        Fault::DuplicateMac => return duplicate(tried, own),
        Fault::BusOff => (
            "our CAN controller left the bus after too many errors (bus-off)".to_owned(),
            "check the bit rate, CAN_H and CAN_L, and the two terminating resistors, then try again",
        ),
        Fault::Detached => (
            "the way to the bus is gone: an adapter, an interface or a connection".to_owned(),
            "plug it in again, or start the other side, then try again",
        ),
        Fault::Switches => ("our own address is none".to_owned(), "take one from 0 to 63"),
    };
    Trouble::new(Kind::Bus, tried, came, remedy)
}

/// Another node has our own address.
pub(super) fn duplicate(tried: &str, own: Option<MacId>) -> Trouble {
    let own = own.map_or_else(String::new, |own| format!(" {own}"));
    Trouble::new(
        Kind::Bus,
        tried,
        format!("another node has the MAC ID{own} that we would take"),
        "choose a MAC ID for us that nobody has: listen, or scan with another one, to see who is there",
    )
}

/// Nobody acknowledges, or nobody says anything.
pub(super) fn silence(tried: &str) -> Trouble {
    Trouble::new(
        Kind::Bus,
        tried,
        "nobody acknowledges our frames, and nobody was heard",
        "check that the network has its 24 V, that the bit rate is that of the nodes' switches, \
         CAN_H and CAN_L, and the two terminating resistors",
    )
}

/// Some were heard, and yet we did not get on line.
pub(super) fn not_on_line(tried: &str) -> Trouble {
    Trouble::new(
        Kind::Bus,
        tried,
        "our frames do not get through, though others are heard",
        "see whether the adapter only listens, and whether the bus is flooded",
    )
}

/// No node answered at an address.
pub(super) fn nobody(tried: &str, mac: MacId) -> Trouble {
    Trouble::new(
        Kind::TimeOut,
        tried,
        format!("no node answered at MAC ID {mac}"),
        "check its power, its address switches and the bit rate, or scan to see who is there; one \
         that was just switched on needs two seconds",
    )
}

/// A device that did answer does not any more.
pub(super) fn gone(tried: &str, mac: MacId) -> Trouble {
    Trouble::new(
        Kind::TimeOut,
        tried,
        format!("the device at MAC ID {mac} does not answer any more"),
        "check its power and its plug, then try again; whether it still did what it was asked last \
         is not known: read it back",
    )
}

/// There is no connection to a device.
pub(super) fn not_open(tried: &str, mac: MacId) -> Trouble {
    Trouble::new(
        Kind::Usage,
        tried,
        format!("there is no connection to the device at MAC ID {mac} any more"),
        "open it anew",
    )
}

/// A slave belongs to another master.
pub(super) fn owned(tried: &str, mac: MacId, owner: Owner, candidates: &[MacId]) -> Trouble {
    let (came, whom) = match owner {
        Owner::Master(master) => (
            format!("the slave at MAC ID {mac} belongs to the master at MAC ID {master}"),
            format!("let the master at {master} give it up"),
        ),
        Owner::Somebody | Owner::Nobody => {
            let came = format!(
                "the slave at MAC ID {mac} belongs to another master, whose address was not heard"
            );
            let whom = match candidates {
                [] => "let its master give it up".to_owned(),
                [one] => format!("let its master give it up, which may be the node at {one}"),
                several => {
                    let names: Vec<String> = several.iter().map(MacId::to_string).collect();
                    format!("let its master give it up, one of the nodes at {}", names.join(", "))
                }
            };
            (came, whom)
        }
    };
    let remedy =
        format!("watch it without taking part, or {whom}: take it off its scan list, or stop it");
    Trouble::new(Kind::Refused, tried, came, remedy)
}

/// Whether a refusal says that another master owns the slave.
pub(super) fn is_ownership(refusal: Refusal) -> bool {
    let conflict = Error::with(GeneralStatus::OBJECT_STATE_CONFLICT, ALLOCATION_CONFLICT);
    refusal == Refusal::Service(conflict)
}

/// A slave answers, and will not be ours.
pub(super) fn not_allocated(tried: &str, refusal: Refusal) -> Trouble {
    let (came, remedy) = match refusal {
        Refusal::Service(error) => return refused(tried, error),
        Refusal::AnotherDevice { found, wanted, .. } => (
            format!("it is another device: {found} instead of {wanted}"),
            "see with a scan which device has this address",
        ),
        Refusal::BodyFormat { format } => (
            format!("it wants requests in message body format {format}, which nobody here writes"),
            "read it with the tool of its maker",
        ),
        Refusal::InputTooLong { octets } => (
            format!("it produces {octets} octets, more than there is room for"),
            "read it by explicit messages instead",
        ),
        Refusal::OutputLength { consumes, .. } => (
            format!("it consumes {consumes} octets, which nobody here has to give"),
            "read it by explicit messages instead",
        ),
    };
    Trouble::new(Kind::Refused, tried, came, remedy)
}

/// A device refuses a service.
pub(super) fn refused(tried: &str, error: Error) -> Trouble {
    Trouble::new(Kind::Refused, tried, format!("it answers {error}"), advice(error.general))
}

/// What was to be done is done, as far as the device says, and nobody saw it.
pub(super) fn not_read_back(what: &str, trouble: Trouble) -> Trouble {
    let Trouble { kind, tried, came, .. } = trouble;
    let kind = if kind == Kind::Refused { Kind::Differs } else { kind };
    Trouble::new(
        kind,
        format!("{tried} and see that it is so"),
        format!("{what} was written and taken, and could not be read back: {came}"),
        "it is in force; read it another way, such as with `codewheel get`, before you rely on it",
    )
}

/// What to do about a general status.
const fn advice(status: GeneralStatus) -> &'static str {
    match status {
        GeneralStatus::RESOURCE_UNAVAILABLE => "it has no room for it now: try again later",
        GeneralStatus::PATH_UNKNOWN | GeneralStatus::OBJECT_DOES_NOT_EXIST => {
            "it has no such object: see what it has by getting everything"
        }
        GeneralStatus::SERVICE_NOT_SUPPORTED => "it cannot do that, by its nature",
        GeneralStatus::INVALID_ATTRIBUTE_VALUE | GeneralStatus::INVALID_PARAMETER => {
            "choose another value"
        }
        GeneralStatus::ALREADY_IN_STATE => "there is nothing to do",
        GeneralStatus::OBJECT_STATE_CONFLICT => {
            "it cannot be done while the connection exchanges data: release it first"
        }
        GeneralStatus::ATTRIBUTE_NOT_SETTABLE => "it can only be read",
        GeneralStatus::DEVICE_STATE_CONFLICT => {
            "it is busy, perhaps writing its memory: wait five seconds and try again"
        }
        GeneralStatus::NOT_ENOUGH_DATA => "give more octets",
        GeneralStatus::TOO_MUCH_DATA => "give fewer octets",
        GeneralStatus::ATTRIBUTE_NOT_SUPPORTED => {
            "it has no such attribute: see what it has by getting everything"
        }
        GeneralStatus::NO_STORED_DATA => {
            "its memory holds nothing to bring back, or is damaged: set what you need and save"
        }
        GeneralStatus::STORE_FAILED => {
            "its memory did not take it, and the settings last until power-off: try again, and \
             replace the device if it fails again"
        }
        _ => "",
    }
}
