//! What the frames of a DeviceNet segment say.

mod explicit;
mod objects;
mod values;

use codewheel_device::Factory;
use codewheel_devicenet::{CheckMessage, Identifier, MacId, identifier};
use codewheel_station::can::{Frame, Identifier as CanIdentifier};

use self::explicit::Explicit;
use super::Assume;
use super::line::Line;
use crate::{DeviceNetSaid, Said};

/// Everything remembered of a segment.
#[derive(Debug)]
pub(super) struct DeviceNet {
    explicit: Explicit,
    nodes: Nodes,
}

/// Which nodes are encoders of ours.
#[derive(Debug)]
struct Nodes {
    assume: Assume,
    /// What each node has said its vendor is.
    vendors: [Option<u16>; 64],
}

impl Nodes {
    fn is_encoder(&self, mac: MacId) -> bool {
        match self.vendors.get(usize::from(mac.value())).copied().flatten() {
            Some(vendor) => vendor == Factory::with_serial(0).vendor,
            None => self.assume == Assume::Encoders,
        }
    }

    fn learn(&mut self, mac: MacId, vendor: u16) {
        if let Some(known) = self.vendors.get_mut(usize::from(mac.value())) {
            *known = Some(vendor);
        }
    }
}

impl DeviceNet {
    pub(super) fn new(assume: Assume) -> Self {
        Self { explicit: Explicit::default(), nodes: Nodes { assume, vendors: [None; 64] } }
    }

    pub(super) fn decode(&mut self, frame: &Frame, line: &mut Line<'_>) {
        let CanIdentifier::Standard(bits) = frame.identifier() else {
            return line.message("no DeviceNet: an extended identifier");
        };
        if frame.is_remote() {
            return line.message("no DeviceNet: a remote frame");
        }
        let data = frame.data();
        match Identifier::from_bits(bits) {
            Identifier::Group1 { message, source } => self.group_1(message, source, data, line),
            Identifier::Group2 { mac, message } => self.group_2(mac, message, data, line),
            Identifier::Group3 { message, source } => {
                line.ends(Some(source.value()), None);
                match message {
                    5 => line.message("unconnected response (UCMM)"),
                    6 => line.message("unconnected request (UCMM)"),
                    _ => numbered(line, "group 3 message", message),
                }
                line.octets("data", "data", data);
            }
            Identifier::Group4 { message } => {
                match message {
                    0x2C => line.message("communication faulted response"),
                    0x2D => line.message("communication faulted request"),
                    0x2E => line.message("off-line ownership response"),
                    0x2F => line.message("off-line ownership request"),
                    _ => numbered(line, "group 4 message", message),
                }
                line.octets("data", "data", data);
            }
            Identifier::Invalid(_) => {
                line.message("no DeviceNet: an invalid identifier");
                line.octets("data", "data", data);
            }
        }
    }

    fn group_1(&mut self, message: u8, source: MacId, data: &[u8], line: &mut Line<'_>) {
        line.ends(Some(source.value()), None);
        match message {
            12 => line.message("multicast poll response"),
            identifier::CHANGE_OF_STATE_MESSAGE => line.message("change of state or cyclic"),
            14 => line.message("bit-strobe response"),
            // A slave answers a master's change of state with the same message, and then empty.
            identifier::POLL_RESPONSE if data.is_empty() => {
                line.message("poll response, or acknowledge of a change of state");
            }
            identifier::POLL_RESPONSE => line.message("poll response"),
            _ => {
                numbered(line, "group 1 message", message);
                return line.octets("data", "data", data);
            }
        }
        if !data.is_empty() {
            line.said(Said::DeviceNet(DeviceNetSaid::Produced { slave: source.value(), data }));
        }
        values::produced(data, self.nodes.is_encoder(source), line);
    }

    fn group_2(&mut self, mac: MacId, message: u8, data: &[u8], line: &mut Line<'_>) {
        let to = Some(mac.value());
        match message {
            identifier::DUPLICATE_MAC_CHECK => self.duplicate_check(mac, data, line),
            identifier::EXPLICIT_RESPONSE => {
                self.explicit.response(mac, data, &mut self.nodes, line);
            }
            identifier::EXPLICIT_REQUEST => {
                self.explicit.request(mac, data, "explicit request", &self.nodes, line);
            }
            identifier::UNCONNECTED_REQUEST => {
                self.explicit.request(mac, data, "unconnected request", &self.nodes, line);
            }
            identifier::POLL_COMMAND => {
                line.ends(None, to);
                line.message("poll command");
                line.octets("data", "data", data);
            }
            identifier::CHANGE_ACKNOWLEDGE => {
                line.ends(None, to);
                line.message("acknowledge of change of state or cyclic");
                line.octets("data", "data", data);
            }
            // 0 and 1; three bits have no more.
            0 => {
                line.ends(to, None);
                line.message("bit-strobe command");
                line.octets("data", "data", data);
            }
            _ => {
                line.ends(to, None);
                line.message("multicast poll command");
                line.octets("data", "data", data);
            }
        }
    }

    fn duplicate_check(&mut self, mac: MacId, data: &[u8], line: &mut Line<'_>) {
        line.ends(Some(mac.value()), None);
        match CheckMessage::parse(data) {
            Ok(CheckMessage { response, port, vendor, serial }) => {
                line.message(match response {
                    false => "duplicate MAC ID check request",
                    true => "duplicate MAC ID check response",
                });
                if port != 0 {
                    line.number("port", "port", port.into(), "");
                }
                line.number("vendor", "vendor", vendor.into(), "");
                line.number("serial-number", "serial number", serial.into(), "");
                let said = DeviceNetSaid::DuplicateCheck { mac: mac.value(), vendor, serial };
                line.said(Said::DeviceNet(said));
                self.nodes.learn(mac, vendor);
            }
            Err(_) => {
                line.message("duplicate MAC ID check");
                line.octets("data", "data", data);
                line.note(&["too short"]);
            }
        }
    }
}

/// A message that has a number and no name.
fn numbered(line: &mut Line<'_>, kind: &str, number: u8) {
    line.message(kind);
    line.number("number", "", number.into(), "");
}
