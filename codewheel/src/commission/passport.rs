//! `codewheel passport`: the passports of encoders from a recording.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use codewheel_capture::{ReadError, Reader};
use codewheel_commission::passport::{Passport, from_capture};
use serde::Serialize;

use super::passports::PROGRAM;
use crate::arguments::OutputArguments;
use crate::arguments::commission::PassportArguments;
use crate::failure::Failure;
use crate::files;

#[derive(Serialize)]
struct Line {
    file: Option<PathBuf>,
    passport: serde_json::Value,
}

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
    let end = if damages == 0 { ExitCode::SUCCESS } else { ExitCode::from(DAMAGED) };
    if arguments.format.json {
        tell(&files, arguments)?;
        return Ok(end);
    }
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
    Ok(end)
}

/// One object a line for each encoder: its passport, and the file where one was written.
fn tell(files: &[(String, String)], arguments: &PassportArguments) -> Result<(), Failure> {
    let OutputArguments { folder, force } = &arguments.output;
    let paths = match folder {
        Some(folder) => files::put(folder, files, *force)?,
        None => Vec::new(),
    };
    let mut paths = paths.into_iter();
    let mut out = std::io::stdout().lock();
    for (_, text) in files {
        // It is read back as any other program reads it.
        let passport = toml::from_str(text).map_err(std::io::Error::other)?;
        let line = Line { file: paths.next(), passport };
        writeln!(out, "{}", serde_json::to_string(&line).map_err(std::io::Error::from)?)?;
    }
    Ok(())
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
