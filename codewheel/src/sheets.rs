//! `codewheel eds` and `codewheel gsd`: the files that configuration tools know devices by.

use std::io::Write;

use codewheel_datasheet::{sheet_for, sheets};
use codewheel_device::Product;
use codewheel_device::product::Bus;

use crate::arguments::SheetArguments;
use crate::failure::Failure;
use crate::files;

/// The files of `bus`, or that of one model.
pub(crate) fn run(arguments: &SheetArguments, bus: Bus) -> Result<(), Failure> {
    let verb = verb(bus);
    let chosen = match (arguments.model, &arguments.output.folder) {
        (Some(model), _) if model.bus != bus => {
            let right = self::verb(model.bus);
            return Err(Failure::Usage(format!(
                "{} speaks {} and has no {} file: write codewheel {right} {}",
                model.model,
                model.bus,
                verb.to_uppercase(),
                model.model
            )));
        }
        (Some(model), None) => {
            std::io::stdout().lock().write_all(sheet_for(model).text.as_bytes())?;
            return Ok(());
        }
        (Some(model), Some(_)) => vec![sheet_for(model)],
        (None, Some(_)) => sheets().filter(|sheet| bus_of(sheet.file_name) == Some(bus)).collect(),
        (None, None) => {
            return Err(Failure::Usage(format!(
                "say which model, as in codewheel {verb} {}, or -o DIR for the files of all of them",
                Product::all().find(|product| product.bus == bus).map_or("MODEL", |one| one.model)
            )));
        }
    };
    let files: Vec<_> = chosen.into_iter().map(|sheet| (sheet.file_name, sheet.text)).collect();
    let Some(folder) = &arguments.output.folder else { return Ok(()) };
    files::keep(folder, &files, arguments.output.force)
}

const fn verb(bus: Bus) -> &'static str {
    match bus {
        Bus::DeviceNet => "eds",
        Bus::Profibus => "gsd",
    }
}

fn bus_of(file_name: &str) -> Option<Bus> {
    let product = Product::all().find(|product| product.data_sheet == file_name);
    product.map(|product| product.bus)
}
