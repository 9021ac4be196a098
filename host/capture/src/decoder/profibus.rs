//! What the telegrams of a PROFIBUS line say.

mod diagnosis;
mod parameters;
mod service;

use codewheel_device::profibus::{IDENT_NUMBER, configuration};
use codewheel_profibus::function_code::{Function, FunctionCode, Reply};
use codewheel_profibus::telegram::{Damage, Data, Telegram};

use self::service::Service;
use super::Assume;
use super::line::Line;
use crate::{ProfibusSaid, Said};

/// Everything remembered of a line.
#[derive(Debug)]
pub(super) struct Profibus {
    slaves: Slaves,
    /// The request that waits for its answer: nobody else speaks before.
    asked: Option<Asked>,
    /// Its data.
    request: Vec<u8>,
}

/// A request that wants an answer.
#[derive(Clone, Copy, Debug)]
struct Asked {
    from: u8,
    to: u8,
    what: What,
    /// The only identifier of a Chk_Cfg.
    identifier: Option<u8>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    FdlStatus,
    Service(Service),
    Other,
}

/// What the slaves have said they are.
#[derive(Debug)]
struct Slaves {
    assume: Assume,
    idents: [Option<u16>; 128],
}

impl Slaves {
    fn is_encoder(&self, address: u8) -> bool {
        match self.idents.get(usize::from(address)).copied().flatten() {
            Some(ident) => ident == IDENT_NUMBER,
            None => self.assume == Assume::Encoders,
        }
    }

    fn learn(&mut self, address: u8, ident: u16) {
        if let Some(known) = self.idents.get_mut(usize::from(address)) {
            *known = Some(ident);
        }
    }
}

/// The address that stands for all stations.
const EVERYBODY: u8 = 127;

impl Profibus {
    pub(super) fn new(assume: Assume) -> Self {
        Self { slaves: Slaves { assume, idents: [None; 128] }, asked: None, request: Vec::new() }
    }

    pub(super) fn decode(&mut self, octets: &[u8], broken: bool, line: &mut Line<'_>) {
        let telegram = match Telegram::decode(octets) {
            // What was disturbed is not what somebody said, even where it can be read.
            _ if broken => {
                self.asked = None;
                line.message("disturbed on the line");
                return;
            }
            Ok(Some(telegram)) if telegram.length() == octets.len() => telegram,
            Ok(Some(_)) => return garbage("octets behind the end of a telegram", line),
            Ok(None) => return garbage("an incomplete telegram", line),
            Err(damage) => return garbage(damage_name(damage), line),
        };
        match telegram {
            Telegram::Token { destination, source } => {
                self.asked = None;
                line.ends(Some(source & 0x7F), Some(destination & 0x7F));
                line.message("token");
            }
            Telegram::ShortAcknowledge => self.short_acknowledge(line),
            Telegram::Data(data) if data.function_code().is_request() => self.request(&data, line),
            Telegram::Data(data) => self.answer(&data, line),
        }
    }

    fn short_acknowledge(&mut self, line: &mut Line<'_>) {
        match self.asked.take() {
            Some(Asked { from, to, what: What::Service(service), identifier }) => {
                line.ends(Some(to), Some(from));
                line.said(Said::Profibus(ProfibusSaid {
                    slave: to,
                    master: from,
                    sap: service.sap(),
                    request: &self.request,
                    response: &[],
                }));
                line.message("acknowledge");
                service.tell(line);
                if let (Service::CheckConfiguration, Some(identifier)) = (service, identifier) {
                    line.hex("identifier", "identifier", &[identifier]);
                }
            }
            Some(Asked { from, to, .. }) => {
                line.ends(Some(to), Some(from));
                line.message("acknowledge");
            }
            None => {
                line.message("acknowledge");
                line.note(&["its request was not seen"]);
            }
        }
    }

    fn request(&mut self, data: &Data<'_>, line: &mut Line<'_>) {
        self.asked = None;
        let (from, to) = (data.source(), data.destination());
        line.ends(Some(from), Some(to));
        let code = data.function_code();
        let Some(function) = code.function() else {
            line.message("request");
            line.hex("function-code", "function code", &[code.0]);
            line.octets("data", "data", data.unit());
            return line.note(&["a reserved function code"]);
        };
        line.message(function_name(function));
        frame_count(code, line);
        let mut asked = Asked { from, to, what: What::Other, identifier: None };
        match function {
            Function::FdlStatus => asked.what = What::FdlStatus,
            Function::SrdLow | Function::SrdHigh | Function::SdnLow | Function::SdnHigh => {
                let service = match data.saps() {
                    Ok(None) => Service::DataExchange,
                    Ok(Some(saps)) => Service::of(saps.destination),
                    Err(_) => {
                        line.octets("data", "data", data.unit());
                        return line.note(&["half of an address extension"]);
                    }
                };
                service.tell(line);
                asked.what = What::Service(service);
                self.request.clear();
                self.request.extend_from_slice(data.data());
                if let (Service::CheckConfiguration, [identifier]) = (service, data.data()) {
                    asked.identifier = Some(*identifier);
                }
                self.request_data(service, to, data.data(), line);
            }
            Function::SdaLow | Function::SdaHigh | Function::Ident | Function::LsapStatus => {
                line.octets("data", "data", data.unit());
            }
        }
        let wants_answer = !matches!(function, Function::SdnLow | Function::SdnHigh);
        self.asked = (wants_answer && to != EVERYBODY).then_some(asked);
    }

    fn request_data(&mut self, service: Service, to: u8, data: &[u8], line: &mut Line<'_>) {
        match service {
            Service::DataExchange => outputs(data, self.slaves.is_encoder(to), line),
            Service::SetParameters => {
                if let &[_, _, _, _, high, low, ..] = data {
                    self.slaves.learn(to, u16::from_be_bytes([high, low]));
                }
                parameters::tell(data, self.slaves.is_encoder(to), line);
            }
            Service::CheckConfiguration => {
                identifiers(data, self.slaves.is_encoder(to), line);
            }
            Service::GlobalControl => parameters::global_control(data, line),
            Service::SetSlaveAddress => match *data {
                [address, high, low, ref rest @ ..] => {
                    line.number("new-address", "new address", address.into(), "");
                    line.hex("ident-number", "ident number", &[high, low]);
                    line.octets("rest", "rest", rest);
                }
                _ => line.octets("data", "data", data),
            },
            Service::SlaveDiagnosis
            | Service::GetConfiguration
            | Service::ReadInputs
            | Service::ReadOutputs
            | Service::Other(_) => line.octets("data", "data", data),
        }
    }

    fn answer(&mut self, data: &Data<'_>, line: &mut Line<'_>) {
        let (from, to) = (data.source(), data.destination());
        line.ends(Some(from), Some(to));
        let code = data.function_code();
        let asked = self.asked.take().filter(|asked| (asked.to, asked.from) == (from, to));
        let Some(reply) = code.answer() else {
            line.message("answer");
            line.hex("function-code", "function code", &[code.0]);
            line.octets("data", "data", data.unit());
            return line.note(&["a reserved function code"]);
        };
        line.message(reply_name(reply));
        let what = asked.map(|asked| asked.what);
        if what == Some(What::FdlStatus) {
            line.attribute("service", &["FDL status"]);
            line.word("station", "", station_type(code).as_bytes());
            return line.octets("data", "data", data.unit());
        }
        // The service access points of an answer are those of its request, swapped.
        let by_sap = match data.saps() {
            Ok(Some(saps)) => Some(Service::of(saps.source)),
            _ => None,
        };
        let service = by_sap.or(match what {
            Some(What::Service(service)) => Some(service),
            _ => None,
        });
        if let (Some(service), true) = (service, matches!(what, Some(What::Service(_))))
            && matches!(reply, Reply::DataLow | Reply::DataHigh)
        {
            line.said(Said::Profibus(ProfibusSaid {
                slave: from,
                master: to,
                sap: service.sap(),
                request: &self.request,
                response: data.data(),
            }));
        }
        match service {
            Some(service) => {
                service.tell(line);
                self.answer_data(service, from, data.data(), line);
            }
            None => line.octets("data", "data", data.unit()),
        }
        if asked.is_none() {
            line.note(&["its request was not seen"]);
        }
    }

    fn answer_data(&mut self, service: Service, from: u8, data: &[u8], line: &mut Line<'_>) {
        match service {
            Service::SlaveDiagnosis => {
                if let &[_, _, _, _, high, low, ..] = data {
                    self.slaves.learn(from, u16::from_be_bytes([high, low]));
                }
                diagnosis::tell(data, self.slaves.is_encoder(from), line);
            }
            Service::GetConfiguration => {
                identifiers(data, self.slaves.is_encoder(from), line);
            }
            Service::DataExchange | Service::ReadInputs => {
                inputs(data, self.slaves.is_encoder(from), line);
            }
            Service::ReadOutputs => outputs(data, self.slaves.is_encoder(from), line),
            _ => line.octets("data", "data", data),
        }
    }
}

/// The position of an encoder, in one or two words.
fn inputs(data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    let position = match *data {
        [high, low] if is_encoder => i64::from(u16::from_be_bytes([high, low])),
        [a, b, c, d] if is_encoder => i64::from(u32::from_be_bytes([a, b, c, d])),
        _ => return line.octets("inputs", "inputs", data),
    };
    line.number("position", "position", position, "step");
}

/// The preset of an encoder, in one or two words, with its clock in the highest bit.
fn outputs(data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    let (preset, clock) = match *data {
        [high, low] if is_encoder => {
            let word = u16::from_be_bytes([high, low]);
            (i64::from(word & 0x7FFF), word >> 15)
        }
        [a, b, c, d] if is_encoder => {
            let words = u32::from_be_bytes([a, b, c, d]);
            (i64::from(words & 0x7FFF_FFFF), (words >> 31) as u16)
        }
        _ => return line.octets("outputs", "outputs", data),
    };
    line.number("preset", "preset", preset, "step");
    line.number("clock", "clock", clock.into(), "");
}

/// The identifiers of a configuration.
fn identifiers(data: &[u8], is_encoder: bool, line: &mut Line<'_>) {
    match *data {
        [identifier] => {
            line.hex("identifier", "identifier", &[identifier]);
            let row = configuration::Row::find(identifier).filter(|_| is_encoder);
            if let Some(row) = row {
                line.word("configuration", "", row.name.as_bytes());
            }
        }
        _ => line.octets("identifiers", "identifiers", data),
    }
}

fn frame_count(code: FunctionCode, line: &mut Line<'_>) {
    let parts: &[&str] = match (code.frame_count(), code.frame_count_valid()) {
        (false, false) => &["FCB 0 FCV 0"],
        (true, false) => &["FCB 1 FCV 0"],
        (false, true) => &["FCB 0 FCV 1"],
        (true, true) => &["FCB 1 FCV 1"],
    };
    line.attribute("frame-count", parts);
}

fn garbage(what: &str, line: &mut Line<'_>) {
    line.message("no telegram");
    line.note(&[what]);
}

const fn damage_name(damage: Damage) -> &'static str {
    match damage {
        Damage::StartDelimiter => "no start delimiter",
        Damage::Length => "lengths that differ, or that no telegram has",
        Damage::Checksum => "a wrong FCS",
        Damage::EndDelimiter => "no end delimiter",
    }
}

const fn function_name(function: Function) -> &'static str {
    match function {
        Function::SdaLow => "SDA_low",
        Function::SdnLow => "SDN_low",
        Function::SdaHigh => "SDA_high",
        Function::SdnHigh => "SDN_high",
        Function::FdlStatus => "FDL status",
        Function::SrdLow => "SRD_low",
        Function::SrdHigh => "SRD_high",
        Function::Ident => "ident",
        Function::LsapStatus => "LSAP status",
    }
}

const fn reply_name(reply: Reply) -> &'static str {
    match reply {
        Reply::Ok => "OK",
        Reply::UserError => "UE",
        Reply::NoResource => "RR",
        Reply::NotActivated => "RS",
        Reply::DataLow => "DL",
        Reply::NotReady => "NR",
        Reply::DataHigh => "DH",
        Reply::NoResourceDataLow => "RDL",
        Reply::NoResourceDataHigh => "RDH",
    }
}

/// Bits 5 and 4 of an answer (EN 50170-2, FDL).
const fn station_type(code: FunctionCode) -> &'static str {
    match code.0 >> 4 & 3 {
        0 => "slave",
        1 => "master, not ready",
        2 => "master, ready",
        _ => "master, in the ring",
    }
}
