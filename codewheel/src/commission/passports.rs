//! Passports on file.

use std::fs;
use std::path::Path;
use std::time::SystemTime;

use codewheel_commission::passport::{Circumstances, Passport};

use crate::failure::Failure;

/// The program that a passport says it was written by.
pub(super) const PROGRAM: &str = concat!("codewheel ", env!("CARGO_PKG_VERSION"));

/// Reads the passport in a file.
pub(super) fn read(path: &Path) -> Result<Passport, Failure> {
    let text = fs::read_to_string(path)
        .map_err(|reason| Failure::Read { path: path.to_owned(), reason })?;
    Passport::parse(&text).map_err(|reason| Failure::Passport { path: path.to_owned(), reason })
}

/// What is true now, on a bus at this rate.
pub(super) fn circumstances(bit_rate: u32) -> Circumstances {
    let mut circumstances = Circumstances::new(SystemTime::now(), PROGRAM);
    circumstances.bit_rate = Some(bit_rate);
    circumstances
}
