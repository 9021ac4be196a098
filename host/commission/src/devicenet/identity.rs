//! Who a device says it is, and whether it is one of ours.

use codewheel_device::devicenet::rows::ENCODER_POSITION;
use codewheel_device::product::DEVICENET;
use codewheel_device::{Factory, Product};
use codewheel_devicenet::MacId;
use codewheel_devicenet::explicit::{Path, class};

use super::console::Console;
use super::dialogue::{Answer, Dialogue};
use super::values;
use crate::{Identity, Seat, Trouble};

/// Class 2Fh, attribute 89: profile and software version.
const VERSION: u8 = 89;

/// What the Identity object says.
#[derive(Clone, Debug, Default)]
pub(super) struct Known {
    pub(super) identity: Identity,
    /// Attribute 5.
    pub(super) status: Option<u16>,
}

/// The products of the catalogue that a device may be: those of its product code and name, or, from
/// the vendor of ours, of its product code alone. A product code says nothing without its vendor.
fn models(identity: &Identity) -> Vec<&'static Product> {
    let of_code = || DEVICENET.iter().filter(|it| it.product_code() == identity.product_code);
    let name = identity.product_name.as_deref().map(str::trim).unwrap_or_default();
    let of_name: Vec<_> = of_code().filter(|product| product.product_name == name).collect();
    if !of_name.is_empty() {
        return of_name;
    }
    let is_ours = identity.vendor == Some(Factory::with_serial(0).vendor);
    if is_ours { of_code().collect() } else { Vec::new() }
}

/// Asks a device that was allocated who it is. What it refuses to say stays unknown.
pub(super) fn identify<S: Seat<Station = Console>>(
    dialogue: &mut Dialogue<S>,
    tried: &str,
    mac: MacId,
) -> Result<Known, Trouble> {
    let mut read = |class, attribute| -> Result<Option<Vec<u8>>, Trouble> {
        match dialogue.get(tried, mac, Path { class, instance: 1, attribute })? {
            Answer::Done(octets) => Ok(Some(octets)),
            Answer::Refused(_) | Answer::TooLong => Ok(None),
        }
    };
    let word = |octets: Option<Vec<u8>>| match *octets?.as_slice() {
        [low, high] => Some(u16::from_le_bytes([low, high])),
        _ => None,
    };
    let vendor = word(read(class::IDENTITY, 1)?);
    let device_type = word(read(class::IDENTITY, 2)?);
    let product_code = word(read(class::IDENTITY, 3)?).unwrap_or_default();
    let revision = match read(class::IDENTITY, 4)?.as_deref() {
        Some(&[major, minor]) => Some((major, minor)),
        _ => None,
    };
    let status = word(read(class::IDENTITY, 5)?);
    let serial = match read(class::IDENTITY, 6)?.as_deref() {
        Some(&[a, b, c, d]) => Some(u32::from_le_bytes([a, b, c, d])),
        _ => None,
    };
    let product_name = read(class::IDENTITY, 7)?.map(|octets| values::short_string(&octets));
    let mut identity = Identity {
        vendor,
        device_type,
        product_code,
        revision,
        serial,
        product_name,
        ..Identity::default()
    };
    identity.models = models(&identity);
    if !identity.models.is_empty() {
        let version = read(ENCODER_POSITION, VERSION)?;
        identity.firmware = version.and_then(|octets| values::firmware(&octets));
    }
    Ok(Known { identity, status })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(vendor: u16, product_code: u16, name: &str) -> Vec<&'static str> {
        let identity = Identity {
            vendor: Some(vendor),
            product_code,
            product_name: Some(name.to_owned()),
            ..Identity::default()
        };
        models(&identity).iter().map(|product| product.model).collect()
    }

    #[test]
    fn a_product_code_alone_makes_no_device_ours() {
        assert_eq!(device(0x1234, 0x0A, "Toy"), [""; 0]);
        assert_eq!(device(468, 0x0C, "AMG 11 - Multiturn"), [""; 0]);
    }

    #[test]
    fn a_name_tells_the_model_and_a_vendor_the_family() {
        assert_eq!(device(0x1234, 0x0A, "AMG 11 - Multiturn"), ["amg11-d29"]);
        assert_eq!(device(468, 0x0B, "Baumer").len(), 5);
    }
}
