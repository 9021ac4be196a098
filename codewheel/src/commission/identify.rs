//! `codewheel identify`: who an encoder says it is.

use std::io::Write;

use codewheel_commission::Identity;
use codewheel_device::product::Bus;
use comfy_table::{Table, presets};
use serde::Serialize;

use super::encoder::Encoder;
use crate::arguments::commission::Format;
use crate::failure::Failure;

/// An identity as JSON; what is not known is null.
#[derive(Debug, Serialize)]
pub(super) struct Line<'a> {
    models: Vec<&'static str>,
    vendor: Option<u16>,
    device_type: Option<u16>,
    product_code: u16,
    product_name: Option<&'a str>,
    revision: Option<String>,
    serial: Option<u32>,
    firmware: Option<&'a str>,
}

impl<'a> From<&'a Identity> for Line<'a> {
    fn from(identity: &'a Identity) -> Self {
        Self {
            models: identity.models.iter().map(|product| product.model).collect(),
            vendor: identity.vendor,
            device_type: identity.device_type,
            product_code: identity.product_code,
            product_name: identity.product_name.as_deref(),
            revision: revision(identity),
            serial: identity.serial,
            firmware: identity.firmware.as_deref(),
        }
    }
}

#[derive(Serialize)]
struct Whole<'a> {
    bus: String,
    address: u8,
    #[serde(flatten)]
    identity: Line<'a>,
}

/// `1.1`, as the revision is written.
pub(super) fn revision(identity: &Identity) -> Option<String> {
    identity.revision.map(|(major, minor)| format!("{major}.{minor}"))
}

/// The models it may be, in words.
pub(super) fn models(identity: &Identity) -> String {
    let models: Vec<_> = identity.models.iter().map(|product| product.model).collect();
    if models.is_empty() { "unknown".to_owned() } else { models.join(" or ") }
}

pub(super) fn run(encoder: &mut Encoder, format: Format) -> Result<(), Failure> {
    let identity = encoder.session.identify()?;
    let (bus, address) = (encoder.session.bus(), encoder.session.address());
    let mut out = std::io::stdout().lock();
    if format.json {
        let whole = Whole { bus: bus.to_string(), address, identity: (&identity).into() };
        writeln!(out, "{}", serde_json::to_string(&whole).map_err(std::io::Error::from)?)?;
        return Ok(());
    }
    let code = match bus {
        Bus::DeviceNet => "product code",
        Bus::Profibus => "ident number",
    };
    let hexadecimal = |number: u16| format!("{number} ({number:04X}h)");
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    let rows = [
        ("bus", Some(bus.to_string())),
        ("address", Some(address.to_string())),
        ("model", Some(models(&identity))),
        ("product name", identity.product_name.as_deref().map(super::value::printable)),
        (code, Some(hexadecimal(identity.product_code))),
        ("serial number", identity.serial.map(|serial| serial.to_string())),
        ("revision", revision(&identity)),
        ("firmware", identity.firmware.clone()),
        ("vendor", identity.vendor.map(|vendor| vendor.to_string())),
        ("device type", identity.device_type.map(|kind| kind.to_string())),
    ];
    for (what, text) in rows {
        if let Some(text) = text {
            table.add_row([what, &text]);
        }
    }
    writeln!(out, "{}", table.trim_fmt())?;
    Ok(())
}
