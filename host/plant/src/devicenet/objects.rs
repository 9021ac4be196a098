//! What can be read of a DeviceNet encoder and set: its identity, and class 2Fh.

use codewheel_device::DeviceNetEncoder;
use codewheel_device::devicenet::Factory;
use codewheel_device::devicenet::rows::{ENCODER_POSITION, ROWS, Row, Source, Value as RowValue};
use codewheel_encoder::Sensor;

use super::DeviceNet;
use crate::field_bus::Outfit;
use crate::{Object, ObjectGroup, Value};

pub(super) fn objects<S: Sensor>(
    outfit: &Outfit<DeviceNet>,
    encoder: Option<&DeviceNetEncoder<S>>,
) -> Vec<ObjectGroup> {
    vec![
        ObjectGroup {
            title: "Encoder Position object, class 2Fh instance 1",
            objects: ROWS.iter().map(|row| object(row, encoder)).collect(),
        },
        ObjectGroup { title: "Identity object, class 01h instance 1", objects: identity(outfit) },
    ]
}

fn object<S: Sensor>(row: &'static Row, encoder: Option<&DeviceNetEncoder<S>>) -> Object {
    let setting = row.source == Source::Parameter;
    let why_not = match (row.write, encoder) {
        (None, _) => Some("the device tells it".to_owned()),
        (Some(_), None) => Some("the device has no power".to_owned()),
        (Some(_), Some(_)) => None,
    };
    Object {
        key: row.key.to_owned(),
        place: format!("{ENCODER_POSITION:02X}h/1/{}", row.attribute),
        title: row.name,
        data_type: row.data_type.name(),
        unit: row.unit,
        help: row.help,
        note: row.note,
        setting,
        why_not,
        range: encoder
            .and_then(|encoder| encoder.range(row))
            .map(|range| (range.minimum, range.maximum)),
        values: row.values,
        value: encoder.map(|encoder| value(encoder.read(row))),
        saved: encoder
            .filter(|_| setting || row.key == "offset")
            .and_then(|encoder| encoder.read_saved(row))
            .map(value),
    }
}

fn value(value: RowValue) -> Value {
    match value {
        RowValue::Number(number) => Value::Number(number),
        RowValue::Octets(octets) => {
            let octets: Vec<_> = octets.iter().map(ToString::to_string).collect();
            Value::Text(octets.join(" "))
        }
    }
}

/// The Identity object as the stack answers it (AMG manual §7).
fn identity(outfit: &Outfit<DeviceNet>) -> Vec<Object> {
    let product = outfit.product;
    let Factory { vendor, device_type, serial } = Factory::with_serial(outfit.serial);
    let number = |number: u32| Value::Number(number.into());
    let rows = [
        (1, "vendor", "Vendor ID", "UINT", number(vendor.into())),
        (2, "device-type", "Device type", "UINT", number(device_type.into())),
        (3, "product-code", "Product code", "UINT", number(product.product_code().into())),
        (6, "serial-number", "Serial number", "UDINT", number(serial)),
        (
            7,
            "product-name",
            "Product name",
            "SHORT_STRING",
            Value::Text(product.product_name.to_owned()),
        ),
    ];
    rows.into_iter()
        .map(|(attribute, key, title, data_type, value)| Object {
            key: key.to_owned(),
            place: format!("01h/1/{attribute}"),
            title,
            data_type,
            unit: "",
            help: "What the device says it is",
            note: "",
            setting: false,
            why_not: Some("the factory has set it".to_owned()),
            range: None,
            values: &[],
            value: Some(value),
            saved: None,
        })
        .collect()
}
