//! A DeviceNet model in sections.

use codewheel_device::Product;
use codewheel_device::devicenet::rows::{ENCODER_POSITION, ROWS, Row, Source, Value, View};
use codewheel_encoder::Encoder;
use serde_json::json;

use super::product;
use crate::document::{Body, Cell, Fact, Section, Table, column, prose};

pub(super) fn sections(of: &'static Product) -> Vec<Section> {
    let code = of.product_code();
    let facts = vec![
        Fact::new("bus", "Bus", "DeviceNet, Group 2 Only Server, 125k, 250k, 500k"),
        Fact::new("product-code", "Product code", Cell::both(format!("{code:02X}h"), code)),
        Fact::new("eds-file", "EDS file", Cell::literal(of.data_sheet)),
    ];
    vec![product(of, facts), switches(), lamp(), assemblies(), attributes(of), services()]
}

fn switches() -> Section {
    let facts = vec![
        Fact::new(
            "address",
            "Address",
            "rotary switch 1 tens, switch 2 units; MAC ID 0–63, delivered as 00",
        ),
        Fact::new(
            "bit-rate",
            "Bit rate",
            "DIP 2 and 3: OFF OFF 125k, OFF ON 250k, ON OFF 500k, ON ON 125k; DIP 1 any",
        ),
        Fact::new(
            "termination",
            "Termination",
            "one DIP switch; ON at the last device of the bus line, delivered OFF",
        ),
    ];
    Section::new("switches", "Switches (read at power-up)", Body::Facts(facts))
}

fn lamp() -> Section {
    let states = [
        ("off", "no power, or the duplicate MAC ID check is not finished"),
        ("green flashing", "on-line, no connection"),
        ("green", "a connection is established"),
        ("red flashing", "an I/O connection has timed out"),
        ("red", "duplicate MAC ID, bus-off, or the address switches above 63"),
    ];
    let columns = [column("lamp", "LAMP"), column("meaning", "MEANING")];
    Section::new("lamp", "Lamp", Body::Table(Table::pairs(columns, states)))
}

fn assemblies() -> Section {
    let assemblies = [
        ("1", "position, 4 octets, low octet first"),
        ("2", "position, then bit 0 alarm flag, bit 1 warning flag: 5 octets"),
    ];
    let columns = [column("assembly", "ASSEMBLY"), column("content", "CONTENT")];
    let table = Table::pairs(columns, assemblies);
    Section::new("assemblies", "I/O assemblies", Body::Table(table)).with_note(
        "Attribute 14 of the connection chooses one, and the choice is kept without Save.",
    )
}

fn attributes(product: &'static Product) -> Section {
    let encoder = Encoder::with_defaults(product.encoder);
    let view = View { product, encoder: &encoder };
    let mut table = Table::new(vec![
        column("attribute", "ATTR"),
        column("name", "NAME"),
        column("key", "KEY"),
        column("type", "TYPE"),
        column("access", "ACCESS"),
        column("default", "DEFAULT"),
        column("range", "RANGE"),
        prose("help", "MEANING"),
    ]);
    for row in &ROWS {
        let space = if row.note.is_empty() { "" } else { " " };
        table.rows.push(vec![
            u32::from(row.attribute).into(),
            row.name.into(),
            Cell::literal(row.key),
            row.data_type.name().into(),
            if row.write.is_some() { "read/write" } else { "read" }.into(),
            default(row, view),
            range(row, view),
            format!("{}.{space}{}", row.help, row.note).into(),
        ]);
    }
    let title = format!("Encoder Position object, class {ENCODER_POSITION:02X}h instance 1");
    Section::new("attributes", title, Body::Table(table))
}

fn services() -> Section {
    let services = [
        ("0Eh", "get one attribute"),
        ("10h", "set one attribute"),
        ("05h", "reset: the defaults"),
        ("15h", "restore: what was saved"),
        ("16h", "save"),
    ];
    let columns = [column("service", "SERVICE"), column("meaning", "MEANING")];
    Section::new("services", "Services", Body::Table(Table::pairs(columns, services)))
        .with_note("What is set is lost with the power unless it is saved.")
}

/// The value of a new device, where it does not depend on the shaft.
fn default(row: &Row, view: View<'_>) -> Cell {
    let fixed = row.source == Source::Parameter || row.range.is_none();
    match (row.read)(view) {
        Value::Number(value) if fixed => {
            let name = usize::try_from(value).ok().and_then(|place| row.values.get(place));
            match name.filter(|name| !name.is_empty()) {
                Some(name) => Cell::both(format!("{value} ({name})"), value),
                None => Cell::both(value.to_string(), value),
            }
        }
        _ => Cell::empty(),
    }
}

fn range(row: &Row, view: View<'_>) -> Cell {
    let Some(range) = row.range else { return Cell::empty() };
    let range = range(view);
    let text = format!("{} … {} {}", range.minimum, range.maximum, row.unit);
    let value = json!({ "minimum": range.minimum, "maximum": range.maximum });
    Cell::both(text.trim_end(), value)
}
