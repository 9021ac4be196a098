//! `codewheel diff`: an encoder and its passport, or two passports.

use std::io::Write;
use std::process::ExitCode;

use codewheel_commission::passport::{self, Difference, Passport, compare};

use super::{passports, with};
use crate::arguments::Chatter;
use crate::arguments::commission::DiffArguments;
use crate::failure::Failure;

/// Something differs.
const DIFFERENT: u8 = 1;

pub(super) fn run(arguments: &DiffArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let was = passports::read(&arguments.file)?;
    let is = match &arguments.other {
        Some(other) => passports::read(other)?,
        None => live(arguments, chatter)?,
    };
    tell(&compare(&was, &is), arguments, chatter)
}

fn live(arguments: &DiffArguments, chatter: Chatter) -> Result<Passport, Failure> {
    with(&arguments.encoder, chatter, |encoder| {
        let circumstances = passports::circumstances(encoder.bit_rate);
        Ok(passport::take(encoder.session.as_mut(), &circumstances)?)
    })
}

fn tell(
    differences: &[Difference],
    arguments: &DiffArguments,
    chatter: Chatter,
) -> Result<ExitCode, Failure> {
    let mut out = std::io::stdout().lock();
    for difference in differences {
        if arguments.format.json {
            let line = serde_json::to_string(difference).map_err(std::io::Error::from)?;
            writeln!(out, "{line}")?;
        } else {
            writeln!(out, "{difference}")?;
        }
    }
    if differences.iter().any(Difference::counts) {
        return Ok(ExitCode::from(DIFFERENT));
    }
    if chatter > Chatter::Quiet {
        let said = if differences.is_empty() {
            "nothing differs"
        } else {
            "that makes no other positions; nothing else differs"
        };
        eprintln!("codewheel: {said}");
    }
    Ok(ExitCode::SUCCESS)
}
