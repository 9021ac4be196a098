//! The demo: three encoders on turning shafts and a scanner, at 500 kbit/s.

use codewheel_device::Product;
use codewheel_devicenet::MacId;
use codewheel_sim::shaft::Shaft;
use codewheel_station::Duration;
use codewheel_station::can::BitRate;

use crate::{EncoderSettings, SegmentSettings};

/// Model, address and shaft of each encoder.
const ENCODERS: [(&str, u16, &str); 3] = [
    ("amg11-d29", 5, "turn rpm=60 angle=100turns"),
    ("hmg10-d13", 7, "sine amplitude=160deg period=8s"),
    ("amg81-d29", 12, "turn rpm=-750 angle=60000turns"),
];

/// The settings of the demo segment.
#[must_use]
pub fn demo() -> SegmentSettings {
    let encoders = ENCODERS
        .iter()
        .zip(1..)
        .filter_map(|((model, mac, shaft), serial)| {
            let product = Product::find(model)?;
            let geometry = product.encoder.geometry;
            let steps = geometry.singleturn_resolution();
            let shaft = Shaft::parse(shaft, steps, geometry.revolutions()).ok()?;
            Some(EncoderSettings { product, mac: MacId::from_low_bits(*mac), shaft, serial })
        })
        .collect();
    SegmentSettings {
        name: "demo".into(),
        bit_rate: BitRate::Kbit500,
        scanner: MacId::from_low_bits(0),
        interval: Duration::from_millis(10),
        encoders,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoder_of_the_demo_is_there() {
        assert_eq!(demo().encoders.len(), ENCODERS.len());
    }
}
