//! `codewheel describe`: one model in words, from the rows that answer the wire.

mod devicenet;
mod profibus;

use std::io::Write;

use codewheel_device::Product;
use codewheel_device::product::Bus;

use crate::arguments::DescribeArguments;
use crate::failure::Failure;

pub(crate) fn run(arguments: &DescribeArguments) -> Result<(), Failure> {
    let product = arguments.model;
    let mut out = std::io::stdout().lock();
    match product.bus {
        Bus::DeviceNet => devicenet::describe(product, &mut out),
        Bus::Profibus => profibus::describe(product, &mut out),
    }
}

/// What every model has, with what its bus adds in between: the bus itself first, the rest behind
/// the geometry.
fn facts(
    product: &Product,
    of_bus: &[(&str, String)],
    out: &mut impl Write,
) -> Result<(), Failure> {
    writeln!(out, "{} ({})", product.title, product.model)?;
    let geometry = product.encoder.geometry;
    let cell = if product.encoder.lithium_cell { "yes, with a low-voltage warning" } else { "no" };
    let (bus, rest) = of_bus.split_at(1);
    let mut all = bus.to_vec();
    all.extend([
        ("Shaft", product.family.shaft().to_string()),
        ("Steps per turn", geometry.singleturn_resolution().to_string()),
        ("Turns", geometry.revolutions().to_string()),
    ]);
    all.extend_from_slice(rest);
    all.extend([
        ("Product name", product.product_name.to_owned()),
        ("Lithium cell", cell.to_owned()),
    ]);
    for (name, fact) in all {
        writeln!(out, "  {name:<16}{fact}")?;
    }
    Ok(())
}
