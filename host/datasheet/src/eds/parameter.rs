//! What an EDS file says of a parameter: the row, seen as the Parameter object (class 0Fh) shows it.

use codewheel_device::Product;
use codewheel_device::devicenet::parameter::{LINKS, range};
use codewheel_device::devicenet::rows::{ROWS, Range, Row, Value, View};
use codewheel_encoder::Encoder;

/// One parameter.
#[derive(Debug)]
pub(super) struct Parameter {
    /// The instance of the Parameter object, 1 … 19.
    pub(super) instance: usize,
    pub(super) row: &'static Row,
    /// The smallest and the largest value it can ever take.
    pub(super) limits: Range,
    /// What a new device has.
    pub(super) default: i64,
}

/// All parameters of a product, in the order of their instances.
pub(super) fn all(product: &Product) -> Vec<Parameter> {
    let encoder = Encoder::with_defaults(product.encoder);
    let rows = LINKS.into_iter().filter_map(Row::find);
    (1..)
        .zip(rows)
        .map(|(instance, row)| Parameter {
            instance,
            row,
            limits: widest(row, product),
            default: number(row, View { product, encoder: &encoder }),
        })
        .collect()
}

fn number(row: &Row, view: View<'_>) -> i64 {
    match (row.read)(view) {
        Value::Number(number) => number,
        // No parameter refers to the list of attributes.
        Value::Octets(_) => 0,
    }
}

/// The limits over all settings. Those of a device follow what is in force there (on a singleturn
/// encoder the total resolution is the steps per turn), a file is written once (decision).
fn widest(row: &Row, product: &Product) -> Range {
    let mut widest =
        range(row, View { product, encoder: &Encoder::with_defaults(product.encoder) });
    for setting in &ROWS {
        let (Some(write), Some(allowed)) = (setting.write, setting.range) else { continue };
        let new = Encoder::with_defaults(product.encoder);
        let Range { minimum, maximum } = allowed(View { product, encoder: &new });
        for value in [minimum, maximum] {
            let mut encoder = Encoder::with_defaults(product.encoder);
            // What is refused changes nothing, so it widens nothing.
            let _ = write(&mut encoder, value);
            let limits = range(row, View { product, encoder: &encoder });
            widest.minimum = widest.minimum.min(limits.minimum);
            widest.maximum = widest.maximum.max(limits.maximum);
        }
    }
    widest
}
