//! Explicit messages: fragments put together, responses paired with their requests.

use std::collections::HashMap;

use codewheel_devicenet::explicit::{GeneralStatus, Header, Service, class};
use codewheel_devicenet::fragment::{Fragment, Kind, Reassembly, Received};
use codewheel_devicenet::{MacId, choice};

use super::super::line::Line;
use super::{Nodes, objects, values};
use crate::{DeviceNetSaid, Said};

/// The longest message that is put together; the longest of ours has 192 octets.
const LONGEST: usize = 512;
/// The service of a heartbeat, with its response bit.
const HEARTBEAT: u8 = 0xCD;

/// What a request asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    pub(super) service: Service,
    pub(super) class: u8,
    pub(super) instance: u8,
    /// Of Get_Attribute_Single and Set_Attribute_Single.
    pub(super) attribute: Option<u8>,
}

/// Who speaks with whom: the slave, and the header of the message without its fragmentation bit, which
/// has the master and the transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Conversation {
    slave: MacId,
    header: u8,
}

/// Everything remembered of explicit messages.
#[derive(Debug, Default)]
pub(super) struct Explicit {
    /// With the data of the request.
    asked: HashMap<Conversation, (Asked, Vec<u8>)>,
    requests: HashMap<Conversation, Box<Reassembly<LONGEST>>>,
    responses: HashMap<Conversation, Box<Reassembly<LONGEST>>>,
}

/// What a frame holds of a message.
enum Part<'a> {
    Whole(&'a [u8]),
    /// A fragment that leaves the message open, or belongs to none.
    Open,
}

impl Explicit {
    /// A message of the master to `slave`: a request, or the acknowledge of a response's fragment.
    pub(super) fn request(
        &mut self,
        slave: MacId,
        data: &[u8],
        kind: &str,
        nodes: &Nodes,
        line: &mut Line<'_>,
    ) {
        let Some((&header, octets)) = data.split_first() else {
            line.ends(None, Some(slave.value()));
            line.message(kind);
            return line.note(&["empty"]);
        };
        let header = Header(header);
        line.ends(Some(header.mac().value()), Some(slave.value()));
        line.message(kind);
        let with = Conversation { slave, header: header.with_fragmented(false).0 };
        let Part::Whole(body) = part(&mut self.requests, with, header, octets, line) else {
            return;
        };
        match *body {
            [service @ 0..0x80, class, instance, ref rest @ ..] => {
                let service = Service(service);
                let names_attribute = matches!(
                    service,
                    Service::GET_ATTRIBUTE_SINGLE | Service::SET_ATTRIBUTE_SINGLE
                );
                let (attribute, rest) = match rest.split_first() {
                    Some((attribute, rest)) if names_attribute => (Some(*attribute), rest),
                    _ => (None, rest),
                };
                let asked = Asked { service, class, instance, attribute };
                let is_encoder = nodes.is_encoder(slave);
                tell(&asked, is_encoder, line);
                request_data(&asked, rest, is_encoder, line);
                self.asked.insert(with, (asked, rest.to_vec()));
            }
            [] => line.note(&["a header and nothing else"]),
            _ => {
                line.octets("data", "data", body);
                line.note(&["no request: a service, a class and an instance are missing"]);
            }
        }
    }

    /// A message of `slave`: a response, a heartbeat, or the acknowledge of a request's fragment.
    pub(super) fn response(
        &mut self,
        slave: MacId,
        data: &[u8],
        nodes: &mut Nodes,
        line: &mut Line<'_>,
    ) {
        let Some((&header, octets)) = data.split_first() else {
            line.ends(Some(slave.value()), None);
            line.message("explicit response");
            return line.note(&["empty"]);
        };
        let header = Header(header);
        if let ([HEARTBEAT, low, high, state, flags, ccv_low, ccv_high], false) =
            (octets, header.fragmented())
        {
            line.ends(Some(slave.value()), None);
            line.message("heartbeat");
            line.number("instance", "instance", u16::from_le_bytes([*low, *high]).into(), "");
            objects::state(*state, line);
            line.bits("flags", "flags", (*flags).into(), &[]);
            let ccv = u16::from_le_bytes([*ccv_low, *ccv_high]);
            let name = "configuration consistency value";
            return line.number(name, name, ccv.into(), "");
        }
        line.ends(Some(slave.value()), Some(header.mac().value()));
        line.message("explicit response");
        let with = Conversation { slave, header: header.with_fragmented(false).0 };
        let Part::Whole(body) = part(&mut self.responses, with, header, octets, line) else {
            return;
        };
        let Some((&service, data)) = body.split_first() else {
            return line.note(&["a header and nothing else"]);
        };
        let (asked, request) = self.asked.remove(&with).unzip();
        if service == Service::ERROR.response() {
            return refusal(asked.as_ref(), data, nodes.is_encoder(slave), line);
        }
        match asked {
            Some(asked) if asked.service.response() == service => {
                line.said(Said::DeviceNet(DeviceNetSaid::Done {
                    slave: slave.value(),
                    master: header.mac().value(),
                    service: asked.service.0,
                    class: asked.class,
                    instance: asked.instance,
                    attribute: asked.attribute,
                    request: request.as_deref().unwrap_or_default(),
                    response: data,
                }));
                tell(&asked, nodes.is_encoder(slave), line);
                response_data(slave, &asked, data, nodes, line);
            }
            _ => {
                let name = objects::service_name(Service(service & 0x7F), None);
                service_word(Service(service & 0x7F), name, line);
                line.octets("data", "data", data);
                line.note(&[if service < 0x80 {
                    "no response: its service has no response bit"
                } else {
                    "its request was not seen"
                }]);
            }
        }
    }
}

/// Puts a fragment where it belongs.
fn part<'a>(
    open: &'a mut HashMap<Conversation, Box<Reassembly<LONGEST>>>,
    with: Conversation,
    header: Header,
    octets: &'a [u8],
    line: &mut Line<'_>,
) -> Part<'a> {
    if !header.fragmented() {
        // It ends whatever was being put together.
        if !open.is_empty() {
            open.remove(&with);
        }
        return Part::Whole(octets);
    }
    let Some((&fragment, octets)) = octets.split_first() else {
        line.note(&["a fragment without its number"]);
        return Part::Open;
    };
    let fragment = Fragment::from_octet(fragment);
    let name = match fragment.kind {
        Kind::First => "first fragment",
        Kind::Middle => "middle fragment",
        Kind::Last => "last fragment",
        Kind::Acknowledge => "acknowledge of fragment",
    };
    line.fragment(name, fragment.count);
    if fragment.kind == Kind::Acknowledge {
        match octets {
            [0] => {}
            [1] => line.note(&["too much data"]),
            _ => line.octets("status", "status", octets),
        }
        return Part::Open;
    }
    let message = open.entry(with).or_default();
    match message.push(fragment, octets) {
        Received::Complete => return Part::Whole(message.body()),
        Received::Taken => line.octets("data", "data", octets),
        Received::Dropped => {
            line.octets("data", "data", octets);
            line.note(&["it belongs to no message that was begun"]);
        }
        Received::TooMuch => line.note(&["longer than 512 octets"]),
    }
    Part::Open
}

/// Service and object.
fn tell(asked: &Asked, is_encoder: bool, line: &mut Line<'_>) {
    let Asked { service, class, instance, attribute } = *asked;
    service_word(service, objects::service_name(service, Some(class)), line);
    let object = objects::class_name(class, is_encoder);
    match attribute {
        Some(attribute) => {
            let known = objects::attribute(class, instance, attribute);
            match known.filter(|known| is_encoder || !known.is_ours()) {
                Some(known) => line.attribute("object", &[object, " ", known.name()]),
                None => line.attribute("object", &[object]),
            }
            line.path("path", &[class, instance, attribute]);
        }
        None => {
            line.attribute("object", &[object]);
            line.path("path", &[class, instance]);
        }
    }
}

fn service_word(service: Service, name: Option<&str>, line: &mut Line<'_>) {
    match name {
        Some(name) => line.attribute("service", &[name]),
        None => line.attribute_code("service", service.0),
    }
}

fn request_data(asked: &Asked, data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    match (asked.service, asked.class, asked.attribute) {
        (Service::ALLOCATE, class::DEVICENET, _) => match *data {
            [wanted, master] => {
                line.bits("choice", "choice", wanted.into(), &CHOICE);
                line.number("master", "master", master.into(), "");
            }
            _ => line.octets("data", "data", data),
        },
        (Service::RELEASE, class::DEVICENET, _) => match *data {
            [released] => line.bits("choice", "choice", released.into(), &CHOICE),
            _ => line.octets("data", "data", data),
        },
        (Service::RESET, class::IDENTITY, _) => match *data {
            [kind] => line.number("type", "type", kind.into(), ""),
            _ => line.octets("data", "data", data),
        },
        (_, class, Some(attribute)) => {
            values::told_attribute(class, asked.instance, attribute, data, is_encoder, line);
        }
        _ => line.octets("data", "data", data),
    }
}

fn response_data(slave: MacId, asked: &Asked, data: &[u8], nodes: &mut Nodes, line: &mut Line<'_>) {
    let Asked { service, class, instance, attribute } = *asked;
    if (service, class, attribute) == (Service::GET_ATTRIBUTE_SINGLE, class::IDENTITY, Some(1))
        && instance == 1
        && let &[low, high] = data
    {
        nodes.learn(slave, u16::from_le_bytes([low, high]));
    }
    let is_encoder = nodes.is_encoder(slave);
    match (service, class, attribute) {
        (Service::ALLOCATE, class::DEVICENET, _) => match *data {
            [0] => line.word("body-format", "body format", b"8/8"),
            _ => line.octets("data", "data", data),
        },
        (Service::GET_ATTRIBUTES_ALL, _, _) => {
            if (class, instance) == (class::IDENTITY, 1)
                && let &[low, high, ..] = data
            {
                nodes.learn(slave, u16::from_le_bytes([low, high]));
            }
            values::all_attributes(class, instance, data, is_encoder, line);
        }
        (Service::GET_ENUM_STRING, objects::PARAMETER, _) => {
            values::short_string("name", "name", data, line)
        }
        (Service::APPLY_ATTRIBUTES, class::CONNECTION, _) => match *data {
            [a, b, c, d] => {
                line.hex("produced-connection-id", "produced connection ID", &[b, a]);
                line.hex("consumed-connection-id", "consumed connection ID", &[d, c]);
            }
            _ => line.octets("data", "data", data),
        },
        (_, _, Some(attribute)) => {
            values::told_attribute(class, instance, attribute, data, is_encoder, line);
        }
        _ => line.octets("data", "data", data),
    }
}

fn refusal(asked: Option<&Asked>, data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    if let Some(asked) = asked {
        tell(asked, is_encoder, line);
    }
    let [general, additional, rest @ ..] = data else {
        line.octets("error", "error", data);
        return line.note(&["too short"]);
    };
    line.hex("error", "error", &[*general]);
    line.word("error-name", "", GeneralStatus(*general).name().as_bytes());
    if *additional != 0xFF {
        line.hex("additional-code", "additional code", &[*additional]);
    }
    let is_allocation = asked.is_some_and(|asked| {
        asked.class == class::DEVICENET
            && matches!(asked.service, Service::ALLOCATE | Service::RELEASE)
    });
    let meaning = match (*general, *additional) {
        (0x0C, 1) if is_allocation => Some("another master owns the connection set"),
        (0x02, 3) => Some("the unconnected port takes Allocate and Release alone"),
        (_, 2) if is_allocation => Some("the choice is invalid here"),
        (0x09, 0x11) => Some("the production inhibit time exceeds the expected packet rate"),
        _ => None,
    };
    line.octets("data", "data", rest);
    if let Some(meaning) = meaning {
        line.note(&[meaning]);
    }
    if asked.is_none() {
        line.note(&["its request was not seen"]);
    }
}

/// The bits of the allocation and release choice.
pub(super) const CHOICE: [(u8, &str); 7] = [
    (choice::EXPLICIT.trailing_zeros() as u8, "explicit"),
    (choice::POLL.trailing_zeros() as u8, "poll"),
    (choice::BIT_STROBE.trailing_zeros() as u8, "bit-strobe"),
    (choice::MULTICAST_POLL.trailing_zeros() as u8, "multicast poll"),
    (choice::CHANGE_OF_STATE.trailing_zeros() as u8, "change of state"),
    (choice::CYCLIC.trailing_zeros() as u8, "cyclic"),
    (choice::ACKNOWLEDGE_SUPPRESSION.trailing_zeros() as u8, "acknowledge suppression"),
];
