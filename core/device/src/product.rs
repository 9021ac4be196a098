//! The catalogue: which products there are and what sets them apart (DeviceNet manual §1.2,
//! PROFIBUS manual §1.2).

use core::fmt;

use codewheel_encoder::{Geometry, Model};

/// A family of encoders: how they are mounted and named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// AMG 11, solid shaft.
    Amg11,
    /// AMG 81, solid shaft; the multiturn products have a lithium cell.
    Amg81,
    /// PMG 10, solid shaft.
    Pmg10,
    /// HMG 11, hollow shaft.
    Hmg11,
    /// HMG 10, hollow shaft.
    Hmg10,
    /// HEAG 162, a converter: an encoder with SSI takes the place of the shaft.
    Heag162,
}

/// The shaft of a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Shaft {
    /// It fits into the machine.
    Solid,
    /// The shaft of the machine fits into it.
    Hollow,
    /// There is none: the product reads an encoder by SSI.
    None,
}

/// A field bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Bus {
    /// DeviceNet.
    DeviceNet,
    /// PROFIBUS-DP.
    Profibus,
}

impl fmt::Display for Bus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::DeviceNet => "DeviceNet",
            Self::Profibus => "PROFIBUS",
        })
    }
}

impl fmt::Display for Shaft {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Solid => "solid",
            Self::Hollow => "hollow",
            Self::None => "none (SSI)",
        })
    }
}

impl Family {
    /// What shaft it has.
    #[must_use]
    pub const fn shaft(self) -> Shaft {
        match self {
            Self::Amg11 | Self::Amg81 | Self::Pmg10 => Shaft::Solid,
            Self::Hmg11 | Self::Hmg10 => Shaft::Hollow,
            Self::Heag162 => Shaft::None,
        }
    }
}

/// One product of the catalogue.
#[derive(Debug, PartialEq, Eq)]
pub struct Product {
    /// The name on the command line: no blanks, lower case, `amg11-d29`.
    pub model: &'static str,
    /// The name in the manual, `AMG 11 D29`.
    pub title: &'static str,
    /// The manual's product family: `AMG 11 - Multiturn`; on DeviceNet identity attribute 7.
    pub product_name: &'static str,
    /// The name of its EDS or GSD file, as the manual prints it.
    pub data_sheet: &'static str,
    /// The family.
    pub family: Family,
    /// The bus it speaks.
    pub bus: Bus,
    /// What the encoder itself needs to know.
    pub encoder: Model,
    /// Names the product in a kept record; never reused for another.
    pub fingerprint: u16,
}

/// The product code of singleturn products (AMG manual §1.2).
const PRODUCT_CODE_SINGLETURN: u16 = 0x0B;
/// The product code of multiturn products (AMG manual §1.2).
const PRODUCT_CODE_MULTITURN: u16 = 0x0A;

impl Product {
    /// The product with this name; upper and lower case are the same.
    #[must_use]
    pub fn find(model: &str) -> Option<&'static Self> {
        Self::all().find(|product| product.model.eq_ignore_ascii_case(model))
    }

    /// The whole catalogue: [`DEVICENET`], then [`PROFIBUS`].
    pub fn all() -> impl Iterator<Item = &'static Self> {
        DEVICENET.iter().chain(&PROFIBUS)
    }

    /// DeviceNet identity attribute 3: 0Ah multiturn, 0Bh singleturn.
    #[must_use]
    pub const fn product_code(&self) -> u16 {
        if self.encoder.geometry.is_multiturn() {
            PRODUCT_CODE_MULTITURN
        } else {
            PRODUCT_CODE_SINGLETURN
        }
    }

    /// Class 2Fh attribute 95: 1 singleturn, 2 multiturn.
    #[must_use]
    pub const fn encoder_type(&self) -> u16 {
        if self.encoder.geometry.is_multiturn() { 2 } else { 1 }
    }

    /// Class 2Fh attribute 82: 65535 for multiturn, since 65536 does not fit a UINT; 0 for
    /// singleturn (decision, after the PROFIBUS manual's FFFFh).
    #[must_use]
    pub const fn number_of_revolutions(&self) -> u16 {
        if self.encoder.geometry.is_multiturn() { 0xFFFF } else { 0 }
    }
}

impl fmt::Display for Product {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.title)
    }
}

const fn singleturn() -> Model {
    // On DeviceNet the measuring range of a singleturn encoder is its resolution (manual §4, note).
    Model { geometry: Geometry::SINGLETURN_13, lithium_cell: false, total_follows_steps: true }
}

const fn multiturn(lithium_cell: bool) -> Model {
    Model { geometry: Geometry::MULTITURN_29, lithium_cell, total_follows_steps: false }
}

/// On PROFIBUS a singleturn encoder has a measuring range of its own (PROFIBUS manual §4).
const fn profibus(geometry: Geometry, lithium_cell: bool) -> Model {
    Model { geometry, lithium_cell, total_follows_steps: false }
}

/// The ten DeviceNet products, in the manual's order.
pub static DEVICENET: [Product; 10] = [
    Product {
        model: "amg11-d13",
        title: "AMG 11 D13",
        product_name: "AMG 11 - Singleturn",
        data_sheet: "AMG11D13.eds",
        family: Family::Amg11,
        bus: Bus::DeviceNet,
        encoder: singleturn(),
        fingerprint: 1,
    },
    Product {
        model: "amg11-d29",
        title: "AMG 11 D29",
        product_name: "AMG 11 - Multiturn",
        data_sheet: "AMG11D29.eds",
        family: Family::Amg11,
        bus: Bus::DeviceNet,
        encoder: multiturn(false),
        fingerprint: 2,
    },
    Product {
        model: "amg81-d13",
        title: "AMG 81 D13",
        product_name: "AMG 81 - Singleturn",
        data_sheet: "AMG81D13.eds",
        family: Family::Amg81,
        bus: Bus::DeviceNet,
        encoder: singleturn(),
        fingerprint: 3,
    },
    Product {
        model: "amg81-d29",
        title: "AMG 81 D29",
        product_name: "AMG 81 - Multiturn",
        data_sheet: "AMG81D29.eds",
        family: Family::Amg81,
        bus: Bus::DeviceNet,
        // By analogy with the AMG 81 P 29 of the PROFIBUS manual (decision).
        encoder: multiturn(true),
        fingerprint: 4,
    },
    Product {
        model: "pmg10-d13",
        title: "PMG10…DN.3000",
        product_name: "PMG 10 - Singleturn",
        data_sheet: "PMG10D13.eds",
        family: Family::Pmg10,
        bus: Bus::DeviceNet,
        encoder: singleturn(),
        fingerprint: 5,
    },
    Product {
        model: "pmg10-d29",
        title: "PMG10…DN.3600",
        product_name: "PMG 10 - Multiturn",
        data_sheet: "PMG10D29.eds",
        family: Family::Pmg10,
        bus: Bus::DeviceNet,
        encoder: multiturn(false),
        fingerprint: 6,
    },
    Product {
        model: "hmg11-d13",
        title: "HMG 11 D13",
        product_name: "HMG 11 - Singleturn",
        data_sheet: "HMG11D13.eds",
        family: Family::Hmg11,
        bus: Bus::DeviceNet,
        encoder: singleturn(),
        fingerprint: 7,
    },
    Product {
        model: "hmg11-d29",
        title: "HMG 11 D29",
        product_name: "HMG 11 - Multiturn",
        data_sheet: "HMG11D29.eds",
        family: Family::Hmg11,
        bus: Bus::DeviceNet,
        encoder: multiturn(false),
        fingerprint: 8,
    },
    Product {
        model: "hmg10-d13",
        title: "HMG10…DN.3000",
        product_name: "HMG 10 - Singleturn",
        data_sheet: "HMG10D13.eds",
        family: Family::Hmg10,
        bus: Bus::DeviceNet,
        encoder: singleturn(),
        fingerprint: 9,
    },
    Product {
        model: "hmg10-d29",
        title: "HMG10…DN.3600",
        product_name: "HMG 10 - Multiturn",
        data_sheet: "HMG10D29.eds",
        family: Family::Hmg10,
        bus: Bus::DeviceNet,
        encoder: multiturn(false),
        fingerprint: 10,
    },
];

/// The ten PROFIBUS encoders and the three HEAG 162 converters, in the manual's order.
pub static PROFIBUS: [Product; 13] = [
    Product {
        model: "amg11-p13",
        title: "AMG 11 P 13",
        product_name: "AMG 11 - Singleturn 13 bit",
        data_sheet: "PB13DPV0.GSD",
        family: Family::Amg11,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_13, false),
        fingerprint: 11,
    },
    Product {
        model: "amg11-p29",
        title: "AMG 11 P 29",
        product_name: "AMG 11 - Multiturn 29 bit",
        data_sheet: "PB29DPV0.GSD",
        family: Family::Amg11,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::MULTITURN_29, false),
        fingerprint: 12,
    },
    Product {
        model: "amg81-p13",
        title: "AMG 81 P 13",
        product_name: "AMG 81 - Singleturn 13 bit",
        data_sheet: "PB13DPV0.GSD",
        family: Family::Amg81,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_13, false),
        fingerprint: 13,
    },
    Product {
        model: "amg81-p29",
        title: "AMG 81 P 29",
        product_name: "AMG 81 - Multiturn 29 bit",
        data_sheet: "PB29DPV0.GSD",
        family: Family::Amg81,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::MULTITURN_29, true),
        fingerprint: 14,
    },
    Product {
        model: "pmg10-p13",
        title: "PMG10…P0.3000",
        product_name: "PMG 10 - Singleturn 13 bit",
        data_sheet: "PB13DPV0.GSD",
        family: Family::Pmg10,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_13, false),
        fingerprint: 15,
    },
    Product {
        model: "pmg10-p29",
        title: "PMG10…P0.3600",
        product_name: "PMG 10 - Multiturn 29 bit",
        data_sheet: "PB29DPV0.GSD",
        family: Family::Pmg10,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::MULTITURN_29, false),
        fingerprint: 16,
    },
    Product {
        model: "hmg11-p13",
        title: "HMG 11 P 13",
        product_name: "HMG 11 - Singleturn 13 bit",
        data_sheet: "PB13DPV0.GSD",
        family: Family::Hmg11,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_13, false),
        fingerprint: 17,
    },
    Product {
        model: "hmg11-p29",
        title: "HMG 11 P 29",
        product_name: "HMG 11 - Multiturn 29 bit",
        data_sheet: "PB29DPV0.GSD",
        family: Family::Hmg11,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::MULTITURN_29, false),
        fingerprint: 18,
    },
    Product {
        model: "hmg10-p13",
        title: "HMG10….3000",
        product_name: "HMG 10 - Singleturn 13 bit",
        data_sheet: "PB13DPV0.GSD",
        family: Family::Hmg10,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_13, false),
        fingerprint: 19,
    },
    Product {
        model: "hmg10-p29",
        title: "HMG10….3600",
        product_name: "HMG 10 - Multiturn 29 bit",
        data_sheet: "PB29DPV0.GSD",
        family: Family::Hmg10,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::MULTITURN_29, false),
        fingerprint: 20,
    },
    Product {
        model: "heag162-p13",
        title: "HEAG 162 SP 13",
        product_name: "HEAG 162 converter 13 bit",
        data_sheet: "PB13DPV0.GSD",
        family: Family::Heag162,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_13, false),
        fingerprint: 21,
    },
    Product {
        model: "heag162-p18",
        title: "HEAG 162 SP 18",
        product_name: "HEAG 162 converter 18 bit",
        data_sheet: "PB18DPV0.GSD",
        family: Family::Heag162,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::SINGLETURN_18, false),
        fingerprint: 22,
    },
    Product {
        model: "heag162-p29",
        title: "HEAG 162 SP 29",
        product_name: "HEAG 162 converter 29 bit",
        data_sheet: "PB29DPV0.GSD",
        family: Family::Heag162,
        bus: Bus::Profibus,
        encoder: profibus(Geometry::MULTITURN_29, false),
        fingerprint: 23,
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_product_has_a_name_and_a_fingerprint_of_its_own() {
        for (place, product) in Product::all().enumerate() {
            for other in Product::all().skip(place + 1) {
                assert_ne!(product.model, other.model);
                assert_ne!(product.title, other.title);
                assert_ne!(product.fingerprint, other.fingerprint);
                // A GSD file is for a geometry, an EDS file for a product.
                if product.bus == Bus::DeviceNet {
                    assert_ne!(product.data_sheet, other.data_sheet);
                }
            }
            assert!(product.product_name.len() <= 32, "a SHORT_STRING of the Identity object");
        }
        assert_eq!(Product::all().count(), 23);
    }

    /// DeviceNet manual §1.2, both tables.
    #[test]
    fn names_and_files_are_those_the_manual_prints() {
        let printed = [
            ("AMG 11 D13", "AMG11D13.eds", "AMG 11 - Singleturn"),
            ("AMG 11 D29", "AMG11D29.eds", "AMG 11 - Multiturn"),
            ("AMG 81 D13", "AMG81D13.eds", "AMG 81 - Singleturn"),
            ("AMG 81 D29", "AMG81D29.eds", "AMG 81 - Multiturn"),
            ("PMG10…DN.3000", "PMG10D13.eds", "PMG 10 - Singleturn"),
            ("PMG10…DN.3600", "PMG10D29.eds", "PMG 10 - Multiturn"),
            ("HMG 11 D13", "HMG11D13.eds", "HMG 11 - Singleturn"),
            ("HMG 11 D29", "HMG11D29.eds", "HMG 11 - Multiturn"),
            ("HMG10…DN.3000", "HMG10D13.eds", "HMG 10 - Singleturn"),
            ("HMG10…DN.3600", "HMG10D29.eds", "HMG 10 - Multiturn"),
        ];
        for (product, (title, data_sheet, product_name)) in DEVICENET.iter().zip(printed) {
            assert_eq!(product.title, title);
            assert_eq!(product.data_sheet, data_sheet);
            assert_eq!(product.product_name, product_name);
        }
    }

    #[test]
    fn names_are_found_in_any_case_and_only_whole() {
        assert_eq!(Product::find("AMG11-D29").map(|product| product.title), Some("AMG 11 D29"));
        assert_eq!(Product::find("amg11"), None);
        assert_eq!(
            Product::find("HEAG162-P18").map(|product| product.title),
            Some("HEAG 162 SP 18")
        );
        assert_eq!(Product::find("heag162-d18"), None);
    }

    #[test]
    fn codes_and_types_are_those_of_the_manual() {
        for product in &DEVICENET {
            let multiturn = product.model.ends_with("d29");
            let (code, kind) = if multiturn { (0x0A, 2) } else { (0x0B, 1) };
            assert_eq!((product.product_code(), product.encoder_type()), (code, kind));
            assert_eq!(product.encoder.lithium_cell, product.model == "amg81-d29");
        }
    }

    /// PROFIBUS manual §1.2, all three tables, and §7.2 for the cell.
    #[test]
    fn the_profibus_products_have_the_files_of_the_manual_and_one_of_them_a_cell() {
        let printed = [
            ("AMG 11 P 13", "PB13DPV0.GSD"),
            ("AMG 11 P 29", "PB29DPV0.GSD"),
            ("AMG 81 P 13", "PB13DPV0.GSD"),
            ("AMG 81 P 29", "PB29DPV0.GSD"),
            ("PMG10…P0.3000", "PB13DPV0.GSD"),
            ("PMG10…P0.3600", "PB29DPV0.GSD"),
            ("HMG 11 P 13", "PB13DPV0.GSD"),
            ("HMG 11 P 29", "PB29DPV0.GSD"),
            ("HMG10….3000", "PB13DPV0.GSD"),
            ("HMG10….3600", "PB29DPV0.GSD"),
            ("HEAG 162 SP 13", "PB13DPV0.GSD"),
            ("HEAG 162 SP 18", "PB18DPV0.GSD"),
            ("HEAG 162 SP 29", "PB29DPV0.GSD"),
        ];
        for (product, (title, data_sheet)) in PROFIBUS.iter().zip(printed) {
            assert_eq!((product.title, product.data_sheet), (title, data_sheet));
            assert_eq!(product.bus, Bus::Profibus);
            assert_eq!(product.encoder.lithium_cell, product.model == "amg81-p29");
            let bits = product.encoder.geometry.range().trailing_zeros().to_string();
            assert!(product.model.ends_with(&bits) && data_sheet.contains(&bits));
        }
    }
}
