//! `codewheel man`: manual pages, grown from the command line.

use std::io::Write;

use clap::{Command, CommandFactory};
use clap_mangen::Man;

use crate::arguments::{Arguments, ManArguments};
use crate::failure::Failure;
use crate::files;

pub(crate) fn run(arguments: &ManArguments) -> Result<(), Failure> {
    let mut command = Arguments::command();
    command.build();
    let output = &arguments.output;
    match &output.folder {
        None => std::io::stdout().lock().write_all(&page(&command)?)?,
        Some(folder) => files::keep(folder, &pages(&command)?, output.force)?,
    }
    Ok(())
}

/// The page of the program, then one for each verb, as `codewheel-get.1`.
fn pages(command: &Command) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let verbs = command.get_subcommands().filter(|verb| verb.get_name() != "help");
    let pages = verbs.map(|verb| Ok((format!("codewheel-{}.1", verb.get_name()), page(verb)?)));
    [Ok(("codewheel.1".to_owned(), page(command)?))].into_iter().chain(pages).collect()
}

fn page(command: &Command) -> std::io::Result<Vec<u8>> {
    let mut text = Vec::new();
    Man::new(command.clone()).render(&mut text)?;
    Ok(text)
}
