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
        ObjectGroup {
            title: "Identity object, class 01h instance 1",
            objects: identity(outfit, encoder),
        },
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

/// The Identity object as the stack answers it (AMG manual §5); without power, what the factory has
/// put into the device.
fn identity<S: Sensor>(
    outfit: &Outfit<DeviceNet>,
    encoder: Option<&DeviceNetEncoder<S>>,
) -> Vec<Object> {
    let product = outfit.product;
    let Factory { vendor, device_type, serial } = Factory::with_serial(outfit.serial);
    let revision = encoder.map(DeviceNetEncoder::identity).map(|identity| {
        Value::Text(format!("{}.{}", identity.major_revision, identity.minor_revision))
    });
    let status = encoder.map(|encoder| Value::Number(encoder.identity_status().into()));
    let number = |number: u32| Some(Value::Number(number.into()));
    let name = Some(Value::Text(product.product_name.to_owned()));
    let says = "What the device says it is";
    let states = "Bit 0: a master owns the device. Bit 2: it is configured. Bit 8: its memory is \
                  damaged";
    let rows = [
        (1, "vendor", "Vendor ID", "UINT", says, number(vendor.into())),
        (2, "device-type", "Device type", "UINT", says, number(device_type.into())),
        (3, "product-code", "Product code", "UINT", says, number(product.product_code().into())),
        (4, "revision", "Revision", "2 USINT", says, revision),
        (5, "status", "Status", "WORD", states, status),
        (6, "serial-number", "Serial number", "UDINT", says, number(serial)),
        (7, "product-name", "Product name", "SHORT_STRING", says, name),
    ];
    rows.into_iter()
        .map(|(attribute, key, title, data_type, help, value)| Object {
            key: key.to_owned(),
            place: format!("01h/1/{attribute}"),
            title,
            data_type,
            unit: "",
            help,
            note: "",
            setting: false,
            why_not: Some("the device tells it".to_owned()),
            range: None,
            values: &[],
            value,
            saved: None,
        })
        .collect()
}
