//! From a plant file to a plant: what the values mean together.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use codewheel_device::{Product, Switches, product};
use codewheel_devicenet::MacId;
use codewheel_devicenet::scanner::Trigger;
use codewheel_link::BusUri;
use codewheel_sim::can::Faults;
use codewheel_sim::shaft::Shaft;
use codewheel_station::Duration;
use codewheel_station::can::BitRate;
use toml::Spanned;

use crate::complaint::line_of;
use crate::file::{
    BusTable, Connection, DeviceTable, MasterTable, PlantFile, SlaveTable, SwitchTable,
    SwitchesValue,
};
use crate::plant::default_name;
use crate::{BusPlan, Complaint, DevicePlan, Exchange, MasterPlan, Plant, SlavePlan, TimeSpan};

mod faults;

/// The plant that `text` describes.
pub(crate) fn check(text: &str, name: &str, folder: &Path) -> Result<Plant, Complaint> {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = &std::path::absolute(here).unwrap_or_else(|_| here.to_owned());
    let source = Source { text, name, folder };
    let file: PlantFile = toml::from_str(text).map_err(|error| {
        let at = error.span().unwrap_or(0..0);
        source.complaint(at, in_our_words(error.message()))
    })?;
    let mut buses: Vec<BusPlan> = Vec::new();
    let mut uris = BTreeMap::new();
    for table in &file.bus {
        let bus = source.bus(table)?;
        let at = table.name.span();
        if buses.iter().any(|other| other.name == bus.name) {
            return Err(source.complaint(at, format!("there is a bus {:?} already", bus.name)));
        }
        // Port 0 is any free one, so it can be taken many times.
        let uri = bus.uri.to_string();
        let shared = !uri.ends_with(":0") && uris.insert(uri.clone(), ()).is_some();
        if shared {
            let at = table.uri.as_ref().map_or(at, Spanned::span);
            return Err(source.complaint(at, format!("another bus is at {uri} already")));
        }
        buses.push(bus);
    }
    let mut stations = Stations::default();
    let mut memories = BTreeMap::new();
    for table in &file.device {
        let place = source.bus_of(&buses, table.bus.as_ref(), &table.model)?;
        let device = source.device(table, &buses[place])?;
        let at = table.address.as_ref().map(Spanned::span);
        let at = at.or_else(|| table.switches.as_ref().map(Spanned::span)).unwrap_or(0..0);
        if let Some(mac) = device.switches.mac() {
            source.take_address(&mut stations, place, mac, at, table.duplicate.as_ref())?;
        } else if let Some(duplicate) = &table.duplicate {
            let message = "duplicate means nothing here: the switches give no address";
            return Err(source.complaint(duplicate.span(), message.into()));
        }
        if let (Some(path), Some(memory)) = (&device.memory, &table.memory)
            && let Some(line) = memories.insert(path.clone(), source.line(memory))
        {
            let message = format!(
                "the device of line {line} has this memory file already: name one of its own for \
                 each"
            );
            return Err(source.complaint(memory.span(), message));
        }
        buses[place].devices.push(device);
    }
    for table in &file.master {
        let place = source.bus_of(&buses, table.bus.as_ref(), &table.address)?;
        let master = source.master(table, &buses[place])?;
        let at = table.address.span();
        source.take_address(&mut stations, place, master.mac, at, table.duplicate.as_ref())?;
        buses[place].masters.push(master);
    }
    Ok(Plant { buses })
}

/// What serde says, in the words of somebody who has never heard of it.
fn in_our_words(message: &str) -> String {
    let message = message.trim_end().replace('\n', ", ");
    let mismatch = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|start| message.strip_prefix(start)?.split_once(", expected "));
    if let Some((found, expected)) = mismatch {
        let expected = match expected {
            "u8" => "a whole number from 0 to 255",
            "u16" => "a whole number from 0 to 65535",
            "u32" => "a whole number from 0 to 4294967295",
            "i32" => "a whole number from -2147483648 to 2147483647",
            "i64" => "a whole number",
            "f64" => "a number",
            "a boolean" => "true or false",
            "a sequence" => "an array, as [[bus]] begins one",
            other if other.starts_with("struct ") => "a table",
            other => other,
        };
        return format!("{found} is not what stands here: {expected}");
    }
    message
        .replace("unknown field", "unknown key")
        .replace("missing field", "missing key")
        .replace("duplicate field", "duplicate key")
        .replace("unknown variant", "unknown value")
}

/// The line of the first station at each address of each bus.
type Stations = BTreeMap<(usize, u8), usize>;

#[derive(Clone, Copy)]
struct Source<'a> {
    text: &'a str,
    name: &'a str,
    folder: &'a Path,
}

impl Source<'_> {
    fn complaint(&self, at: Range<usize>, message: String) -> Complaint {
        Complaint::new(self.name, self.text, at, message)
    }

    fn line<T>(&self, value: &Spanned<T>) -> usize {
        line_of(self.text, value.span().start)
    }

    fn bus(&self, table: &BusTable) -> Result<BusPlan, Complaint> {
        let name = table.name.get_ref();
        if name.is_empty() || name.contains(|letter: char| letter.is_whitespace()) {
            let message = format!("{name:?} is no name for a bus: it is one word");
            return Err(self.complaint(table.name.span(), message));
        }
        let uri: BusUri = match &table.uri {
            None => BusUri::Virtual(name.clone()),
            Some(text) => text
                .get_ref()
                .parse()
                .map_err(|error| self.complaint(text.span(), format!("{error}")))?,
        };
        if !matches!(uri, BusUri::Virtual(_)) {
            let levers = [("loss", &table.loss), ("corruption", &table.corruption)];
            for (key, value) in levers {
                if let Some(value) = value {
                    let message = format!("{key} is for virtual buses: a real one fails by itself");
                    return Err(self.complaint(value.span(), message));
                }
            }
        }
        let faults = Faults {
            loss: self.probability(table.loss.as_ref())?.unwrap_or(0.0),
            corruption: self.probability(table.corruption.as_ref())?.unwrap_or(0.0),
        };
        Ok(BusPlan {
            name: name.clone(),
            uri,
            bit_rate: table.baud.into(),
            faults,
            seed: table.seed.as_ref().map_or(0, |seed| *seed.get_ref()),
            devices: Vec::new(),
            masters: Vec::new(),
        })
    }

    fn probability(&self, value: Option<&Spanned<f64>>) -> Result<Option<f64>, Complaint> {
        match value {
            Some(value) if !(0.0..=1.0).contains(value.get_ref()) => {
                let message = format!("{} is no probability: it is 0 to 1", value.get_ref());
                Err(self.complaint(value.span(), message))
            }
            value => Ok(value.map(|value| *value.get_ref())),
        }
    }

    /// The place of the bus that a table names, or of the only one there is.
    fn bus_of<T>(
        &self,
        buses: &[BusPlan],
        name: Option<&Spanned<String>>,
        instead: &Spanned<T>,
    ) -> Result<usize, Complaint> {
        let names: Vec<_> = buses.iter().map(|bus| bus.name.as_str()).collect();
        let defined = match names.as_slice() {
            [] => "the file defines no [[bus]]".to_owned(),
            names => format!("the file defines {}", names.join(", ")),
        };
        match name {
            Some(name) => names.iter().position(|known| known == name.get_ref()).ok_or_else(|| {
                let message = format!("there is no bus {:?}: {defined}", name.get_ref());
                self.complaint(name.span(), message)
            }),
            None if buses.len() == 1 => Ok(0),
            None => {
                let message = format!("missing key `bus`: {defined}");
                Err(self.complaint(instead.span(), message))
            }
        }
    }

    fn mac(&self, address: &Spanned<i64>, hint: &str) -> Result<MacId, Complaint> {
        u8::try_from(*address.get_ref()).ok().and_then(MacId::new).ok_or_else(|| {
            let message = format!("{} is no address: DeviceNet has 0–63{hint}", address.get_ref());
            self.complaint(address.span(), message)
        })
    }

    fn device(&self, table: &DeviceTable, bus: &BusPlan) -> Result<DevicePlan, Complaint> {
        let model = &table.model;
        let product = Product::find(model.get_ref()).ok_or_else(|| {
            let models: Vec<_> = product::DEVICENET.iter().map(|product| product.model).collect();
            let message = format!(
                "there is no model {:?}: the models are {}",
                model.get_ref(),
                models.join(", ")
            );
            self.complaint(model.span(), message)
        })?;
        let mut switches = self.switches(table, bus.bit_rate)?;
        switches.termination = table.termination;
        let text = table.shaft.as_ref().map_or("still", |text| text.get_ref());
        let shaft_text = Shaft::text_in_folder(text, self.folder);
        let geometry = product.encoder.geometry;
        let (steps, turns) = (geometry.singleturn_resolution(), geometry.revolutions());
        let shaft = Shaft::parse(&shaft_text, steps, turns).map_err(|error| {
            let at = table.shaft.as_ref().map_or(0..0, Spanned::span);
            self.complaint(at, error.to_string())
        })?;
        let name = table.name.clone();
        // Where there is a memory it may know a serial number, which only one that is given beats.
        let serial = table.memory.is_none().then(|| u32::from(switches.address()));
        Ok(DevicePlan {
            name: name.unwrap_or_else(|| default_name(product.model, switches.address())),
            product,
            switches,
            shaft,
            shaft_text,
            memory: table.memory.as_ref().map(|memory| self.path(memory.get_ref())),
            serial: table.serial.or(serial),
            duplicate: table.duplicate.as_ref().is_some_and(|duplicate| *duplicate.get_ref()),
            faults: self.faults(&table.fault, product, &bus.uri)?,
        })
    }

    /// A path, the same for the same file however it is written.
    fn path(&self, path: &Path) -> PathBuf {
        self.folder.join(path).components().collect()
    }

    fn switches(&self, table: &DeviceTable, rate: BitRate) -> Result<Switches, Complaint> {
        let value = match (&table.address, &table.switches) {
            (Some(address), None) => {
                let hint = ", and switches = 99 is how to simulate wrong switches";
                let mac = self.mac(address, hint)?;
                return Ok(Switches::set_to(mac.value(), rate));
            }
            (None, Some(value)) => value,
            (None, None) => {
                let message = "missing key `address` (or `switches`)".to_owned();
                return Err(self.complaint(table.model.span(), message));
            }
            (Some(_), Some(switches)) => {
                let message = "address says where the switches stand already: give one of the two";
                return Err(self.complaint(switches.span(), message.into()));
            }
        };
        let SwitchTable { rotary: [rotary_1, rotary_2], dip } = match *value.get_ref() {
            SwitchesValue::Number(number) => return Ok(Switches::set_to(number, rate)),
            SwitchesValue::Each(table) => table,
        };
        if rotary_1 > 9 || rotary_2 > 9 {
            let message = "a rotary switch stands at 0 to 9".to_owned();
            return Err(self.complaint(value.span(), message));
        }
        let mut switches = Switches::set_to(rotary_1 * 10 + rotary_2, rate);
        if let Some([_, dip_2, dip_3]) = dip {
            (switches.dip_2, switches.dip_3) = (dip_2, dip_3);
        }
        if switches.bit_rate() != rate {
            let message = format!(
                "the DIP switches say {}, and the bus runs at {rate}: one wire carries one rate",
                switches.bit_rate()
            );
            return Err(self.complaint(value.span(), message));
        }
        Ok(switches)
    }

    /// Notes a station at an address; a second one needs to say that it is meant.
    fn take_address(
        &self,
        stations: &mut Stations,
        bus: usize,
        mac: MacId,
        at: Range<usize>,
        duplicate: Option<&Spanned<bool>>,
    ) -> Result<(), Complaint> {
        let meant = duplicate.filter(|duplicate| *duplicate.get_ref());
        let line = line_of(self.text, at.start);
        match (stations.get(&(bus, mac.value())), meant) {
            (Some(first), None) => Err(self.complaint(
                at,
                format!(
                    "the station of line {first} has address {mac} on this bus already; \
                     duplicate = true is how to simulate that"
                ),
            )),
            (None, Some(duplicate)) => Err(self.complaint(
                duplicate.span(),
                format!("duplicate means nothing here: no station before has address {mac}"),
            )),
            (Some(_), Some(_)) => Ok(()),
            (None, None) => {
                stations.insert((bus, mac.value()), line);
                Ok(())
            }
        }
    }

    fn master(&self, table: &MasterTable, bus: &BusPlan) -> Result<MasterPlan, Complaint> {
        let mac = self.mac(&table.address, "")?;
        let mut slaves: Vec<SlavePlan> = Vec::new();
        match &table.slave {
            Some(tables) => {
                for table in tables {
                    let slave = self.slave(table)?;
                    let taken = slaves.iter().any(|other| other.mac == slave.mac);
                    if taken || slave.mac == mac {
                        let message = if taken {
                            "this address is in the scan list already"
                        } else {
                            "this is the master's own address"
                        };
                        return Err(self.complaint(table.address.span(), message.into()));
                    }
                    slaves.push(slave);
                }
            }
            None => {
                for mac in bus.devices.iter().filter_map(|device| device.switches.mac()) {
                    if !slaves.iter().any(|slave| slave.mac == mac) {
                        slaves.push(SlavePlan::poll(mac));
                    }
                }
                slaves.retain(|slave| slave.mac != mac);
            }
        }
        let name = table.name.clone();
        let time = |value: Option<crate::TimeSpan>, default| value.map_or(default, |time| time.0);
        Ok(MasterPlan {
            name: name.unwrap_or_else(|| default_name("scanner", mac.value())),
            mac,
            interval: time(table.interval, Duration::from_millis(10)),
            interscan_delay: time(table.interscan_delay, Duration::ZERO),
            termination: table.termination.unwrap_or(true),
            duplicate: table.duplicate.as_ref().is_some_and(|duplicate| *duplicate.get_ref()),
            slaves,
        })
    }

    /// A timer of a connection: two octets of milliseconds.
    fn rate(&self, value: &Spanned<TimeSpan>, name: &str) -> Result<u16, Complaint> {
        let time = value.get_ref().0;
        let millis = u16::try_from(time.as_millis()).ok();
        millis.filter(|_| time == Duration::from_millis(time.as_millis())).ok_or_else(|| {
            let given = value.get_ref();
            let message =
                format!("{given} is no {name}: it is 0 to 65535ms, in whole milliseconds");
            self.complaint(value.span(), message)
        })
    }

    fn exchange(&self, table: &SlaveTable, rate: u16) -> Result<Exchange, Complaint> {
        let trigger = match table.connection {
            Connection::ChangeOfState => Trigger::ChangeOfState,
            Connection::Cyclic => Trigger::Cyclic,
            Connection::Poll | Connection::Explicit => {
                let spans = [
                    table.acknowledged.as_ref().map(Spanned::span),
                    table.production_inhibit.as_ref().map(Spanned::span),
                ];
                if let Some(span) = spans.into_iter().flatten().next() {
                    let message = "only a change-of-state or cyclic connection has this";
                    return Err(self.complaint(span, message.into()));
                }
                return Ok(match table.connection {
                    Connection::Explicit => Exchange::Explicit,
                    _ => Exchange::Poll,
                });
            }
        };
        let production_inhibit = match &table.production_inhibit {
            None => 0,
            Some(inhibit) => {
                let millis = self.rate(inhibit, "production inhibit time")?;
                if rate != 0 && millis > rate {
                    let message = format!("it is longer than the expected packet rate, {rate}ms");
                    return Err(self.complaint(inhibit.span(), message));
                }
                millis
            }
        };
        let acknowledged = table.acknowledged.as_ref().is_none_or(|value| *value.get_ref());
        Ok(Exchange::Change { trigger, acknowledged, production_inhibit })
    }

    fn slave(&self, table: &SlaveTable) -> Result<SlavePlan, Complaint> {
        let mut slave = SlavePlan::poll(self.mac(&table.address, "")?);
        if table.connection == Connection::ChangeOfState {
            slave.expected_packet_rate = 1_000;
        }
        if let Some(rate) = &table.expected_packet_rate {
            slave.expected_packet_rate = self.rate(rate, "expected packet rate")?;
            if table.connection == Connection::Cyclic && slave.expected_packet_rate == 0 {
                let message = "a cyclic slave needs an expected packet rate of at least 1ms";
                return Err(self.complaint(rate.span(), message.into()));
            }
        }
        slave.exchange = self.exchange(table, slave.expected_packet_rate)?;
        slave.assembly = table.assembly;
        slave.identity = match (&table.vendor, &table.product_code) {
            (None, None) => None,
            (Some(vendor), Some(code)) => Some((*vendor.get_ref(), *code.get_ref())),
            (Some(one), None) | (None, Some(one)) => {
                let message = "vendor and product_code are given together or not at all";
                return Err(self.complaint(one.span(), message.into()));
            }
        };
        Ok(slave)
    }
}
