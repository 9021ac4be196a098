//! A PROFIBUS model in words.

use std::io::Write;

use codewheel_device::Product;
use codewheel_device::product::Shaft;
use codewheel_device::profibus::{IDENT_NUMBER, configuration, diagnosis, parameters};
use codewheel_encoder::ssi::Word;
use codewheel_sim::rs485::longest_cable;
use codewheel_station::rs485::BaudRate;
use comfy_table::{Table, presets};

use super::facts;
use crate::failure::Failure;

pub(super) fn describe(product: &Product, out: &mut impl Write) -> Result<(), Failure> {
    let rates: Vec<_> = BaudRate::ALL.iter().map(ToString::to_string).collect();
    facts(
        product,
        &[
            ("Bus", "PROFIBUS-DP, DP-V0 slave, encoder profile 1.1 class 1 and 2".to_owned()),
            ("Ident number", format!("{IDENT_NUMBER:04X}h")),
            ("Bit rates", format!("{}, found by itself", rates.join(", "))),
            ("GSD file", product.data_sheet.to_owned()),
        ],
        out,
    )?;
    if product.family.shaft() == Shaft::None {
        ssi(product, out)?;
    }
    writeln!(
        out,
        "\nSwitches (read at power-up)
  Address         rotary switch 1 tens, switch 2 units; station address 0–99, delivered as 00
  Termination     two-pole DIP switch; ON at the last device of the bus line, delivered OFF:
                  390 Ω A to GND, 390 Ω B to +5 V, 220 Ω A to B

Terminals
  A, B            the negative and the positive data line, each twice
  UB, GND         the supply, 10–30 V DC

Lamp
  off             no power
  yellow          on the way to the exchange of data
  green           data is exchanged
  red             position error, 2.5 s; or a fault of the SSI line
  red flashing    1 Hz: parameters or configuration refused
  red flashing    5 Hz: preset out of range
"
    )?;
    writeln!(out, "Cable of type A, at most")?;
    let mut rates = BaudRate::ALL.as_slice();
    while let Some(first) = rates.first() {
        let longest = longest_cable(*first);
        let alike = rates.partition_point(|rate| longest_cable(*rate) == longest);
        let names: Vec<_> = rates[..alike].iter().map(ToString::to_string).collect();
        writeln!(out, "  {:<16}at {}", format!("{longest} m"), names.join(", "))?;
        rates = &rates[alike..];
    }
    configurations(out)?;
    set_prm(product, out)?;
    slave_diag(out)
}

fn ssi(product: &Product, out: &mut impl Write) -> Result<(), Failure> {
    let words = Word::choices(product.encoder.geometry);
    let words: Vec<_> = words.iter().map(|word| word.bits().to_string()).collect();
    writeln!(
        out,
        "\nSSI input
  Word            {} bits, Gray (default) or binary
  Clock           100 kHz to 1 MHz, default 500 kHz; a reading each millisecond
  Monoflop        default 20 µs",
        words.join(" (default) or ")
    )?;
    Ok(())
}

fn table(header: impl IntoIterator<Item = &'static str>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(header);
    table
}

fn configurations(out: &mut impl Write) -> Result<(), Failure> {
    writeln!(out, "\nConfigurations (Chk_Cfg)")?;
    let mut table = table(["ID", "CLASS", "INPUT", "OUTPUT", "MEANING"]);
    for row in &configuration::ROWS {
        table.add_row([
            format!("{:02X}h", row.identifier),
            row.class.to_string(),
            format!("{} octets", row.inputs),
            if row.outputs == 0 { "none".to_owned() } else { format!("{} octets", row.outputs) },
            row.help.to_owned(),
        ]);
    }
    writeln!(out, "{}", table.trim_fmt())?;
    Ok(())
}

fn set_prm(product: &Product, out: &mut impl Write) -> Result<(), Failure> {
    writeln!(out, "\nParameters (Set_Prm, from octet 9 on)")?;
    let mut table = table(["OCTETS", "BIT", "NAME", "KEY", "DEFAULT", "RANGE"]);
    for row in parameters::ROWS {
        let default = (row.default)(product.encoder);
        let range = (row.range)(product.encoder);
        let named = usize::try_from(default).ok().and_then(|place| row.values.get(place));
        table.add_row([
            octets(&row.octets.to_string()),
            match row.field {
                parameters::Field::Bit(bit) => bit.to_string(),
                parameters::Field::Unsigned32 { .. } => String::new(),
            },
            row.name.to_owned(),
            row.key.to_owned(),
            named.map_or(default.to_string(), |name| format!("{default} ({name})")),
            format!("{} … {} {}", range.start(), range.end(), row.unit).trim_end().to_owned(),
        ]);
    }
    writeln!(out, "{}\n", table.trim_fmt())?;
    for row in parameters::ROWS {
        let space = if row.note.is_empty() { "" } else { " " };
        writeln!(out, "  {:<26}{}.{space}{}", row.key, row.help, row.note)?;
    }
    Ok(())
}

fn slave_diag(out: &mut impl Write) -> Result<(), Failure> {
    writeln!(
        out,
        "\nDiagnosis (Slave_Diag, from octet 7 on; class 1 ends with octet {})",
        diagnosis::CLASS_1_OCTETS
    )?;
    let mut table = table(["OCTETS", "CLASS", "NAME", "KEY", "MEANING"]);
    for row in &diagnosis::ROWS {
        let bits: Vec<_> =
            row.bits.iter().map(|bit| format!("bit {} {}", bit.bit, bit.name)).collect();
        let meaning = if bits.is_empty() {
            row.help.to_owned()
        } else {
            format!("{}: {}", row.help, bits.join(", "))
        };
        table.add_row([
            octets(&row.octets.to_string()),
            row.class.to_string(),
            row.name.to_owned(),
            row.key.to_owned(),
            meaning,
        ]);
    }
    writeln!(out, "{}", table.trim_fmt())?;
    Ok(())
}

/// `10–13` of `octets 10–13`.
fn octets(text: &str) -> String {
    text.trim_start_matches(|letter: char| !letter.is_ascii_digit()).to_owned()
}
