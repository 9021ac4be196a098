//! `codewheel describe`: models in words, from the rows that answer the wire.

mod chapter;
mod devicenet;
mod profibus;

use std::io::Write;

use codewheel_device::Product;
use codewheel_device::product::Bus;

use crate::arguments::DescribeArguments;
use crate::document::{Body, Cell, Document, Fact, Section};
use crate::failure::Failure;
use crate::files;

pub(crate) fn run(arguments: &DescribeArguments) -> Result<(), Failure> {
    let documents = match (arguments.model, arguments.json) {
        (Some(model), _) => vec![(model.model.to_owned(), document(model))],
        (None, true) => Product::all().map(|of| (of.model.to_owned(), document(of))).collect(),
        (None, false) => [Bus::DeviceNet, Bus::Profibus]
            .map(|bus| (bus.to_string().to_lowercase(), chapter::of(bus)))
            .into(),
    };
    let mut shown = Vec::new();
    for (name, document) in documents {
        let (suffix, text) = if arguments.json {
            ("json", document.to_json().map_err(std::io::Error::from)?)
        } else if arguments.markdown {
            ("md", document.to_markdown())
        } else {
            ("txt", document.to_text())
        };
        shown.push((format!("{name}.{suffix}"), text));
    }
    let Some(folder) = &arguments.output.folder else {
        let apart = if arguments.json { "" } else { "\n" };
        let texts: Vec<_> = shown.into_iter().map(|(_, text)| text).collect();
        std::io::stdout().lock().write_all(texts.join(apart).as_bytes())?;
        return Ok(());
    };
    files::keep(folder, &shown, arguments.output.force)
}

/// What there is to know of one model.
fn document(product: &'static Product) -> Document {
    let sections = match product.bus {
        Bus::DeviceNet => devicenet::sections(product),
        Bus::Profibus => profibus::sections(product),
    };
    Document { title: product.title.to_owned(), model: Some(product.model), sections }
}

/// What every model has, with what its bus adds in between: the bus itself first, the rest behind
/// the geometry.
fn product(product: &Product, mut of_bus: Vec<Fact>) -> Section {
    let geometry = product.encoder.geometry;
    let has_cell = product.encoder.lithium_cell;
    let cell = if has_cell { "yes, with a low-voltage warning" } else { "no" };
    let rest = of_bus.split_off(1);
    let mut facts = of_bus;
    facts.extend([
        Fact::new("shaft", "Shaft", product.family.shaft().to_string()),
        Fact::new("steps-per-turn", "Steps per turn", geometry.singleturn_resolution()),
        Fact::new("turns", "Turns", geometry.revolutions()),
    ]);
    facts.extend(rest);
    facts.extend([
        Fact::new("product-name", "Product name", product.product_name),
        Fact::new("lithium-cell", "Lithium cell", Cell::both(cell, has_cell)),
    ]);
    Section::new("product", "", Body::Facts(facts))
}
