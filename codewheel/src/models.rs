//! `codewheel models`: the catalogue.

use std::io::Write;

use codewheel_device::Product;
use codewheel_device::product::Bus;
use codewheel_device::profibus::IDENT_NUMBER;
use comfy_table::{Table, presets};
use serde::Serialize;

use crate::arguments::ModelsArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Line<'a> {
    model: &'a str,
    title: &'a str,
    bus: String,
    /// Of a DeviceNet model.
    #[serde(skip_serializing_if = "Option::is_none")]
    product_code: Option<u16>,
    /// Of a PROFIBUS model.
    #[serde(skip_serializing_if = "Option::is_none")]
    ident_number: Option<u16>,
    product_name: &'a str,
    shaft: String,
    singleturn_resolution: u32,
    revolutions: u32,
    lithium_cell: bool,
    /// Of a DeviceNet model.
    #[serde(skip_serializing_if = "Option::is_none")]
    eds_file: Option<&'a str>,
    /// Of a PROFIBUS model.
    #[serde(skip_serializing_if = "Option::is_none")]
    gsd_file: Option<&'a str>,
}

impl<'a> From<&'a Product> for Line<'a> {
    fn from(product: &'a Product) -> Self {
        let geometry = product.encoder.geometry;
        Self {
            model: product.model,
            title: product.title,
            bus: product.bus.to_string(),
            product_code: (product.bus == Bus::DeviceNet).then(|| product.product_code()),
            ident_number: (product.bus == Bus::Profibus).then_some(IDENT_NUMBER),
            product_name: product.product_name,
            shaft: product.family.shaft().to_string(),
            singleturn_resolution: geometry.singleturn_resolution(),
            revolutions: geometry.revolutions(),
            lithium_cell: product.encoder.lithium_cell,
            eds_file: (product.bus == Bus::DeviceNet).then_some(product.data_sheet),
            gsd_file: (product.bus == Bus::Profibus).then_some(product.data_sheet),
        }
    }
}

pub(crate) fn run(arguments: &ModelsArguments) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let lines = Product::all().map(Line::from);
    if arguments.json {
        for line in lines {
            let text = serde_json::to_string(&line).map_err(std::io::Error::from)?;
            writeln!(out, "{text}")?;
        }
        return Ok(());
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["MODEL", "PRODUCT", "BUS", "SHAFT", "STEPS/TURN", "TURNS", "DATA SHEET"]);
    for line in lines {
        table.add_row([
            line.model,
            line.title,
            &line.bus,
            &line.shaft,
            &line.singleturn_resolution.to_string(),
            &line.revolutions.to_string(),
            line.eds_file.or(line.gsd_file).unwrap_or_default(),
        ]);
    }
    writeln!(out, "{}", table.trim_fmt())?;
    Ok(())
}
