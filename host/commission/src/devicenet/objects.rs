//! What every node of DeviceNet can be asked besides its own matter: who it is, and the settings of
//! its bus (AMG manual §5 to §7; CIP volumes 1 and 3).

use codewheel_devicenet::explicit::{Path, class};
use codewheel_devicenet::{choice, connection};

/// How the octets of an attribute are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A number of so many octets, low octet first.
    Unsigned(usize),
    /// Major and minor revision.
    Revision,
    /// A length and so many characters.
    ShortString,
    /// The allocation choice and the master's MAC ID.
    Allocation,
    /// The produced path of an I/O connection, which names an assembly. It is there while the
    /// connection is: to be read or written, that of this choice is allocated.
    AssemblyPath {
        /// The allocation choice.
        choice: u8,
    },
}

/// An attribute with a name on the command line.
#[derive(Debug)]
pub(super) struct Attribute {
    pub(super) key: &'static str,
    pub(super) path: Path,
    pub(super) title: &'static str,
    pub(super) form: Form,
    pub(super) unit: &'static str,
    pub(super) help: &'static str,
    /// The smallest and largest value; `None` where it can only be read.
    pub(super) range: Option<(i64, i64)>,
    /// Whether people choose it: a passport carries it.
    pub(super) setting: bool,
    /// The names of the values 0, 1, …
    pub(super) values: &'static [&'static str],
    /// Whether only devices of ours are known to have it in this form.
    pub(super) ours: bool,
}

const RATES: &[&str] = &["125k", "250k", "500k"];
const SWITCHES: &[&str] = &["unchanged", "changed"];
const STATES: &[&str] = &[
    "nonexistent",
    "self-testing",
    "standby",
    "operational",
    "major recoverable fault",
    "major unrecoverable fault",
];
const ASSEMBLIES: &[&str] = &["", "position", "position and flags"];

/// A reading, of whatever device.
const fn reading(
    key: &'static str,
    class: u8,
    attribute: u8,
    title: &'static str,
    form: Form,
) -> Attribute {
    Attribute {
        key,
        path: Path { class, instance: 1, attribute },
        title,
        form,
        unit: "",
        help: "",
        range: None,
        setting: false,
        values: &[],
        ours: false,
    }
}

const fn identity(key: &'static str, attribute: u8, title: &'static str, form: Form) -> Attribute {
    reading(key, class::IDENTITY, attribute, title, form)
}

const fn devicenet(key: &'static str, attribute: u8, title: &'static str) -> Attribute {
    reading(key, class::DEVICENET, attribute, title, Form::Unsigned(1))
}

/// All of them, by class, instance and attribute.
pub(super) static ATTRIBUTES: [Attribute; 21] = [
    identity("vendor", 1, "Vendor", Form::Unsigned(2)),
    identity("device-type", 2, "Device type", Form::Unsigned(2)),
    identity("product-code", 3, "Product code", Form::Unsigned(2)),
    identity("revision", 4, "Revision", Form::Revision),
    Attribute {
        help: "Bit 0 owned, bit 2 configured, bits 8 to 11 faults",
        ..identity("status", 5, "Status", Form::Unsigned(2))
    },
    identity("serial-number", 6, "Serial number", Form::Unsigned(4)),
    identity("product-name", 7, "Product name", Form::ShortString),
    Attribute { values: STATES, ..identity("state", 8, "State", Form::Unsigned(1)) },
    Attribute {
        help: "Another number after each change of what is kept",
        ..identity("consistency", 9, "Configuration consistency value", Form::Unsigned(2))
    },
    Attribute {
        unit: "s",
        help: "The pause between two heartbeats; 0 for none. Kept at once",
        range: Some((0, 255)),
        setting: true,
        ..identity("heartbeat-interval", 10, "Heartbeat interval", Form::Unsigned(1))
    },
    devicenet("mac-id", 1, "MAC ID"),
    Attribute { values: RATES, ..devicenet("baud-rate", 2, "Baud rate") },
    Attribute {
        help: "What a bus-off does: it stays off, or begins anew. Kept at once",
        range: Some((0, 1)),
        setting: true,
        values: &["stay off", "begin anew"],
        ..devicenet("bus-off-interrupt", 3, "Bus-off interrupt")
    },
    Attribute {
        help: "How often it left the bus; any write clears it",
        range: Some((0, 255)),
        ..devicenet("bus-off-counter", 4, "Bus-off counter")
    },
    Attribute {
        form: Form::Allocation,
        help: "Which connections are allocated, and to whom",
        ..devicenet("allocation", 5, "Allocation")
    },
    Attribute { values: SWITCHES, ..devicenet("mac-id-switch", 6, "MAC ID switch") },
    Attribute { values: SWITCHES, ..devicenet("baud-rate-switch", 7, "Baud rate switch") },
    devicenet("mac-id-switch-value", 8, "MAC ID switch value"),
    Attribute { values: RATES, ..devicenet("baud-rate-switch-value", 9, "Baud rate switch value") },
    Attribute {
        path: Path { class: class::CONNECTION, instance: connection::POLL, attribute: 14 },
        help: "The assembly that polls are answered with. Kept at once",
        range: Some((1, 2)),
        setting: true,
        values: ASSEMBLIES,
        ours: true,
        ..reading(
            "poll-assembly",
            class::CONNECTION,
            14,
            "Produced path, poll",
            Form::AssemblyPath { choice: choice::POLL },
        )
    },
    Attribute {
        path: Path {
            class: class::CONNECTION,
            instance: connection::CHANGE_OF_STATE,
            attribute: 14,
        },
        help: "The assembly that is produced on change of state and cyclically. Kept at once",
        range: Some((1, 2)),
        setting: true,
        values: ASSEMBLIES,
        ours: true,
        ..reading(
            "change-assembly",
            class::CONNECTION,
            14,
            "Produced path, change of state and cyclic",
            Form::AssemblyPath { choice: choice::CHANGE_OF_STATE },
        )
    },
];

impl Attribute {
    pub(super) fn of_key(key: &str) -> Option<&'static Self> {
        ATTRIBUTES.iter().find(|attribute| attribute.key == key)
    }

    pub(super) fn of_path(path: Path) -> Option<&'static Self> {
        ATTRIBUTES.iter().find(|attribute| attribute.path == path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use codewheel_device::devicenet::rows::ROWS;

    #[test]
    fn no_key_is_given_twice_nor_that_of_a_row() {
        for (place, attribute) in ATTRIBUTES.iter().enumerate() {
            assert!(ATTRIBUTES[place + 1..].iter().all(|other| other.key != attribute.key));
            assert!(ATTRIBUTES[place + 1..].iter().all(|other| other.path != attribute.path));
            assert!(ROWS.iter().all(|row| row.key != attribute.key), "{}", attribute.key);
        }
    }

    #[test]
    fn what_people_choose_can_be_written() {
        assert!(ATTRIBUTES.iter().all(|attribute| !attribute.setting || attribute.range.is_some()));
    }
}
