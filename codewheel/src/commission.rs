//! The master's side: what people do with encoders on a bus.

mod apply;
mod backup;
mod bus;
mod command_line;
mod consent;
mod diff;
mod encoder;
mod get;
mod identify;
mod passport;
mod passports;
mod preset;
mod progress;
mod ring;
mod scan;
mod service;
mod set;
mod settings;
mod stoppable;
mod value;
mod watch;

use std::process::ExitCode;

use codewheel_device::product::Bus;
use serde::Serialize;

use self::encoder::Encoder;
use self::service::Service;
use crate::arguments::Chatter;
use crate::arguments::commission::{
    ApplyArguments, BackupArguments, Consent, DiffArguments, EncoderAddress, GetArguments,
    IdentifyArguments, PassportArguments, PresetArguments, ScanArguments, ServiceArguments,
    SetArguments, WatchArguments,
};
use crate::failure::Failure;

pub(crate) fn scan(arguments: &ScanArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let scanned = bus::scan(&arguments.bus, chatter)
        .and_then(|survey| scan::tell(&survey, arguments, chatter));
    end(scanned, arguments.format.json)
}

pub(crate) fn identify(
    arguments: &IdentifyArguments,
    chatter: Chatter,
) -> Result<ExitCode, Failure> {
    let format = arguments.format;
    let identified = with(&arguments.encoder, chatter, |encoder| identify::run(encoder, format));
    end(identified, format.json)
}

pub(crate) fn get(arguments: &GetArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let got = value::names(&arguments.names).and_then(|names| {
        with(&arguments.encoder, chatter, |encoder| get::run(encoder, &names, arguments.format))
    });
    end(got, arguments.format.json)
}

pub(crate) fn set(arguments: &SetArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let set = value::name(&arguments.name).and_then(|name| {
        writing(&arguments.encoder, arguments.consent, chatter, |encoder| {
            set::run(encoder, &name, arguments)
        })
    });
    end(set, arguments.format.json)
}

pub(crate) fn preset(arguments: &PresetArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let preset = writing(&arguments.encoder, arguments.consent, chatter, |encoder| {
        preset::run(encoder, arguments)
    });
    end(preset, arguments.format.json)
}

pub(crate) fn save(arguments: &ServiceArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    serve(arguments, Service::Save, chatter)
}

pub(crate) fn restore(arguments: &ServiceArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    serve(arguments, Service::Restore, chatter)
}

pub(crate) fn reset(arguments: &ServiceArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    serve(arguments, Service::Reset, chatter)
}

pub(crate) fn watch(arguments: &WatchArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    end(watch::run(arguments, chatter), arguments.format.json)
}

pub(crate) fn backup(arguments: &BackupArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let backed_up = backup::may_write(arguments).and_then(|()| {
        with(&arguments.encoder, chatter, |encoder| backup::run(encoder, arguments))
    });
    end(backed_up, arguments.format.json)
}

pub(crate) fn diff(arguments: &DiffArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    end_with(diff::run(arguments, chatter), arguments.format.json)
}

pub(crate) fn apply(arguments: &ApplyArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let applied = passports::read(&arguments.file).and_then(|goal| {
        writing(&arguments.encoder, arguments.consent, chatter, |encoder| {
            apply::run(encoder, &goal, arguments)
        })
    });
    end(applied, arguments.format.json)
}

pub(crate) fn passport(arguments: &PassportArguments) -> Result<ExitCode, Failure> {
    end_with(passport::run(arguments), arguments.format.json)
}

fn serve(
    arguments: &ServiceArguments,
    service: Service,
    chatter: Chatter,
) -> Result<ExitCode, Failure> {
    // PROFIBUS has no such service: it is refused, and nobody need consent to that.
    let is_refused = bus::of(&arguments.encoder.bus) == Some(Bus::Profibus);
    let consent = Consent { yes: arguments.consent.yes || is_refused };
    let served = writing(&arguments.encoder, consent, chatter, |encoder| {
        service::run(encoder, arguments, service)
    });
    end(served, arguments.format.json)
}

/// Opens the bus, does `verb` with the encoder, and releases it whatever came of it.
fn with<T>(
    at: &EncoderAddress,
    chatter: Chatter,
    verb: impl FnOnce(&mut Encoder) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let mut encoder = bus::open(at, chatter)?;
    let result = verb(&mut encoder);
    encoder.end(result)
}

/// [`with`] for verbs that write, which begin only where consent can be had.
fn writing<T>(
    at: &EncoderAddress,
    consent: Consent,
    chatter: Chatter,
    verb: impl FnOnce(&mut Encoder) -> Result<T, Failure>,
) -> Result<T, Failure> {
    consent.can_be_had()?;
    with(at, chatter, verb)
}

#[derive(Serialize)]
struct ErrorLine<'a> {
    error: ErrorParts<'a>,
}

/// What a script needs of an error: the kind to decide by, the rest for its log.
#[derive(Serialize)]
struct ErrorParts<'a> {
    kind: &'static str,
    tried: Option<&'a str>,
    came: Option<&'a str>,
    remedy: Option<&'a str>,
    message: String,
}

fn end(result: Result<(), Failure>, json: bool) -> Result<ExitCode, Failure> {
    end_with(result.map(|()| ExitCode::SUCCESS), json)
}

/// How the verb ends: for programs its error is one more object, on stderr, since stdout is data.
fn end_with(result: Result<ExitCode, Failure>, json: bool) -> Result<ExitCode, Failure> {
    match result {
        Ok(code) => Ok(code),
        Err(failure) if json && !failure.is_closed_pipe() => {
            let trouble = match &failure {
                Failure::Trouble(trouble) => Some(trouble),
                _ => None,
            };
            let error = ErrorParts {
                kind: failure.kind(),
                tried: trouble.map(|trouble| trouble.tried.as_str()),
                came: trouble.map(|trouble| trouble.came.as_str()),
                remedy: trouble.map(|trouble| trouble.remedy.as_str()),
                message: failure.to_string(),
            };
            let line = serde_json::to_string(&ErrorLine { error }).map_err(std::io::Error::from)?;
            eprintln!("{line}");
            Ok(failure.exit_code())
        }
        Err(failure) => Err(failure),
    }
}
