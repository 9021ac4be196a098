//! `codewheel get`: what an encoder can tell.

use std::io::Write;

use codewheel_commission::{Name, Value};
use codewheel_device::product::Bus;
use comfy_table::{Table, presets};

use super::encoder::Encoder;
use super::value::{self, Line};
use crate::arguments::commission::Format;
use crate::failure::Failure;

pub(super) fn run(encoder: &mut Encoder, names: &[Name], format: Format) -> Result<(), Failure> {
    let values = if names.is_empty() {
        encoder.session.values()?
    } else {
        let read = names.iter().map(|name| encoder.session.value(name));
        read.collect::<Result<Vec<_>, _>>()?
    };
    let mut out = std::io::stdout().lock();
    if format.json {
        for value in &values {
            let line = serde_json::to_string(&Line::from(value)).map_err(std::io::Error::from)?;
            writeln!(out, "{line}")?;
        }
        return Ok(());
    }
    match values.as_slice() {
        [value] if names.len() == 1 => writeln!(out, "{}", value::shown(value))?,
        values => writeln!(out, "{}", table(encoder.session.bus(), values))?,
    }
    Ok(())
}

fn table(bus: Bus, values: &[Value]) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["NAME", "VALUE", "UNIT", "TAKES", "PLACE", "WHAT"]);
    for value in values {
        let takes = match (value.range, value::known(bus, value)) {
            _ if !value.writable => String::new(),
            (_, (labels @ [_, ..], _)) => labels.join(", "),
            (Some((least, most)), _) if least == most => least.to_string(),
            (Some((least, most)), _) => format!("{least}–{most}"),
            (None, _) => String::new(),
        };
        table.add_row([
            &value.name,
            &value::shown(value),
            &value.unit,
            &takes,
            &value.place,
            &value::printable(&value.title),
        ]);
    }
    table.trim_fmt()
}
