//! The catalogue: which products there are and what sets them apart (AMG manual §1.2).

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
}

impl Family {
    /// Whether the shaft is hollow.
    #[must_use]
    pub const fn has_hollow_shaft(self) -> bool {
        matches!(self, Self::Hmg11 | Self::Hmg10)
    }
}

/// One product of the catalogue.
#[derive(Debug, PartialEq, Eq)]
pub struct Product {
    /// The name on the command line: no blanks, lower case, `amg11-d29`.
    pub model: &'static str,
    /// The name in the manual, `AMG 11 D29`.
    pub title: &'static str,
    /// Identity attribute 7, the manual's product family: `AMG 11 - Multiturn`.
    pub product_name: &'static str,
    /// The name of its EDS file, as the manual prints it.
    pub eds_file: &'static str,
    /// The family.
    pub family: Family,
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
        DEVICENET.iter().find(|product| product.model.eq_ignore_ascii_case(model))
    }

    /// Identity attribute 3: 0Ah multiturn, 0Bh singleturn.
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

/// The ten DeviceNet products, in the manual's order.
pub static DEVICENET: [Product; 10] = [
    Product {
        model: "amg11-d13",
        title: "AMG 11 D13",
        product_name: "AMG 11 - Singleturn",
        eds_file: "AMG11D13.eds",
        family: Family::Amg11,
        encoder: singleturn(),
        fingerprint: 1,
    },
    Product {
        model: "amg11-d29",
        title: "AMG 11 D29",
        product_name: "AMG 11 - Multiturn",
        eds_file: "AMG11D29.eds",
        family: Family::Amg11,
        encoder: multiturn(false),
        fingerprint: 2,
    },
    Product {
        model: "amg81-d13",
        title: "AMG 81 D13",
        product_name: "AMG 81 - Singleturn",
        eds_file: "AMG81D13.eds",
        family: Family::Amg81,
        encoder: singleturn(),
        fingerprint: 3,
    },
    Product {
        model: "amg81-d29",
        title: "AMG 81 D29",
        product_name: "AMG 81 - Multiturn",
        eds_file: "AMG81D29.eds",
        family: Family::Amg81,
        // By analogy with the AMG 81 P 29 of the PROFIBUS manual (decision).
        encoder: multiturn(true),
        fingerprint: 4,
    },
    Product {
        model: "pmg10-d13",
        title: "PMG10…DN.3000",
        product_name: "PMG 10 - Singleturn",
        eds_file: "PMG10D13.eds",
        family: Family::Pmg10,
        encoder: singleturn(),
        fingerprint: 5,
    },
    Product {
        model: "pmg10-d29",
        title: "PMG10…DN.3600",
        product_name: "PMG 10 - Multiturn",
        eds_file: "PMG10D29.eds",
        family: Family::Pmg10,
        encoder: multiturn(false),
        fingerprint: 6,
    },
    Product {
        model: "hmg11-d13",
        title: "HMG 11 D13",
        product_name: "HMG 11 - Singleturn",
        eds_file: "HMG11D13.eds",
        family: Family::Hmg11,
        encoder: singleturn(),
        fingerprint: 7,
    },
    Product {
        model: "hmg11-d29",
        title: "HMG 11 D29",
        product_name: "HMG 11 - Multiturn",
        eds_file: "HMG11D29.eds",
        family: Family::Hmg11,
        encoder: multiturn(false),
        fingerprint: 8,
    },
    Product {
        model: "hmg10-d13",
        title: "HMG10…DN.3000",
        product_name: "HMG 10 - Singleturn",
        eds_file: "HMG10D13.eds",
        family: Family::Hmg10,
        encoder: singleturn(),
        fingerprint: 9,
    },
    Product {
        model: "hmg10-d29",
        title: "HMG10…DN.3600",
        product_name: "HMG 10 - Multiturn",
        eds_file: "HMG10D29.eds",
        family: Family::Hmg10,
        encoder: multiturn(false),
        fingerprint: 10,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_product_has_a_name_and_a_fingerprint_of_its_own() {
        for (place, product) in DEVICENET.iter().enumerate() {
            for other in &DEVICENET[place + 1..] {
                assert_ne!(product.model, other.model);
                assert_ne!(product.fingerprint, other.fingerprint);
                assert_ne!(product.eds_file, other.eds_file);
            }
            assert!(product.product_name.len() <= 32, "a SHORT_STRING of the Identity object");
        }
    }

    /// AMG manual §1.2, both tables.
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
        for (product, (title, eds_file, product_name)) in DEVICENET.iter().zip(printed) {
            assert_eq!(product.title, title);
            assert_eq!(product.eds_file, eds_file);
            assert_eq!(product.product_name, product_name);
        }
    }

    #[test]
    fn names_are_found_in_any_case_and_only_whole() {
        assert_eq!(Product::find("AMG11-D29").map(|product| product.title), Some("AMG 11 D29"));
        assert_eq!(Product::find("amg11"), None);
        assert_eq!(Product::find("amg11-p29"), None);
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
}
