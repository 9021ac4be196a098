//! `codewheel`: an absolute rotary encoder made of software.

mod arguments;
mod commission;
mod completions;
mod describe;
mod doctor;
mod document;
mod encoder;
mod failure;
mod files;
mod hilo;
mod man;
mod models;
mod page;
mod rates;
mod record;
mod replay;
mod run;
mod sheets;
mod show;
mod signals;
mod tell;

use std::process::ExitCode;

use clap::Parser;
use codewheel_device::product::Bus;

use crate::arguments::{Arguments, Verb};
use crate::failure::Failure;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let chatter = arguments.chatter();
    if let (Some(_), Some(option)) = (&arguments.verb, arguments.page.given()) {
        return end(Err(Failure::Usage(format!(
            "{option} without a verb is for the demo: write it behind `run`"
        ))));
    }
    let result = match arguments.verb {
        Some(Verb::Doctor(doctor)) => return end(doctor::run(&doctor)),
        Some(Verb::Replay(replay)) => return end(replay::run(&replay, chatter)),
        Some(Verb::Scan(scan)) => return end(commission::scan(&scan, chatter)),
        Some(Verb::Identify(identify)) => return end(commission::identify(&identify, chatter)),
        Some(Verb::Get(get)) => return end(commission::get(&get, chatter)),
        Some(Verb::Set(set)) => return end(commission::set(&set, chatter)),
        Some(Verb::Preset(preset)) => return end(commission::preset(&preset, chatter)),
        Some(Verb::Save(service)) => return end(commission::save(&service, chatter)),
        Some(Verb::Restore(service)) => return end(commission::restore(&service, chatter)),
        Some(Verb::Reset(service)) => return end(commission::reset(&service, chatter)),
        Some(Verb::Watch(watch)) => return end(commission::watch(&watch, chatter)),
        Some(Verb::Backup(backup)) => return end(commission::backup(&backup, chatter)),
        Some(Verb::Diff(diff)) => return end(commission::diff(&diff, chatter)),
        Some(Verb::Apply(apply)) => return end(commission::apply(&apply, chatter)),
        Some(Verb::Passport(passport)) => return end(commission::passport(&passport)),
        None => run::demo(&arguments.page, chatter),
        Some(Verb::Run(arguments)) => run::run(&arguments, chatter),
        Some(Verb::Schema) => run::schema(),
        Some(Verb::Encoder(encoder)) => encoder::run(&encoder, chatter),
        Some(Verb::Models(models)) => models::run(&models),
        Some(Verb::Describe(describe)) => describe::run(&describe),
        Some(Verb::Eds(sheet)) => sheets::run(&sheet, Bus::DeviceNet),
        Some(Verb::Gsd(sheet)) => sheets::run(&sheet, Bus::Profibus),
        Some(Verb::Hilo(numbers)) => hilo::run(&numbers),
        Some(Verb::Completions(completions)) => completions::run(&completions),
        Some(Verb::Man(man)) => man::run(&man),
    };
    end(result.map(|()| ExitCode::SUCCESS))
}

/// How the program ends, and what it says about a failure.
fn end(result: Result<ExitCode, Failure>) -> ExitCode {
    match result {
        Ok(code) => code,
        Err(failure) if failure.is_closed_pipe() => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("codewheel: {failure}");
            failure.exit_code()
        }
    }
}
