//! A PROFIBUS model in sections.

use codewheel_device::Product;
use codewheel_device::product::Shaft;
use codewheel_device::profibus::{IDENT_NUMBER, configuration, diagnosis, parameters};
use codewheel_encoder::ssi::Word;
use codewheel_sim::rs485::longest_cable;
use codewheel_station::rs485::BaudRate;
use serde_json::json;

use super::product;
use crate::document::{Body, Cell, Fact, Section, Table, column, prose};

pub(super) fn sections(of: &'static Product) -> Vec<Section> {
    let facts = vec![
        Fact::new("bus", "Bus", "PROFIBUS-DP, DP-V0 slave, encoder profile 1.1 class 1 and 2"),
        Fact::new(
            "ident-number",
            "Ident number",
            Cell::both(format!("{IDENT_NUMBER:04X}h"), IDENT_NUMBER),
        ),
        Fact::new("bit-rates", "Bit rates", format!("{}, found by itself", names(&BaudRate::ALL))),
        Fact::new("gsd-file", "GSD file", Cell::literal(of.data_sheet)),
    ];
    let mut sections = vec![product(of, facts)];
    if of.family.shaft() == Shaft::None {
        sections.push(ssi(of));
    }
    sections.extend([switches(), terminals(), lamp(), cable(), configurations()]);
    sections.extend([set_prm(of), slave_diag()]);
    sections
}

fn names(rates: &[BaudRate]) -> String {
    rates.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

fn ssi(product: &Product) -> Section {
    let words = Word::choices(product.encoder.geometry);
    let words: Vec<_> = words.iter().map(|word| word.bits().to_string()).collect();
    let word = format!("{} bits, Gray (default) or binary", words.join(" (default) or "));
    let facts = vec![
        Fact::new("word", "Word", word),
        Fact::new(
            "clock",
            "Clock",
            "100 kHz to 1 MHz, default 500 kHz; a reading each millisecond",
        ),
        Fact::new("monoflop", "Monoflop", "default 20 µs"),
    ];
    Section::new("ssi", "SSI input", Body::Facts(facts))
}

fn switches() -> Section {
    let facts = vec![
        Fact::new(
            "address",
            "Address",
            "rotary switch 1 tens, switch 2 units; station address 0–99, delivered as 00",
        ),
        Fact::new(
            "termination",
            "Termination",
            "two-pole DIP switch; ON at the last device of the bus line, delivered OFF",
        ),
        Fact::new("resistors", "Resistors", "390 Ω A to GND, 390 Ω B to +5 V, 220 Ω A to B"),
    ];
    Section::new("switches", "Switches (read at power-up)", Body::Facts(facts))
}

fn terminals() -> Section {
    let terminals = [
        ("A, B", "the negative and the positive data line, each twice"),
        ("UB, GND", "the supply, 10–30 V DC"),
    ];
    let columns = [column("terminal", "TERMINAL"), column("meaning", "MEANING")];
    Section::new("terminals", "Terminals", Body::Table(Table::pairs(columns, terminals)))
}

fn lamp() -> Section {
    let states = [
        ("off", "no power"),
        ("yellow", "on the way to the exchange of data"),
        ("green", "data is exchanged"),
        ("red", "position error, 2.5 s; or a fault of the SSI line"),
        ("red flashing", "1 Hz: parameters or configuration refused"),
        ("red flashing", "5 Hz: preset out of range"),
    ];
    let columns = [column("lamp", "LAMP"), column("meaning", "MEANING")];
    Section::new("lamp", "Lamp", Body::Table(Table::pairs(columns, states)))
}

fn cable() -> Section {
    let mut lengths = Vec::new();
    let mut rates = BaudRate::ALL.as_slice();
    while let Some(first) = rates.first() {
        let longest = longest_cable(*first);
        let alike = rates.partition_point(|rate| longest_cable(*rate) == longest);
        let length = Cell::both(format!("{longest} m"), longest);
        lengths.push((length, format!("at {}", names(&rates[..alike])).into()));
        rates = &rates[alike..];
    }
    let columns = [column("longest", "LENGTH"), column("rates", "RATES")];
    Section::new("cable", "Cable of type A, at most", Body::Table(Table::pairs(columns, lengths)))
}

fn configurations() -> Section {
    let mut table = Table::new(vec![
        column("identifier", "ID"),
        column("class", "CLASS"),
        column("input", "INPUT"),
        column("output", "OUTPUT"),
        column("help", "MEANING"),
    ]);
    let octets = |count: u8| match count {
        0 => Cell::both("none", 0),
        count => Cell::both(format!("{count} octets"), count),
    };
    for row in &configuration::ROWS {
        table.rows.push(vec![
            Cell::both(format!("{:02X}h", row.identifier), row.identifier),
            u32::from(row.class).into(),
            octets(row.inputs),
            octets(row.outputs),
            row.help.into(),
        ]);
    }
    Section::new("configurations", "Configurations (Chk_Cfg)", Body::Table(table))
}

fn set_prm(product: &Product) -> Section {
    let mut table = Table::new(vec![
        column("octets", "OCTETS"),
        column("bit", "BIT"),
        column("name", "NAME"),
        column("key", "KEY"),
        column("default", "DEFAULT"),
        column("range", "RANGE"),
        prose("help", "MEANING"),
    ]);
    for row in parameters::ROWS {
        let default = (row.default)(product.encoder);
        let range = (row.range)(product.encoder);
        let named = usize::try_from(default).ok().and_then(|place| row.values.get(place));
        let limits = format!("{} … {} {}", range.start(), range.end(), row.unit);
        let space = if row.note.is_empty() { "" } else { " " };
        table.rows.push(vec![
            octets(&row.octets.to_string()),
            match row.field {
                parameters::Field::Bit(bit) => u32::from(bit).into(),
                parameters::Field::Unsigned32 { .. } => Cell::empty(),
            },
            row.name.into(),
            Cell::literal(row.key),
            match named {
                Some(name) => Cell::both(format!("{default} ({name})"), default),
                None => default.into(),
            },
            Cell::both(
                limits.trim_end(),
                json!({ "minimum": range.start(), "maximum": range.end() }),
            ),
            format!("{}.{space}{}", row.help, row.note).into(),
        ]);
    }
    Section::new("parameters", "Parameters (Set_Prm, from octet 9 on)", Body::Table(table))
}

fn slave_diag() -> Section {
    let mut table = Table::new(vec![
        column("octets", "OCTETS"),
        column("class", "CLASS"),
        column("name", "NAME"),
        column("key", "KEY"),
        column("help", "MEANING"),
    ]);
    for row in &diagnosis::ROWS {
        let bits: Vec<_> =
            row.bits.iter().map(|bit| format!("bit {} {}", bit.bit, bit.name)).collect();
        let meaning = if bits.is_empty() {
            row.help.to_owned()
        } else {
            format!("{}: {}", row.help, bits.join(", "))
        };
        table.rows.push(vec![
            octets(&row.octets.to_string()),
            u32::from(row.class).into(),
            row.name.into(),
            Cell::literal(row.key),
            meaning.into(),
        ]);
    }
    let title = format!(
        "Diagnosis (Slave_Diag, from octet 7 on; class 1 ends with octet {})",
        diagnosis::CLASS_1_OCTETS
    );
    Section::new("diagnosis", title, Body::Table(table))
}

/// `10–13` of `octets 10–13`.
fn octets(text: &str) -> Cell {
    text.trim_start_matches(|letter: char| !letter.is_ascii_digit()).into()
}
