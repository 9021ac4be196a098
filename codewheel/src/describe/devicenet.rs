//! A DeviceNet model in words.

use std::io::Write;

use codewheel_device::Product;
use codewheel_device::devicenet::rows::{ENCODER_POSITION, ROWS, Row, Source, Value, View};
use codewheel_encoder::Encoder;
use comfy_table::{Table, presets};

use super::facts;
use crate::failure::Failure;

pub(super) fn describe(product: &Product, out: &mut impl Write) -> Result<(), Failure> {
    facts(
        product,
        &[
            ("Bus", "DeviceNet, Group 2 Only Server, 125k, 250k, 500k".to_owned()),
            ("Product code", format!("{:02X}h", product.product_code())),
            ("EDS file", product.data_sheet.to_owned()),
        ],
        out,
    )?;
    writeln!(
        out,
        "\nSwitches (read at power-up)
  Address         rotary switch 1 tens, switch 2 units; MAC ID 0–63, delivered as 00
  Bit rate        DIP 2 and 3: OFF OFF 125k, OFF ON 250k, ON OFF 500k, ON ON 125k; DIP 1 any
  Termination     one DIP switch; ON at the last device of the bus line, delivered OFF

Lamp
  off             no power, or the duplicate MAC ID check is not finished
  green flashing  on-line, no connection
  green           a connection is established
  red flashing    an I/O connection has timed out
  red             duplicate MAC ID, bus-off, or the address switches above 63

I/O assemblies (poll)
  1               position, 4 octets, low octet first
  2               position, then bit 0 alarm flag, bit 1 warning flag: 5 octets
"
    )?;
    writeln!(out, "Encoder Position object, class {ENCODER_POSITION:02X}h instance 1")?;
    let encoder = Encoder::with_defaults(product.encoder);
    let view = View { product, encoder: &encoder };
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["ATTR", "NAME", "KEY", "TYPE", "ACCESS", "DEFAULT", "RANGE"]);
    for row in &ROWS {
        table.add_row([
            row.attribute.to_string(),
            row.name.to_owned(),
            row.key.to_owned(),
            row.data_type.name().to_owned(),
            if row.write.is_some() { "read/write" } else { "read" }.to_owned(),
            default(row, view),
            range(row, view),
        ]);
    }
    writeln!(out, "{}\n", table.trim_fmt())?;
    for row in &ROWS {
        let space = if row.note.is_empty() { "" } else { " " };
        writeln!(out, "  {:<24}{}.{space}{}", row.key, row.help, row.note)?;
    }
    writeln!(
        out,
        "\nServices: 0Eh get, 10h set, 05h reset (defaults), 15h restore, 16h save. What is set is \
         lost with the power unless it is saved."
    )?;
    Ok(())
}

/// The value of a new device, where it does not depend on the shaft.
fn default(row: &Row, view: View<'_>) -> String {
    let fixed = row.source == Source::Parameter || row.range.is_none();
    match (row.read)(view) {
        Value::Number(value) if fixed => match usize::try_from(value) {
            Ok(place) if row.values.get(place).is_some_and(|name| !name.is_empty()) => {
                format!("{value} ({})", row.values[place])
            }
            _ => value.to_string(),
        },
        _ => String::new(),
    }
}

fn range(row: &Row, view: View<'_>) -> String {
    let Some(range) = row.range else { return String::new() };
    let range = range(view);
    if row.unit.is_empty() {
        format!("{} … {}", range.minimum, range.maximum)
    } else {
        format!("{} … {} {}", range.minimum, range.maximum, row.unit)
    }
}
