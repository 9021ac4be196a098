//! `codewheel backup`: the passport of an encoder, on file.

use std::io::Write;

use codewheel_commission::passport;
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
use super::passports;
use crate::arguments::commission::BackupArguments;
use crate::failure::Failure;
use crate::files;

#[derive(Serialize)]
struct Line<'a> {
    file: &'a str,
    address: u8,
    serial: Option<u32>,
    position: Option<u32>,
    at_rest: Option<bool>,
    settings: usize,
}

/// Refuses to replace a file that is there, unless a person says so. Asked before the bus is opened.
pub(super) fn may_write(arguments: &BackupArguments) -> Result<(), Failure> {
    let BackupArguments { file, consent, .. } = arguments;
    if consent.yes || !file.exists() {
        return Ok(());
    }
    let name = file.display();
    if consent.can_be_had().is_err() {
        return Err(Failure::Usage(format!(
            "{name} is there already, and there is no terminal to ask on; nothing was done: add --yes \
             to replace it, or name another file"
        )));
    }
    consent.ask_alone(&format!("{name} is there already. Replace it?"))
}

pub(super) fn run(encoder: &mut Encoder, arguments: &BackupArguments) -> Result<(), Failure> {
    let circumstances = passports::circumstances(encoder.bit_rate);
    let passport = passport::take(encoder.session.as_mut(), &circumstances)?;
    let path = &arguments.file;
    files::replace(path, passport.to_toml().as_bytes())
        .map_err(|reason| Failure::File { path: path.clone(), reason })?;
    let name = path.display().to_string();
    let position = passport.position;
    let mut out = std::io::stdout().lock();
    if arguments.format.json {
        let line = Line {
            file: &name,
            address: passport.address,
            serial: passport.nameplate.serial,
            position: position.steps,
            at_rest: position.at_rest,
            settings: passport.settings.len(),
        };
        writeln!(out, "{}", serde_json::to_string(&line).map_err(std::io::Error::from)?)?;
    } else {
        writeln!(out, "{name}")?;
    }
    if position.at_rest == Some(false) {
        encoder.say(
            "the shaft turned, so this passport cannot tell another encoder where the machine \
             stood: stop it, and do it again",
        );
    }
    encoder.say(&format!("compare: {}", command(&["diff", &name], encoder.at)));
    Ok(())
}
