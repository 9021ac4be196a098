//! `codewheel passport`: the passports of encoders from a recording.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::ExitCode;

use codewheel_capture::{ReadError, Reader};
use codewheel_commission::passport::{Passport, from_capture};

use super::passports::PROGRAM;
use crate::arguments::commission::PassportArguments;
use crate::failure::Failure;
use crate::files;

/// Something in the recording is damaged. What is whole has been used all the same.
const DAMAGED: u8 = 1;
/// Damages told one by one.
const COMPLAINTS: u64 = 10;

pub(crate) fn run(arguments: &PassportArguments) -> Result<ExitCode, Failure> {
    let path = &arguments.capture;
    let mut reader = Reader::open(path).map_err(|reason| match reason {
        ReadError::Format(reason) => Failure::Usage(reason.to_string()),
        reason => Failure::Replay { path: path.clone(), reason },
    })?;
    let mut damages = 0_u64;
    let passports = from_capture(&mut reader, PROGRAM, &mut |error| {
        damages += 1;
        if damages <= COMPLAINTS {
            eprintln!("codewheel: {}: {error}", path.display());
        }
    })?;
    let files = named(&passports);
    match (&arguments.output.folder, files.as_slice()) {
        (Some(folder), files) => files::keep(folder, files, arguments.output.force)?,
        (None, [(_, text)]) => std::io::stdout().lock().write_all(text.as_bytes())?,
        (None, files) => {
            let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
            return Err(Failure::Usage(format!(
                "{} shows {} encoders: add -o DIR to write {} into a folder",
                path.display(),
                files.len(),
                names.join(", ")
            )));
        }
    }
    Ok(if damages == 0 { ExitCode::SUCCESS } else { ExitCode::from(DAMAGED) })
}

/// Each with the name of its file, such as `devicenet-5.toml`; an address on a second bus of the
/// recording gets a number.
fn named(passports: &[Passport]) -> Vec<(String, String)> {
    let mut seen: BTreeMap<String, u32> = BTreeMap::new();
    let files = passports.iter().map(|passport| {
        let stem = format!("{}-{}", passport.bus, passport.address).to_lowercase();
        let count = seen.entry(stem.clone()).or_default();
        *count += 1;
        let number = if *count == 1 { String::new() } else { format!("-{count}") };
        (format!("{stem}{number}.toml"), passport.to_toml())
    });
    files.collect()
}
