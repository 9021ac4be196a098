//! The program as its users meet it at the prompt.

mod demo;
mod encoder;
#[cfg(unix)]
mod profibus;
mod prompt;
mod refusals;
mod run;
#[cfg(unix)]
mod terminal;
