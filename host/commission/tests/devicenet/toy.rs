//! A device nobody knows: a drive with three parameters, which it tells by its Parameter object.

use std::collections::VecDeque;

use codewheel_devicenet::explicit::{Error, GeneralStatus, Path, Service};
use codewheel_devicenet::{
    Application, Class, Done, Event, Identity, MacId, NetworkSettings, Request, Reset, Server,
    SwitchPositions,
};
use codewheel_station::can::{self, BitRate, Frame, Identifier};
use codewheel_station::{Duration, Instant, Station, Writer};

const PARAMETER: u8 = 0x0F;
const ENCODER_POSITION: u8 = 0x2F;

/// What a drive knows of one of its parameters.
struct Row {
    name: &'static str,
    unit: &'static str,
    descriptor: u16,
    data_type: u8,
    octets: usize,
    minimum: i32,
    maximum: i32,
}

const LABEL: usize = 3;

/// A ramp in ms, the torque of now, a mode with names, a label, a gain with a fraction, and a supply
/// in tenths of a volt.
const ROWS: [Row; 6] = [
    Row {
        name: "Ramp",
        unit: "ms",
        descriptor: 0,
        data_type: 0xC7,
        octets: 2,
        minimum: 10,
        maximum: 5_000,
    },
    Row {
        name: "Torque",
        unit: "%",
        descriptor: 1 << 4 | 1 << 5,
        data_type: 0xC3,
        octets: 2,
        minimum: 0,
        maximum: 0,
    },
    Row {
        name: "Mode",
        unit: "",
        descriptor: 1 << 1,
        data_type: 0xC6,
        octets: 1,
        minimum: 0,
        maximum: 1,
    },
    Row {
        name: "Label",
        unit: "",
        descriptor: 0,
        data_type: 0xDA,
        octets: 0,
        minimum: 0,
        maximum: 0,
    },
    Row {
        name: "Gain",
        unit: "",
        descriptor: 0,
        data_type: 0xCA,
        octets: 4,
        minimum: 0,
        maximum: i32::MAX,
    },
    Row {
        name: "Supply",
        unit: "V",
        descriptor: 1 << 2,
        data_type: 0xC7,
        octets: 2,
        minimum: 0,
        maximum: 400,
    },
];
const MODES: [&str; 2] = ["Coast", "Brake"];

#[derive(Clone, Debug)]
pub(crate) struct Drive {
    pub(crate) values: [i32; 6],
    pub(crate) label: Vec<u8>,
    /// Whether it has a Parameter object.
    tells: bool,
    /// Whether it says that it is an encoder, which takes a preset and has no assembly with flags.
    is_encoder: bool,
    pub(crate) preset: Vec<u8>,
}

#[derive(Clone, Debug)]
pub(crate) struct Toy {
    pub(crate) server: Server,
    pub(crate) drive: Drive,
    /// How it wants class and instance: the message body format.
    pub(crate) format: u8,
    /// How long it takes for an answer over the explicit connection.
    pub(crate) takes: Duration,
    late: VecDeque<(Instant, Frame)>,
}

impl Toy {
    pub(crate) fn new(address: u8) -> Self {
        let mac = MacId::new(address).expect("0 to 63");
        let server = Server::new(mac, BitRate::Kbit500, NetworkSettings::default());
        let gain = 0.5_f32.to_bits().cast_signed();
        let drive = Drive {
            values: [200, -7, 1, 0, gain, 237],
            label: b"press 3".into(),
            tells: true,
            is_encoder: false,
            preset: Vec::new(),
        };
        Self { server, drive, format: 0, takes: Duration::ZERO, late: VecDeque::new() }
    }

    /// One that says it is an encoder of ours, and takes a preset that it does not tell back.
    pub(crate) fn encoder(address: u8) -> Self {
        let mut toy = Self::new(address);
        toy.drive.is_encoder = true;
        toy
    }

    /// One without a Parameter object.
    pub(crate) fn taciturn(address: u8) -> Self {
        let mut toy = Self::new(address);
        toy.drive.tells = false;
        toy
    }
}

fn text(text: &str, out: &mut Writer<'_>) {
    out.u8(text.len() as u8).expect("room");
    out.octets(text.as_bytes()).expect("room");
}

impl Drive {
    fn row(instance: u8) -> Result<(usize, &'static Row), Error> {
        let place = usize::from(instance).wrapping_sub(1);
        let row = ROWS.get(place).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
        Ok((place, row))
    }
}

impl Application for Drive {
    fn identity(&self) -> Identity {
        Identity {
            vendor: 0x0123,
            device_type: 2,
            // The same as that of our multiturn encoders: it says nothing without a vendor.
            product_code: 0x0A,
            major_revision: 3,
            minor_revision: 4,
            serial: 42,
            product_name: if self.is_encoder { "AMG 11 - Multiturn" } else { "Toy drive" },
        }
    }
    fn switches(&self) -> SwitchPositions {
        SwitchPositions { mac: 9, bit_rate: BitRate::Kbit500 }
    }
    fn assembly_size(&self, instance: u8) -> Option<usize> {
        (instance == 1).then_some(2)
    }
    fn produce(&mut self, _: Instant, _: u8, _: &mut [u8; 8]) -> usize {
        2
    }
    fn highest_assembly(&self) -> u8 {
        1
    }
    fn has_changed(&mut self, _: u8) -> bool {
        false
    }
    fn change_produced(&mut self, _: u8) {}
    fn class(&self, class: u8) -> Option<Class> {
        if class == ENCODER_POSITION && self.is_encoder {
            return Some(Class { revision: 1, max_instance: 1 });
        }
        (class == PARAMETER && self.tells).then_some(Class { revision: 1, max_instance: 6 })
    }
    fn get(&mut self, _: Instant, path: Path, out: &mut Writer<'_>) -> Result<(), Error> {
        if path.class == ENCODER_POSITION {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into());
        }
        if path.instance == 0 {
            if path.attribute != 8 {
                return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into());
            }
            out.u16_le(0x000B).expect("room");
            return Ok(());
        }
        let (place, row) = Self::row(path.instance)?;
        let mut number = |number: i32| {
            out.octets(&number.to_le_bytes()[..row.octets]).expect("room");
        };
        match path.attribute {
            1 if place == LABEL => {
                out.u8(self.label.len() as u8).expect("room");
                out.octets(&self.label).expect("room");
            }
            1 => number(self.values[place]),
            4 => out.u16_le(row.descriptor).expect("room"),
            5 => out.u8(row.data_type).expect("room"),
            6 => out.u8(row.octets as u8).expect("room"),
            7 => text(row.name, out),
            8 => text(row.unit, out),
            9 => text("What a drive has", out),
            10 => number(row.minimum),
            11 => number(row.maximum),
            // 237 are 23.7 V.
            13 | 15 => out.u16_le(1).expect("room"),
            14 => out.u16_le(10).expect("room"),
            16 => out.u16_le(0).expect("room"),
            21 => out.u8(1).expect("room"),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.into()),
        }
        Ok(())
    }
    fn set(&mut self, _: Instant, path: Path, data: &[u8]) -> Result<Done, Error> {
        if path.class == ENCODER_POSITION {
            self.preset = data.to_vec();
            return Ok(Done::Now);
        }
        let (place, row) = Self::row(path.instance)?;
        if path.attribute != 1 || row.descriptor & 1 << 4 != 0 {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE.into());
        }
        if place == LABEL {
            let Some((length, label)) = data.split_first() else {
                return Err(GeneralStatus::NOT_ENOUGH_DATA.into());
            };
            if usize::from(*length) != label.len() {
                return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE.into());
            }
            self.label = label.to_vec();
            return Ok(Done::Now);
        }
        if data.len() != row.octets {
            return Err(GeneralStatus::NOT_ENOUGH_DATA.into());
        }
        let value = data.iter().rev().fold(0, |value, octet| value << 8 | i32::from(*octet));
        if !(row.minimum..=row.maximum).contains(&value) {
            return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE.into());
        }
        self.values[place] = value;
        Ok(Done::Now)
    }
    fn serve(
        &mut self,
        _: Instant,
        request: Request<'_>,
        out: &mut Writer<'_>,
    ) -> Result<Done, Error> {
        match (request.service, request.data) {
            (Service::GET_ENUM_STRING, [value]) if request.instance == 3 => {
                let name = MODES.get(usize::from(*value));
                text(name.ok_or(GeneralStatus::INVALID_PARAMETER)?, out);
                Ok(Done::Now)
            }
            _ => Err(GeneralStatus::SERVICE_NOT_SUPPORTED.into()),
        }
    }
    fn reset(&mut self, _: Instant, _: Reset) -> Result<Done, Error> {
        Ok(Done::Now)
    }
    fn keep(&mut self, _: Instant, _: NetworkSettings) {}
    fn notice(&mut self, _: Instant, _: Event) {}
}

/// A request of one frame to MAC ID 9, over the explicit connection, as 8/8.
fn narrow(format: u8, frame: &Frame) -> Option<Frame> {
    if frame.identifier() != Identifier::Standard(0x44C) {
        return None;
    }
    let octets = match (format, frame.data()) {
        (1, [header, service, class, instance, 0, rest @ ..])
        | (2, [header, service, class, 0, instance, 0, rest @ ..])
        | (3, [header, service, class, 0, instance, rest @ ..])
            if header & 0x80 == 0 =>
        {
            [&[*header, *service, *class, *instance], rest].concat()
        }
        _ => return None,
    };
    Some(Frame::standard(0x44C, &octets))
}

impl Station for Toy {
    type Input<'a> = can::Input<'a>;
    type Output = Frame;
    fn handle(&mut self, now: Instant, input: can::Input<'_>) {
        if let can::Input::Frame(frame) = input
            && let Some(narrow) = narrow(self.format, frame)
        {
            return self.server.handle(now, can::Input::Frame(&narrow), &mut self.drive);
        }
        self.server.handle(now, input, &mut self.drive);
    }
    fn advance(&mut self, now: Instant) {
        self.server.advance(now, &mut self.drive);
    }
    fn transmit(&mut self, now: Instant) -> Option<Frame> {
        if self.late.front().is_some_and(|(at, _)| *at <= now) {
            return self.late.pop_front().map(|(_, frame)| frame);
        }
        let frame = self.server.transmit(now, &mut self.drive)?;
        let answers = frame.identifier() == Identifier::Standard(0x44B);
        match *frame.data() {
            [header, 0xCB, 0] if answers => {
                Some(Frame::standard(0x44B, &[header, 0xCB, self.format]))
            }
            [_, service, ..] if answers && service != 0xCC && self.takes != Duration::ZERO => {
                self.late.push_back((now + self.takes, frame));
                None
            }
            _ => Some(frame),
        }
    }
    fn deadline(&self) -> Option<Instant> {
        let late = self.late.front().map(|(at, _)| *at);
        late.into_iter().chain(self.server.deadline()).min()
    }
}
