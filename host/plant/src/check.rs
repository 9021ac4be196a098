//! From a plant file to a plant: what the values mean together.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use codewheel_device::Product;
use codewheel_link::{BusUri, Medium};
use codewheel_sim::shaft::Shaft;
use toml::Spanned;

use crate::complaint::line_of;
use crate::field_bus::{FieldBus, PlannedMaster, Switches};
use crate::file::{BusKind, BusTable, DeviceTable, MasterKind, MasterTable, PlantFile};
use crate::plant::{any_bus, default_name};
use crate::{AnyBusPlan, BusPlan, Complaint, DevicePlan, Plant};

mod devicenet;
mod faults;
mod profibus;
mod ssi;

pub(crate) use faults::{cannot_suffer, fault_of_words, lever_of_words};
pub(crate) use profibus::baud_rate;
pub(crate) use ssi::sensor_of_keys;

/// What the tables of one field bus mean.
trait Written: FieldBus {
    /// What carries it.
    const MEDIUM: Medium;
    /// The kind that plant files call its masters.
    const MASTER: MasterKind;
    /// Its rates as people write them, in words for a message.
    const RATES: &'static str;
    /// The rate where nothing is said.
    const DEFAULT_RATE: Self::Rate;

    /// A rate as people write it.
    fn rate(text: &str) -> Option<Self::Rate>;

    /// Cable and faults of a bus.
    fn line(
        source: &Source<'_>,
        table: &BusTable,
        bus: &mut BusPlan<Self>,
    ) -> Result<(), Complaint>;

    /// Where the switches of a device stand.
    fn switches(
        source: &Source<'_>,
        table: &DeviceTable,
        bus: &BusPlan<Self>,
    ) -> Result<Self::Switches, Complaint>;

    /// What else a device is told.
    fn options(
        source: &Source<'_>,
        table: &DeviceTable,
        bus: &BusPlan<Self>,
    ) -> Result<Self::Options, Complaint>;

    /// A master.
    fn master_plan(
        source: &Source<'_>,
        table: &MasterTable,
        bus: &BusPlan<Self>,
    ) -> Result<Self::MasterPlan, Complaint>;
}

/// A key and where its value stands, if it is there.
type Given = (&'static str, Option<Range<usize>>);

fn span<T>(value: &Option<Spanned<T>>) -> Option<Range<usize>> {
    value.as_ref().map(Spanned::span)
}

fn is_true(value: &Option<Spanned<bool>>) -> bool {
    value.as_ref().is_some_and(|value| *value.get_ref())
}

/// The plant that `text` describes.
pub(crate) fn check(text: &str, name: &str, folder: &Path) -> Result<Plant, Complaint> {
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = &std::path::absolute(here).unwrap_or_else(|_| here.to_owned());
    let source = Source { text, name, folder };
    let file: PlantFile = toml::from_str(text).map_err(|error| {
        let at = error.span().unwrap_or(0..0);
        source.complaint(at, in_our_words(error.message()))
    })?;
    let mut buses: Vec<AnyBusPlan> = Vec::new();
    let mut uris = BTreeMap::new();
    for table in &file.bus {
        let bus = match table.kind {
            BusKind::DeviceNet => AnyBusPlan::DeviceNet(source.bus(table)?),
            BusKind::Profibus => AnyBusPlan::Profibus(source.bus(table)?),
        };
        let at = table.name.span();
        if buses.iter().any(|other| other.name() == bus.name()) {
            return Err(source.complaint(at, format!("there is a bus {:?} already", bus.name())));
        }
        // Port 0 is any free one, so it can be taken many times.
        let uri = bus.uri().to_string();
        let shared = !uri.ends_with(":0") && uris.insert(uri.clone(), ()).is_some();
        if shared {
            let at = span(&table.uri).unwrap_or(at);
            return Err(source.complaint(at, format!("another bus is at {uri} already")));
        }
        buses.push(bus);
    }
    let mut stations = Stations::default();
    let mut memories = BTreeMap::new();
    for table in &file.device {
        let place = source.bus_of(&buses, table.bus.as_ref(), &table.model)?;
        let stations = stations.entry(place).or_default();
        any_bus!(&mut buses[place], bus => source.add_device(table, bus, stations, &mut memories)?);
    }
    for table in &file.master {
        let place = source.bus_of(&buses, table.bus.as_ref(), &table.address)?;
        let stations = stations.entry(place).or_default();
        any_bus!(&mut buses[place], bus => source.add_master(table, bus, stations)?);
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

/// Keys whose values are text in a plant file, even where they look like a number.
const TEXTS: [&str; 8] = ["kind", "at", "for", "delay", "line", "code", "clock", "monoflop"];

/// Keys and values of a command line as a table of a plant file.
fn toml_of<'a>(keys: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let line = |(key, value): (&str, &str)| {
        let bare = value.parse::<f64>().is_ok() || value == "true";
        if bare && !TEXTS.contains(&key) {
            format!("{key} = {value}\n")
        } else {
            format!("{key} = {value:?}\n")
        }
    };
    keys.into_iter().map(line).collect()
}

/// The line of the first station at each address, of each bus.
type Stations = BTreeMap<usize, BTreeMap<u8, usize>>;

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

    fn bus<B: Written>(&self, table: &BusTable) -> Result<BusPlan<B>, Complaint> {
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
        if let Some(text) = &table.uri
            && ![B::MEDIUM, Medium::Any].contains(&uri.medium())
        {
            let message = format!(
                "{uri} carries {}, and a {} runs on {}: write virtual:NAME, {}",
                uri.medium(),
                B::BUS,
                B::MEDIUM,
                B::MEDIUM.forms()
            );
            return Err(self.complaint(text.span(), message));
        }
        let bit_rate = match &table.baud {
            None => B::DEFAULT_RATE,
            Some(text) => B::rate(text.get_ref()).ok_or_else(|| {
                let message =
                    format!("{:?} is no rate of a {}: it has {}", text.get_ref(), B::BUS, B::RATES);
                self.complaint(text.span(), message)
            })?,
        };
        let mut bus = BusPlan::new(name, uri, bit_rate);
        bus.seed = table.seed.as_ref().map_or(0, |seed| *seed.get_ref());
        if !bus.is_virtual() {
            for (key, at) in [
                ("loss", &table.loss),
                ("corruption", &table.corruption),
                ("broken", &table.broken),
                ("flipped", &table.flipped),
                ("pause", &table.pause),
            ] {
                if let Some(at) = span(at) {
                    let message = format!("{key} is for virtual buses: a real one fails by itself");
                    return Err(self.complaint(at, message));
                }
            }
        }
        B::line(self, table, &mut bus)?;
        Ok(bus)
    }

    /// Refuses keys that mean nothing here.
    fn refuse(
        &self,
        given: impl IntoIterator<Item = Given>,
        because: &str,
    ) -> Result<(), Complaint> {
        match given.into_iter().find_map(|(key, at)| Some((key, at?))) {
            Some((key, at)) => {
                Err(self.complaint(at, format!("`{key}` means nothing here: {because}")))
            }
            None => Ok(()),
        }
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
        buses: &[AnyBusPlan],
        name: Option<&Spanned<String>>,
        instead: &Spanned<T>,
    ) -> Result<usize, Complaint> {
        let names: Vec<_> = buses.iter().map(AnyBusPlan::name).collect();
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

    fn add_device<B: Written>(
        &self,
        table: &DeviceTable,
        bus: &mut BusPlan<B>,
        stations: &mut BTreeMap<u8, usize>,
        memories: &mut BTreeMap<PathBuf, usize>,
    ) -> Result<(), Complaint> {
        let device = self.device(table, bus)?;
        let at = span(&table.address).or_else(|| span(&table.switches)).unwrap_or(0..0);
        if let Some(address) = device.switches.address() {
            self.take_address(stations, address, at, table.duplicate.as_ref())?;
        } else if let Some(duplicate) = &table.duplicate {
            let message = "duplicate means nothing here: the switches give no address";
            return Err(self.complaint(duplicate.span(), message.into()));
        }
        if let (Some(path), Some(memory)) = (&device.memory, &table.memory)
            && let Some(line) = memories.insert(path.clone(), self.line(memory))
        {
            let message = format!(
                "the device of line {line} has this memory file already: name one of its own for \
                 each"
            );
            return Err(self.complaint(memory.span(), message));
        }
        bus.devices.push(device);
        Ok(())
    }

    fn device<B: Written>(
        &self,
        table: &DeviceTable,
        bus: &BusPlan<B>,
    ) -> Result<DevicePlan<B>, Complaint> {
        let product = self.product(&table.model, bus)?;
        let switches = B::switches(self, table, bus)?;
        let options = B::options(self, table, bus)?;
        let sensor = self.sensor(table, product)?;
        let geometry = sensor.geometry().unwrap_or(product.encoder.geometry);
        let shaft_text = table.shaft.as_ref().map_or("still", |shaft| shaft.get_ref());
        let shaft_text = Shaft::text_in_folder(shaft_text, self.folder);
        let shaft =
            Shaft::parse(&shaft_text, geometry.singleturn_resolution(), geometry.revolutions())
                .map_err(|error| {
                    self.complaint(span(&table.shaft).unwrap_or(0..0), error.to_string())
                })?;
        let name = table.name.clone();
        // Where there is a memory it may know a serial number, which only one that is given beats.
        let serial = table.memory.is_none().then(|| u32::from(switches.position()));
        Ok(DevicePlan {
            name: name.unwrap_or_else(|| default_name(product.model, switches.position())),
            product,
            switches,
            options,
            shaft,
            shaft_text,
            faults: self.faults(&table.fault, product, &sensor, bus)?,
            sensor,
            memory: table.memory.as_ref().map(|memory| self.path(memory.get_ref())),
            serial: table.serial.or(serial),
            duplicate: is_true(&table.duplicate),
        })
    }

    fn product<B: Written>(
        &self,
        model: &Spanned<String>,
        bus: &BusPlan<B>,
    ) -> Result<&'static Product, Complaint> {
        let found = Product::find(model.get_ref());
        if let Some(product) = found.filter(|product| product.bus == B::BUS) {
            return Ok(product);
        }
        let models = Product::all().filter(|product| product.bus == B::BUS);
        let models: Vec<_> = models.map(|product| product.model).collect();
        let message = match found {
            None => format!(
                "there is no model {:?}: the models are {}",
                model.get_ref(),
                models.join(", ")
            ),
            Some(product) => format!(
                "{} speaks {}, and {} is a {}: its models are {}",
                product.model,
                product.bus,
                bus.name,
                B::BUS,
                models.join(", ")
            ),
        };
        Err(self.complaint(model.span(), message))
    }

    /// A path, the same for the same file however it is written.
    fn path(&self, path: &Path) -> PathBuf {
        self.folder.join(path).components().collect()
    }

    /// Notes a station at an address; a second one needs to say that it is meant.
    fn take_address(
        &self,
        stations: &mut BTreeMap<u8, usize>,
        address: u8,
        at: Range<usize>,
        duplicate: Option<&Spanned<bool>>,
    ) -> Result<(), Complaint> {
        let meant = duplicate.filter(|duplicate| *duplicate.get_ref());
        let line = line_of(self.text, at.start);
        match (stations.get(&address), meant) {
            (Some(first), None) => Err(self.complaint(
                at,
                format!(
                    "the station of line {first} has address {address} on this bus already; \
                     duplicate = true is how to simulate that"
                ),
            )),
            (None, Some(duplicate)) => Err(self.complaint(
                duplicate.span(),
                format!("duplicate means nothing here: no station before has address {address}"),
            )),
            (Some(_), Some(_)) => Ok(()),
            (None, None) => {
                stations.insert(address, line);
                Ok(())
            }
        }
    }

    fn add_master<B: Written>(
        &self,
        table: &MasterTable,
        bus: &mut BusPlan<B>,
        stations: &mut BTreeMap<u8, usize>,
    ) -> Result<(), Complaint> {
        if let Some(kind) = table.kind.as_ref().filter(|kind| *kind.get_ref() != B::MASTER) {
            let message = format!(
                "{} is a {}: its masters are of kind {:?}",
                bus.name,
                B::BUS,
                B::MasterPlan::KIND
            );
            return Err(self.complaint(kind.span(), message));
        }
        let master = B::master_plan(self, table, bus)?;
        let at = table.address.span();
        self.take_address(stations, master.address(), at, table.duplicate.as_ref())?;
        bus.masters.push(master);
        Ok(())
    }

    /// Refuses an address that is in a list already, or the master's own.
    fn new_slave(
        &self,
        address: &Spanned<i64>,
        taken: bool,
        is_own: bool,
    ) -> Result<(), Complaint> {
        let message = match (taken, is_own) {
            (true, _) => "this address is in the scan list already",
            (_, true) => "this is the master's own address",
            (false, false) => return Ok(()),
        };
        Err(self.complaint(address.span(), message.into()))
    }
}
