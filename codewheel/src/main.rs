//! `codewheel`: an absolute rotary encoder made of software.

mod arguments;
mod describe;
mod encoder;
mod failure;
mod models;
mod run;
mod show;
mod signals;
mod tell;

use std::process::ExitCode;

use clap::Parser;

use crate::arguments::{Arguments, Verb};

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let chatter = arguments.chatter();
    let result = match arguments.verb {
        None => run::demo(chatter),
        Some(Verb::Run(arguments)) => run::run(&arguments, chatter),
        Some(Verb::Schema) => run::schema(),
        Some(Verb::Encoder(encoder)) => encoder::run(&encoder, chatter),
        Some(Verb::Models(models)) => models::run(&models),
        Some(Verb::Describe(describe)) => describe::run(&describe),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) if failure.is_closed_pipe() => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("codewheel: {failure}");
            failure.exit_code()
        }
    }
}
