//! From a passport to the text of its file.

use codewheel_device::product::Bus;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

use super::super::{FORMAT, Nameplate, Passport, Position, Project, Source};
use crate::Reading;

const HEAD: &str = "\
# The passport of an encoder: what a replacement needs to give the same positions.
# It may be edited; what cannot be is refused with its line.

";

pub(super) fn write(passport: &Passport) -> String {
    let mut document = DocumentMut::new();
    let table = document.as_table_mut();
    table.decor_mut().set_prefix(HEAD);
    put(table, "format", i64::from(FORMAT), "");
    put(table, "taken", passport.taken.to_string(), "UTC");
    put(table, "program", passport.program.as_str(), "");
    let (source, note) = match passport.source {
        Source::Device => ("device", "the encoder itself said it"),
        Source::Capture => ("capture", "from recorded traffic, which may not show everything"),
    };
    put(table, "source", source, note);
    if !passport.absent.is_empty() {
        put(table, "absent", strings(&passport.absent), "not in the capture");
    }
    table.insert("bus", Item::Table(bus(passport)));
    table.insert("identity", Item::Table(identity(passport.bus, &passport.nameplate)));
    table.insert("settings", Item::Table(settings(passport)));
    table.insert("position", Item::Table(position(&passport.position)));
    let project = project(&passport.project);
    if !project.is_empty() {
        table.insert("project", Item::Table(project));
    }
    document.to_string()
}

/// A line `key = value  # note`.
fn put(table: &mut Table, key: &str, value: impl Into<Value>, note: &str) {
    let mut value = value.into();
    if !note.is_empty() {
        value.decor_mut().set_suffix(format!(" # {note}"));
    }
    table.insert(key, Item::Value(value));
}

/// A line where there is a value, and nothing where there is none.
fn put_known(table: &mut Table, key: &str, value: Option<impl Into<Value>>, note: &str) {
    if let Some(value) = value {
        put(table, key, value, note);
    }
}

fn strings<S: AsRef<str>>(texts: &[S]) -> Array {
    texts.iter().map(AsRef::as_ref).collect()
}

/// `[0x20, 0x04]`
fn octets(octets: &[u8]) -> Value {
    let numbers: Vec<String> = octets.iter().map(|octet| format!("0x{octet:02X}")).collect();
    let text = format!("[{}]", numbers.join(", "));
    // Numbers between brackets are an array.
    text.parse().unwrap_or_else(|_| octets.iter().map(|octet| i64::from(*octet)).collect())
}

fn bus(passport: &Passport) -> Table {
    let mut table = Table::new();
    let kind = match passport.bus {
        Bus::DeviceNet => "devicenet",
        Bus::Profibus => "profibus",
    };
    put(&mut table, "kind", kind, "");
    put(&mut table, "address", i64::from(passport.address), "");
    put_known(&mut table, "bit-rate", passport.bit_rate.map(i64::from), "bit/s");
    table
}

fn identity(bus: Bus, plate: &Nameplate) -> Table {
    let mut table = Table::new();
    let models: Vec<&str> = plate.models.iter().map(|product| product.model).collect();
    put(&mut table, "models", strings(&models), "what it may be, in the catalogue");
    put_known(&mut table, "vendor", plate.vendor.map(i64::from), "");
    put_known(&mut table, "device-type", plate.device_type.map(i64::from), "");
    if let Some(code) = plate.product_code {
        let note = match bus {
            Bus::DeviceNet => format!("{code:02X}h"),
            Bus::Profibus => format!("ident number {code:04X}h"),
        };
        put(&mut table, "product-code", i64::from(code), &note);
    }
    let revision = plate.revision.map(|(major, minor)| format!("{major}.{minor}"));
    put_known(&mut table, "revision", revision, "");
    put_known(&mut table, "serial", plate.serial.map(i64::from), "");
    put_known(&mut table, "product-name", plate.product_name.as_deref(), "");
    put_known(&mut table, "firmware", plate.firmware.as_deref(), "");
    let resolution = plate.singleturn_resolution.map(i64::from);
    put_known(&mut table, "singleturn-resolution", resolution, "step: what its disc has in a turn");
    let revolutions = plate.revolutions.map(i64::from);
    put_known(&mut table, "revolutions", revolutions, "turns that it can tell apart");
    table
}

fn settings(passport: &Passport) -> Table {
    let mut table = Table::new();
    for setting in &passport.settings {
        let value = match &setting.reading {
            Reading::Number(number) => Value::from(*number),
            Reading::Real(real) => Value::from(real.number()),
            Reading::Text(text) => Value::from(text.as_str()),
            Reading::Octets(values) => octets(values),
        };
        put(&mut table, &setting.name, value, &setting.note);
    }
    table
}

fn position(position: &Position) -> Table {
    let mut table = Table::new();
    put_known(&mut table, "preset", position.preset, "step: as last written");
    let offset = "step: what the preset adds; it belongs to this unit alone";
    put_known(&mut table, "offset", position.offset, offset);
    put_known(&mut table, "steps", position.steps.map(i64::from), "where the machine stood");
    put_known(&mut table, "at-rest", position.at_rest, "");
    table
}

fn project(project: &Project) -> Table {
    let mut table = Table::new();
    table.decor_mut().set_prefix("\n# What the project of the master must say.\n");
    put_known(&mut table, "data-sheet", project.data_sheet.as_deref(), "");
    if let Some(user) = &project.user_parameters {
        put(&mut table, "user-parameters", octets(user), "Set_Prm from octet 8 on");
        let words: Vec<String> = project.words().iter().map(|word| format!("# {word}\n")).collect();
        if let Some(mut key) = table.key_mut("user-parameters") {
            key.leaf_decor_mut().set_prefix(words.concat());
        }
    }
    let configuration = project.configuration.as_deref().map(octets);
    put_known(&mut table, "configuration", configuration, "Chk_Cfg");
    if !project.allocation.is_empty() {
        put(&mut table, "allocation", strings(&project.allocation), "what the scanner asks of it");
    }
    for (key, rate) in [
        ("expected-packet-rate-explicit", project.expected_packet_rates.explicit),
        ("expected-packet-rate-poll", project.expected_packet_rates.poll),
        ("expected-packet-rate-change", project.expected_packet_rates.change_of_state),
    ] {
        put_known(&mut table, key, rate.map(i64::from), "ms");
    }
    table
}
