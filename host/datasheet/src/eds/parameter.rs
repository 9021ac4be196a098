//! What an EDS file says of a parameter: the row, seen as the Parameter object (class 0Fh) shows it.

use codewheel_device::Product;
use codewheel_device::devicenet::parameter::LINKS;
use codewheel_device::devicenet::rows::{
    DataType, ENCODER_POSITION, ROWS, Range, Row, Source, Value, View,
};
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

/// Descriptor: the value has names.
const ENUMERATED: u16 = 1 << 1;
/// Descriptor: the value cannot be set.
const READ_ONLY: u16 = 1 << 4;
/// Descriptor: the value changes by itself.
const MONITOR: u16 = 1 << 5;

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

impl Parameter {
    pub(super) fn path(&self) -> [u8; 6] {
        [0x20, ENCODER_POSITION, 0x24, 1, 0x30, self.row.attribute]
    }

    pub(super) fn descriptor(&self) -> u16 {
        let Row { values, write, source, changes, .. } = self.row;
        let enumerated = if values.is_empty() { 0 } else { ENUMERATED };
        let read_only = if write.is_none() { READ_ONLY } else { 0 };
        let monitor = if *source == Source::Reading && *changes { MONITOR } else { 0 };
        enumerated | read_only | monitor
    }

    /// The data type codes of CIP volume 1, appendix C.
    pub(super) const fn type_code(&self) -> u8 {
        match self.row.data_type {
            DataType::Bool => 0xC1,
            DataType::Dint => 0xC4,
            DataType::Usint | DataType::UsintArray => 0xC6,
            DataType::Uint => 0xC7,
            DataType::Udint => 0xC8,
        }
    }
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
        limits(row, View { product, encoder: &Encoder::with_defaults(product.encoder) });
    for setting in &ROWS {
        let (Some(write), Some(range)) = (setting.write, setting.range) else { continue };
        let new = Encoder::with_defaults(product.encoder);
        let Range { minimum, maximum } = range(View { product, encoder: &new });
        for value in [minimum, maximum] {
            let mut encoder = Encoder::with_defaults(product.encoder);
            // What is refused changes nothing, so it widens nothing.
            let _ = write(&mut encoder, value);
            let limits = limits(row, View { product, encoder: &encoder });
            widest.minimum = widest.minimum.min(limits.minimum);
            widest.maximum = widest.maximum.max(limits.maximum);
        }
    }
    widest
}

/// The limits that the Parameter object tells: the row's own, or what its names or its type allow.
fn limits(row: &Row, view: View<'_>) -> Range {
    if let Some(range) = row.range {
        return range(view);
    }
    if row.source == Source::Reading && !row.changes {
        // A value that never changes is its own limit.
        let value = number(row, view);
        return Range { minimum: value, maximum: value };
    }
    match (row.values.len(), row.data_type) {
        (2.., _) => Range { minimum: 0, maximum: row.values.len() as i64 - 1 },
        (_, DataType::Dint) => Range { minimum: i32::MIN.into(), maximum: i32::MAX.into() },
        (_, data_type) => {
            let bits = if data_type == DataType::Bool { 1 } else { 8 * data_type.octets() };
            Range { minimum: 0, maximum: (1 << bits) - 1 }
        }
    }
}
