//! The files that configuration tools know devices by: EDS on DeviceNet, GSD on PROFIBUS.
//!
//! They are walks over the rows that answer the wire: names, types, limits, defaults and paths
//! stand in the catalogue and in the rows, and nowhere else. What no row knows, because the devices
//! do not tell it either, stands here.
//!
//! [`sheets`] gives all files, [`sheet_for`] the one of a product. [`hilo`] splits a number of 32
//! bits for tools that take words only, and [`from_hilo`] puts it together.
//!
//! The files are made anew each time, and each time the same: their dates belong to their revision.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic)
)]

mod eds;
mod gsd;
mod hilo;
mod lines;

use codewheel_device::Product;
use codewheel_device::product::Bus;

pub use hilo::{NotAWord, from_hilo, hilo};

/// One file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sheet {
    /// Its name, as the manuals print it.
    pub file_name: &'static str,
    /// What is in it: printable ASCII, lines ended by CR LF.
    pub text: String,
}

/// The ten EDS files, then the three GSD files.
pub fn sheets() -> impl Iterator<Item = Sheet> {
    let mut named = Vec::new();
    Product::all().filter_map(move |product| {
        if named.contains(&product.data_sheet) {
            return None;
        }
        named.push(product.data_sheet);
        Some(sheet_for(product))
    })
}

/// The file of a product: an EDS file of its own, or the GSD file of all products with its geometry.
#[must_use]
pub fn sheet_for(product: &Product) -> Sheet {
    let text = match product.bus {
        Bus::DeviceNet => eds::eds(product),
        Bus::Profibus => gsd::gsd(product),
    };
    Sheet { file_name: product.data_sheet, text }
}
