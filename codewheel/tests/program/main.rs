//! The program as its users meet it at the prompt.

#[cfg(unix)]
mod commission;
mod data_sheets;
mod demo;
mod descriptions;
mod doctor;
mod encoder;
mod page;
#[cfg(unix)]
mod profibus;
mod prompt;
#[cfg(unix)]
mod record;
mod refusals;
mod replay;
mod run;
mod shell;
#[cfg(unix)]
mod terminal;
