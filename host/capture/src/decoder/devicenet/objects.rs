//! The names of classes, services and attributes.
//!
//! Those of class 2Fh, and of class 0Fh which repeats them, come from the rows of the device. The objects of
//! the protocol stand here (CIP volumes 1 and 3; AMG manual §5 to §8).

use codewheel_device::devicenet::{parameter, rows};
use codewheel_devicenet::explicit::{Service, class};

use super::super::line::Line;
use super::explicit::CHOICE;

pub(super) const PARAMETER: u8 = parameter::PARAMETER;
pub(super) const ENCODER_POSITION: u8 = rows::ENCODER_POSITION;

/// How the octets of an attribute are read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Form {
    /// A number, low octet first.
    Unsigned,
    /// A number in the notation of the books, low octet first.
    Hex,
    /// Major and minor revision.
    Revision,
    /// A length and so many letters.
    ShortString,
    /// A path in segments.
    Path,
    /// A value with a name.
    Names(&'static [(u8, &'static str)]),
    /// Bits with names.
    Bits(&'static [(u8, &'static str)]),
    /// The allocation choice and the master's MAC ID.
    Allocation,
    /// The data of an assembly.
    Assembly,
    /// The value of a row.
    Row(&'static rows::Row),
    /// A value in the type of the parameter that it belongs to.
    OfRow(&'static rows::Row),
}

/// An attribute.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attribute {
    pub(super) number: u8,
    name: &'static str,
    /// How many octets it has; 0 where that varies.
    pub(super) octets: usize,
    pub(super) form: Form,
    pub(super) unit: &'static str,
}

impl Attribute {
    const fn new(number: u8, name: &'static str, octets: usize, form: Form) -> Self {
        Self { number, name, octets, form, unit: "" }
    }

    const fn millis(number: u8, name: &'static str) -> Self {
        Self { number, name, octets: 2, form: Form::Unsigned, unit: "ms" }
    }

    pub(super) const fn name(&self) -> &'static str {
        self.name
    }

    /// Whether its name is that of a row of ours, and means nothing on a device of another vendor.
    pub(super) const fn is_ours(&self) -> bool {
        matches!(self.form, Form::Row(_))
    }

    /// Its name as a key of JSON; keys are made of it as of every name.
    pub(super) const fn key(&self) -> &'static str {
        match self.form {
            Form::Row(row) => row.key,
            _ => self.name,
        }
    }
}

use Form::{Allocation, Assembly, Bits, Hex, Names, Path, Revision, ShortString, Unsigned};

const STATES: &[(u8, &str)] = &[
    (0, "nonexistent"),
    (1, "self-testing"),
    (2, "standby"),
    (3, "operational"),
    (4, "major recoverable fault"),
    (5, "major unrecoverable fault"),
];
const STATUS: &[(u8, &str)] = &[
    (0, "owned"),
    (2, "configured"),
    (8, "minor recoverable fault"),
    (9, "minor unrecoverable fault"),
    (10, "major recoverable fault"),
    (11, "major unrecoverable fault"),
];
const IDENTITY: [Attribute; 10] = [
    Attribute::new(1, "vendor", 2, Unsigned),
    Attribute::new(2, "device type", 2, Unsigned),
    Attribute::new(3, "product code", 2, Unsigned),
    Attribute::new(4, "revision", 2, Revision),
    Attribute::new(5, "status", 2, Bits(STATUS)),
    Attribute::new(6, "serial number", 4, Unsigned),
    Attribute::new(7, "product name", 0, ShortString),
    Attribute::new(8, "state", 1, Names(STATES)),
    Attribute::new(9, "configuration consistency value", 2, Unsigned),
    Attribute { number: 10, name: "heartbeat interval", octets: 1, form: Unsigned, unit: "s" },
];

const RATES: &[(u8, &str)] = &[(0, "125k"), (1, "250k"), (2, "500k")];
const CHANGED: &[(u8, &str)] = &[(0, "unchanged"), (1, "changed")];
const DEVICENET: [Attribute; 9] = [
    Attribute::new(1, "MAC ID", 1, Unsigned),
    Attribute::new(2, "baud rate", 1, Names(RATES)),
    Attribute::new(3, "bus-off interrupt", 1, Names(&[(0, "stay off"), (1, "begin anew")])),
    Attribute::new(4, "bus-off counter", 1, Unsigned),
    Attribute::new(5, "allocation", 2, Allocation),
    Attribute::new(6, "MAC ID switch", 1, Names(CHANGED)),
    Attribute::new(7, "baud rate switch", 1, Names(CHANGED)),
    Attribute::new(8, "MAC ID switch value", 1, Unsigned),
    Attribute::new(9, "baud rate switch value", 1, Names(RATES)),
];

const ASSEMBLY: [Attribute; 2] =
    [Attribute::new(3, "data", 0, Assembly), Attribute::new(4, "size", 2, Unsigned)];

const CONNECTION_STATES: &[(u8, &str)] = &[
    (0, "non-existent"),
    (1, "configuring"),
    (2, "waiting for connection ID"),
    (3, "established"),
    (4, "timed out"),
    (5, "deferred delete"),
];
const WATCHDOG_ACTIONS: &[(u8, &str)] =
    &[(0, "time out"), (1, "auto delete"), (2, "auto reset"), (3, "deferred delete")];
const CONNECTION: [Attribute; 15] = [
    Attribute::new(1, "state", 1, Names(CONNECTION_STATES)),
    Attribute::new(2, "instance type", 1, Names(&[(0, "explicit"), (1, "I/O")])),
    Attribute::new(3, "transport class and trigger", 1, Hex),
    Attribute::new(4, "produced connection ID", 2, Hex),
    Attribute::new(5, "consumed connection ID", 2, Hex),
    Attribute::new(6, "initial communication characteristics", 1, Hex),
    Attribute::new(7, "produced connection size", 2, Unsigned),
    Attribute::new(8, "consumed connection size", 2, Unsigned),
    Attribute::millis(9, "expected packet rate"),
    Attribute::new(12, "watchdog action", 1, Names(WATCHDOG_ACTIONS)),
    Attribute::new(13, "produced path length", 2, Unsigned),
    Attribute::new(14, "produced path", 0, Path),
    Attribute::new(15, "consumed path length", 2, Unsigned),
    Attribute::new(16, "consumed path", 0, Path),
    Attribute::millis(17, "production inhibit time"),
];

const ACKNOWLEDGE_HANDLER: [Attribute; 3] = [
    Attribute::millis(1, "acknowledge timer"),
    Attribute::new(2, "retry limit", 1, Unsigned),
    Attribute::new(3, "producing connection instance", 2, Unsigned),
];

const CLASS: [Attribute; 2] = [
    Attribute::new(1, "revision", 2, Unsigned),
    Attribute::new(2, "highest instance", 2, Unsigned),
];
const PARAMETER_CLASS: [Attribute; 3] = [
    Attribute::new(8, "class descriptor", 2, Hex),
    Attribute::new(9, "configuration assembly", 2, Unsigned),
    Attribute::new(10, "language", 1, Unsigned),
];

/// What a connection path's objects are, as far as a device of ours has them.
pub(super) fn attribute(class: u8, instance: u8, number: u8) -> Option<Attribute> {
    let find = |table: &[Attribute]| table.iter().find(|known| known.number == number).copied();
    match (class, instance) {
        (PARAMETER, 0) => find(&CLASS).or_else(|| find(&PARAMETER_CLASS)),
        (_, 0) => find(&CLASS),
        (class::IDENTITY, _) => find(&IDENTITY),
        (class::DEVICENET, _) => find(&DEVICENET),
        (class::ASSEMBLY, _) => find(&ASSEMBLY),
        (class::CONNECTION, _) => find(&CONNECTION),
        (class::ACKNOWLEDGE_HANDLER, _) => find(&ACKNOWLEDGE_HANDLER),
        (ENCODER_POSITION, 1) => rows::Row::find(number).map(of_row),
        (PARAMETER, instance) => {
            let place = usize::from(instance).checked_sub(1)?;
            let row = rows::Row::find(*parameter::LINKS.get(place)?)?;
            if number == 1 { Some(of_row(row)) } else { of_parameter(row, number) }
        }
        _ => None,
    }
}

const fn of_row(row: &'static rows::Row) -> Attribute {
    let octets = row.data_type.octets();
    Attribute {
        number: row.attribute,
        name: row.name,
        octets,
        form: Form::Row(row),
        unit: row.unit,
    }
}

/// An attribute of a parameter other than its value (CIP volume 1, chapter 5).
fn of_parameter(row: &'static rows::Row, number: u8) -> Option<Attribute> {
    let value = row.data_type.octets();
    let (name, octets, form) = match number {
        2 => ("link path size", 1, Unsigned),
        3 => ("link path", 6, Path),
        4 => ("descriptor", 2, Hex),
        5 => ("data type", 1, Hex),
        6 => ("data size", 1, Unsigned),
        7 => ("name", 0, ShortString),
        8 => ("units", 0, ShortString),
        9 => ("help", 0, ShortString),
        10 => ("minimum", value, Form::OfRow(row)),
        11 => ("maximum", value, Form::OfRow(row)),
        12 => ("default", value, Form::OfRow(row)),
        13 => ("scaling multiplier", 2, Unsigned),
        14 => ("scaling divisor", 2, Unsigned),
        15 => ("scaling base", 2, Unsigned),
        16 => ("scaling offset", 2, Unsigned),
        17 => ("multiplier link", 2, Unsigned),
        18 => ("divisor link", 2, Unsigned),
        19 => ("base link", 2, Unsigned),
        20 => ("offset link", 2, Unsigned),
        21 => ("decimals", 1, Unsigned),
        _ => return None,
    };
    Some(Attribute::new(number, name, octets, form))
}

/// The attributes that Get_Attributes_All of this object brings, in their order.
pub(super) fn all(class: u8, instance: u8) -> impl Iterator<Item = Attribute> {
    let numbers = match (class, instance) {
        (class::IDENTITY, 1) => 1..=10,
        (PARAMETER, 1..) => 1..=21,
        // Class attributes: the highest instance, descriptor, configuration assembly, language.
        (PARAMETER, 0) => 2..=10,
        #[expect(clippy::reversed_empty_ranges, reason = "nothing is known of the others")]
        _ => 1..=0,
    };
    numbers.filter_map(move |number| attribute(class, instance, number))
}

/// The name of a class. 2Fh is each vendor's own.
pub(super) const fn class_name(class: u8, is_encoder: bool) -> &'static str {
    match class {
        class::IDENTITY => "Identity",
        class::MESSAGE_ROUTER => "Message Router",
        class::DEVICENET => "DeviceNet",
        class::ASSEMBLY => "Assembly",
        class::CONNECTION => "Connection",
        PARAMETER => "Parameter",
        class::ACKNOWLEDGE_HANDLER => "Acknowledge Handler",
        ENCODER_POSITION if is_encoder => "Encoder Position",
        _ => "class",
    }
}

/// The name of a service, of this class where it depends on that.
pub(super) fn service_name(service: Service, class: Option<u8>) -> Option<&'static str> {
    Some(match (service, class) {
        (Service::GET_ATTRIBUTES_ALL, _) => "Get_Attributes_All",
        (Service::RESET, _) => "Reset",
        (Service::APPLY_ATTRIBUTES, _) => "Apply_Attributes",
        (Service::GET_ATTRIBUTE_SINGLE, _) => "Get_Attribute_Single",
        (Service::SET_ATTRIBUTE_SINGLE, _) => "Set_Attribute_Single",
        (Service::RESTORE, _) => "Restore",
        (Service::SAVE, _) => "Save",
        (Service::ALLOCATE, Some(class::DEVICENET)) => "Allocate_Master/Slave_Connection_Set",
        (Service::RELEASE, Some(class::DEVICENET)) => "Release_Master/Slave_Connection_Set",
        (Service::GET_ENUM_STRING, Some(PARAMETER)) => "Get_Enum_String",
        _ => return None,
    })
}

/// The state of a device, as the Identity object and the heartbeat tell it.
pub(super) fn state(state: u8, line: &mut Line<'_>) {
    match STATES.iter().find(|(value, _)| *value == state) {
        Some((_, name)) => line.word("state", "state", name.as_bytes()),
        None => line.number("state", "state", state.into(), ""),
    }
}

/// The bits of an allocation choice.
pub(super) const fn choices() -> &'static [(u8, &'static str)] {
    &CHOICE
}
