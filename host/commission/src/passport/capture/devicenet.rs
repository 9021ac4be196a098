//! What DeviceNet traffic tells of encoders.

use std::collections::BTreeMap;

use codewheel_capture::{DeviceNetSaid, Timestamp};
use codewheel_device::devicenet::parameter::{LINKS, PARAMETER};
use codewheel_device::devicenet::rows::{DataType, ENCODER_POSITION, ROWS, Row, Source};
use codewheel_device::product::{Bus, DEVICENET};
use codewheel_device::{Factory, Product};
use codewheel_devicenet::choice;
use codewheel_devicenet::explicit::{Service, class};

use super::super::take::told_revolutions;
use super::super::{Nameplate, Passport, Position, Setting};
use super::{Seen, absent, blank, number};

// Attributes of class 2Fh (AMG manual §8).
const DIRECTION: u8 = 3;
const STEPS_PER_TURN: u8 = 7;
const TOTAL_RESOLUTION: u8 = 8;
const PRESET: u8 = 10;
const POSITION: u8 = 12;
const SINGLETURN_RESOLUTION: u8 = 81;
const REVOLUTIONS: u8 = 82;
const VERSION: u8 = 89;
const OFFSET: u8 = 91;

// Attributes of the Identity object (CIP volume 1, chapter 5).
const VENDOR: u8 = 1;
const DEVICE_TYPE: u8 = 2;
const PRODUCT_CODE: u8 = 3;
const REVISION: u8 = 4;
const SERIAL: u8 = 6;
const PRODUCT_NAME: u8 = 7;

/// Instances of the Connection object: explicit, poll, change of state or cyclic.
const CONNECTIONS: [u8; 3] = [1, 2, 4];
const EXPECTED_PACKET_RATE: u8 = 9;
const PRODUCED_PATH: u8 = 14;

/// The settings of the bus, as a session names them, and where they lie (AMG manual §5 to §7).
const BUS_SETTINGS: [(&str, (u8, u8, u8), &str); 4] = [
    ("heartbeat-interval", (class::IDENTITY, 1, 10), "s: Heartbeat interval"),
    ("bus-off-interrupt", (class::DEVICENET, 1, 3), "Bus-off interrupt"),
    ("poll-assembly", (class::CONNECTION, 2, PRODUCED_PATH), "Produced path, poll"),
    (
        "change-assembly",
        (class::CONNECTION, 4, PRODUCED_PATH),
        "Produced path, change of state and cyclic",
    ),
];

/// What was said on a segment.
#[derive(Default)]
pub(super) struct DeviceNetTraces {
    pub(super) bit_rate: Option<u32>,
    nodes: BTreeMap<u8, Node>,
}

/// What was said of one node.
#[derive(Default)]
struct Node {
    first: Option<Timestamp>,
    last: Timestamp,
    plate: Nameplate,
    /// The attributes of class 2Fh.
    attributes: BTreeMap<u8, i64>,
    /// Octets of other settings, by class, instance and attribute.
    others: BTreeMap<(u8, u8, u8), Vec<u8>>,
    choice: u8,
    /// It has answered something that only encoders know.
    is_encoder: bool,
    seen: Seen,
}

impl DeviceNetTraces {
    pub(super) fn take_in(&mut self, at: Timestamp, said: &DeviceNetSaid<'_>) {
        let (DeviceNetSaid::DuplicateCheck { mac: address, .. }
        | DeviceNetSaid::Done { slave: address, .. }
        | DeviceNetSaid::Produced { slave: address, .. }) = *said;
        let node = self.nodes.entry(address).or_default();
        node.first.get_or_insert(at);
        node.last = at;
        match *said {
            DeviceNetSaid::DuplicateCheck { vendor, serial, .. } => {
                node.plate.vendor = Some(vendor);
                node.plate.serial = Some(serial);
            }
            DeviceNetSaid::Produced { data, .. } => node.produced(at, data),
            DeviceNetSaid::Done {
                service, class, instance, attribute, request, response, ..
            } => {
                let service = Service(service);
                match (service, attribute) {
                    (Service::GET_ATTRIBUTE_SINGLE, Some(attribute)) => {
                        node.value(at, (class, instance, attribute), response);
                    }
                    (Service::SET_ATTRIBUTE_SINGLE, Some(attribute)) => {
                        node.set(at, (class, instance, attribute), request, response);
                    }
                    _ => node.served(service, class, request, response),
                }
            }
        }
    }

    pub(super) fn passports(&self, program: &str) -> Vec<Passport> {
        let of_ours = self.nodes.iter().filter(|(_, node)| node.is_ours());
        of_ours.map(|(address, node)| node.passport(*address, self.bit_rate, program)).collect()
    }
}

/// A number of at most four octets, the low one first.
fn unsigned(octets: &[u8]) -> u32 {
    octets.iter().take(4).rev().fold(0, |value, octet| value << 8 | u32::from(*octet))
}

/// The number that `octets` are in the type of `row`; `None` where they are of another length.
fn number_of(row: &Row, octets: &[u8]) -> Option<i64> {
    if octets.is_empty() || octets.len() != row.data_type.octets() {
        return None;
    }
    let bits = unsigned(octets);
    Some(match row.data_type {
        DataType::Dint => i64::from(bits.cast_signed()),
        _ => i64::from(bits),
    })
}

/// The attribute of class 2Fh that is meant, also through the Parameter object.
fn linked((class, instance, attribute): (u8, u8, u8)) -> Option<&'static Row> {
    match (class, instance, attribute) {
        (ENCODER_POSITION, 1, attribute) => Row::find(attribute),
        (PARAMETER, instance, 1) => {
            let place = usize::from(instance).checked_sub(1)?;
            Row::find(*LINKS.get(place)?)
        }
        _ => None,
    }
}

impl Node {
    /// Whether it is one of our encoders: it says so by its vendor, and produces or knows what one does.
    fn is_ours(&self) -> bool {
        let ours = Factory::with_serial(0).vendor;
        let code = self.plate.product_code;
        let is_code =
            code.is_some_and(|code| DEVICENET.iter().any(|one| one.product_code() == code));
        self.plate.vendor.is_none_or(|vendor| vendor == ours)
            && code.is_none_or(|_| is_code)
            && (self.is_encoder || is_code)
    }

    /// Assembly 1 or 2.
    fn produced(&mut self, at: Timestamp, data: &[u8]) {
        if let [a, b, c, d] | [a, b, c, d, _] = *data {
            self.is_encoder = true;
            self.seen.add(at, u32::from_le_bytes([a, b, c, d]));
        }
    }

    /// A value as it is read.
    fn value(&mut self, at: Timestamp, path: (u8, u8, u8), data: &[u8]) {
        if let Some(row) = linked(path) {
            self.is_encoder = true;
            let Some(number) = number_of(row, data) else { return };
            if row.attribute == POSITION {
                if let Ok(position) = u32::try_from(number) {
                    self.seen.add(at, position);
                }
            } else {
                self.attributes.insert(row.attribute, number);
            }
            return;
        }
        let is_bus_setting = BUS_SETTINGS.iter().any(|(_, place, _)| *place == path);
        if is_bus_setting || matches!(path, (class::CONNECTION, _, EXPECTED_PACKET_RATE)) {
            self.others.insert(path, data.to_vec());
        } else if let (class::IDENTITY, 1, attribute) = path {
            self.identity(attribute, data);
        }
    }

    fn identity(&mut self, attribute: u8, data: &[u8]) {
        let plate = &mut self.plate;
        match (attribute, data) {
            (VENDOR, &[low, high]) => plate.vendor = Some(u16::from_le_bytes([low, high])),
            (DEVICE_TYPE, &[low, high]) => {
                plate.device_type = Some(u16::from_le_bytes([low, high]))
            }
            (PRODUCT_CODE, &[low, high]) => {
                plate.product_code = Some(u16::from_le_bytes([low, high]));
            }
            (REVISION, &[major, minor]) => plate.revision = Some((major, minor)),
            (SERIAL, &[a, b, c, d]) => plate.serial = Some(u32::from_le_bytes([a, b, c, d])),
            (PRODUCT_NAME, [length, letters @ ..]) if letters.len() == usize::from(*length) => {
                plate.product_name = Some(String::from_utf8_lossy(letters).into_owned());
            }
            _ => {}
        }
    }

    /// A value that was written. What it overthrows is no longer known, unless it is read again.
    fn set(&mut self, at: Timestamp, path: (u8, u8, u8), data: &[u8], granted: &[u8]) {
        let Some(row) = linked(path) else {
            // Timers are granted in whole ticks, and say so.
            return self.value(at, path, if granted.is_empty() { data } else { granted });
        };
        let Some(number) = number_of(row, data) else { return };
        self.is_encoder = true;
        let is_same = self.attributes.insert(row.attribute, number) == Some(number);
        let overthrown: &[u8] = match row.attribute {
            _ if is_same && row.attribute != PRESET => &[],
            DIRECTION | TOTAL_RESOLUTION => &[PRESET, OFFSET],
            STEPS_PER_TURN => &[TOTAL_RESOLUTION, PRESET, OFFSET],
            PRESET => &[OFFSET],
            _ => &[],
        };
        for attribute in overthrown {
            self.attributes.remove(attribute);
        }
        if !overthrown.is_empty() {
            self.seen = Seen::default();
        }
    }

    fn served(&mut self, service: Service, class: u8, request: &[u8], response: &[u8]) {
        match (service, class) {
            (Service::ALLOCATE, class::DEVICENET) => {
                self.choice |= request.first().copied().unwrap_or_default();
            }
            (Service::RESTORE | Service::RESET, ENCODER_POSITION | PARAMETER | class::IDENTITY) => {
                for row in ROWS.iter().filter(|row| is_kept(row) || row.attribute == OFFSET) {
                    self.attributes.remove(&row.attribute);
                }
                self.seen = Seen::default();
            }
            (Service::GET_ATTRIBUTES_ALL, class::IDENTITY) => self.all_of_identity(response),
            _ => {}
        }
    }

    /// Get_Attributes_All of the Identity object: its attributes one behind the other.
    fn all_of_identity(&mut self, data: &[u8]) {
        let mut rest = data;
        for (attribute, length) in
            [(VENDOR, 2), (DEVICE_TYPE, 2), (PRODUCT_CODE, 2), (REVISION, 2), (5, 2), (SERIAL, 4)]
        {
            let Some((value, behind)) = rest.split_at_checked(length) else { return };
            self.identity(attribute, value);
            rest = behind;
        }
        let length = rest.first().map_or(0, |length| usize::from(*length) + 1);
        self.identity(PRODUCT_NAME, rest.get(..length).unwrap_or_default());
    }

    fn models(&self) -> Vec<&'static Product> {
        let (code, name) = (self.plate.product_code, self.plate.product_name.as_deref());
        if code.is_none() && name.is_none() {
            return Vec::new();
        }
        let fits = |product: &&'static Product| {
            code.is_none_or(|code| product.product_code() == code)
                && name.is_none_or(|name| product.product_name == name)
        };
        DEVICENET.iter().filter(fits).collect()
    }

    fn plate(&self) -> Nameplate {
        let mut plate = self.plate.clone();
        plate.models = self.models();
        let of_models = |of: fn(&Product) -> u32| {
            let (first, rest) = plate.models.split_first()?;
            rest.iter().all(|other| of(other) == of(first)).then_some(of(first))
        };
        let disc = self.attributes.get(&SINGLETURN_RESOLUTION);
        let turns = self.attributes.get(&REVOLUTIONS);
        let disc = disc
            .and_then(|disc| u32::try_from(*disc).ok())
            .or_else(|| of_models(|product| product.encoder.geometry.singleturn_resolution()));
        let turns = turns
            .and_then(|turns| told_revolutions(*turns))
            .or_else(|| of_models(|product| product.encoder.geometry.revolutions()));
        plate.singleturn_resolution = disc;
        plate.revolutions = turns;
        let version = self.attributes.get(&VERSION);
        plate.firmware = version.map(|version| {
            let software = version >> 16;
            format!("{:x}.{:02x}", software >> 8 & 0xFF, software & 0xFF)
        });
        plate
    }

    fn passport(&self, address: u8, bit_rate: Option<u32>, program: &str) -> Passport {
        let mut passport = blank(Bus::DeviceNet, address, bit_rate, self.last, program);
        let plate = self.plate();
        let kept = || ROWS.iter().filter(|row| is_kept(row) && row.attribute != PRESET);
        for row in kept() {
            if let Some(value) = self.value_of(row, &plate) {
                passport.settings.push(number(row.key, value, note(row, value)));
            }
        }
        passport.settings.extend(self.bus_settings());
        passport.position = Position {
            preset: self.attributes.get(&PRESET).copied(),
            offset: self.attributes.get(&OFFSET).copied(),
            steps: self.seen.last,
            at_rest: self.seen.at_rest(self.first),
        };
        passport.project.allocation = allocation(self.choice);
        let rate = |instance| {
            let octets = self.others.get(&(class::CONNECTION, instance, EXPECTED_PACKET_RATE))?;
            Some(unsigned(octets.get(..2)?) as u16)
        };
        let [explicit, poll, change_of_state] = CONNECTIONS.map(rate);
        let rates = &mut passport.project.expected_packet_rates;
        (rates.explicit, rates.poll, rates.change_of_state) = (explicit, poll, change_of_state);
        let is_set = |name: &str| passport.setting(name).is_some();
        let identity = [
            ("identity.vendor", plate.vendor.is_some()),
            ("identity.device-type", plate.device_type.is_some()),
            ("identity.product-code", plate.product_code.is_some()),
            ("identity.revision", plate.revision.is_some()),
            ("identity.serial", plate.serial.is_some()),
            ("identity.product-name", plate.product_name.is_some()),
            ("identity.firmware", plate.firmware.is_some()),
        ];
        let mut missing = absent(identity);
        let settings = kept().map(|row| row.key).filter(|key| !is_set(key));
        missing.extend(settings.map(|key| format!("settings.{key}")));
        missing.extend(absent([
            ("position.offset", passport.position.offset.is_some()),
            ("position.steps", passport.position.steps.is_some()),
            ("position.at-rest", passport.position.at_rest.is_some()),
        ]));
        passport.absent = missing;
        passport.nameplate = plate;
        passport.derive_project();
        passport
    }

    fn bus_settings(&self) -> impl Iterator<Item = Setting> {
        BUS_SETTINGS.iter().filter_map(|(name, path, note)| {
            let value = match **self.others.get(path)? {
                [value] => value,
                // A path: class 04, the instance of the assembly, in the long form its attribute.
                [0x20, 0x04, 0x24, assembly] | [0x20, 0x04, 0x24, assembly, 0x30, 0x03] => assembly,
                _ => return None,
            };
            Some(number(name, value.into(), (*note).to_owned()))
        })
    }

    /// What was said of a row, or follows: on a singleturn encoder T is n (AMG manual §4, note).
    fn value_of(&self, row: &Row, plate: &Nameplate) -> Option<i64> {
        let told = self.attributes.get(&row.attribute).copied();
        match row.attribute {
            TOTAL_RESOLUTION if plate.revolutions == Some(1) => {
                told.or_else(|| self.attributes.get(&STEPS_PER_TURN).copied())
            }
            _ => told,
        }
    }
}

/// Whether people set it.
fn is_kept(row: &Row) -> bool {
    row.source == Source::Parameter && row.write.is_some()
}

fn note(row: &Row, value: i64) -> String {
    let label = usize::try_from(value).ok().and_then(|value| row.values.get(value)).copied();
    match label.unwrap_or(row.unit) {
        "" => row.name.to_owned(),
        before => format!("{before}: {}", row.name),
    }
}

fn allocation(wanted: u8) -> Vec<String> {
    let names = [
        (choice::EXPLICIT, "explicit"),
        (choice::POLL, "poll"),
        (choice::BIT_STROBE, "bit-strobe"),
        (choice::MULTICAST_POLL, "multicast poll"),
        (choice::CHANGE_OF_STATE, "change of state"),
        (choice::CYCLIC, "cyclic"),
        (choice::ACKNOWLEDGE_SUPPRESSION, "acknowledge suppression"),
    ];
    let set = names.into_iter().filter(|(bit, _)| wanted & bit != 0);
    set.map(|(_, name)| name.to_owned()).collect()
}
