//! How a verb ends when it does not succeed.

use std::io;
use std::process::ExitCode;

use codewheel_link::LinkError;
use codewheel_plant::{MemoryError, PlayError};
use codewheel_sim::shaft::ShaftError;
use thiserror::Error;

/// Why a verb has not done what it was asked for.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    #[error(transparent)]
    Shaft(#[from] ShaftError),
    #[error(transparent)]
    Play(#[from] PlayError),
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error("{0}")]
    Plant(String),
    #[error("cannot write to stdout: {0}")]
    Output(#[from] io::Error),
    #[error("cannot catch Ctrl-C: {0}")]
    Signals(#[from] ctrlc::Error),
}

impl Failure {
    /// 2 for usage, 3 for bus or I/O.
    pub(crate) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Shaft(_)
            | Self::Plant(_)
            | Self::Play(PlayError::Memory(MemoryError::AnotherProduct { .. })) => 2,
            Self::Play(_) | Self::Link(_) | Self::Output(_) | Self::Signals(_) => 3,
        })
    }
}
