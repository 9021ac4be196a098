//! The program as its users meet it at the prompt.

mod demo;
mod encoder;
mod prompt;
mod refusals;
mod run;
#[cfg(unix)]
mod terminal;
