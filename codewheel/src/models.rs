//! `codewheel models`: the catalogue.

use std::io::Write;

use codewheel_device::{Product, product};
use comfy_table::{Table, presets};
use serde::Serialize;

use crate::arguments::ModelsArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Line<'a> {
    model: &'a str,
    title: &'a str,
    bus: &'a str,
    product_code: u16,
    product_name: &'a str,
    shaft: &'a str,
    singleturn_resolution: u32,
    revolutions: u32,
    lithium_cell: bool,
    eds_file: &'a str,
}

impl<'a> From<&'a Product> for Line<'a> {
    fn from(product: &'a Product) -> Self {
        let geometry = product.encoder.geometry;
        Self {
            model: product.model,
            title: product.title,
            bus: "DeviceNet",
            product_code: product.product_code(),
            product_name: product.product_name,
            shaft: if product.family.has_hollow_shaft() { "hollow" } else { "solid" },
            singleturn_resolution: geometry.singleturn_resolution(),
            revolutions: geometry.revolutions(),
            lithium_cell: product.encoder.lithium_cell,
            eds_file: product.eds_file,
        }
    }
}

pub(crate) fn run(arguments: &ModelsArguments) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let lines = product::DEVICENET.iter().map(Line::from);
    if arguments.json {
        for line in lines {
            let text = serde_json::to_string(&line).map_err(std::io::Error::from)?;
            writeln!(out, "{text}")?;
        }
        return Ok(());
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["MODEL", "PRODUCT", "BUS", "SHAFT", "STEPS/TURN", "TURNS", "EDS FILE"]);
    for line in lines {
        table.add_row([
            line.model,
            line.title,
            line.bus,
            line.shaft,
            &line.singleturn_resolution.to_string(),
            &line.revolutions.to_string(),
            line.eds_file,
        ]);
    }
    writeln!(out, "{}", table.trim_fmt())?;
    Ok(())
}
