//! How a verb ends when it does not succeed.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use codewheel_capture::{ReadError, WriteError};
use codewheel_dashboard::StartError as PageError;
use codewheel_link::LinkError;
use codewheel_plant::{MemoryError, PlantError, RecordError, StartError};
use codewheel_sim::shaft::ShaftError;
use thiserror::Error;

/// Why a verb has not done what it was asked for.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    #[error("{0}")]
    Usage(String),
    #[error(transparent)]
    Shaft(#[from] ShaftError),
    #[error(transparent)]
    Plant(#[from] PlantError),
    #[error(transparent)]
    Start(#[from] StartError),
    #[error(transparent)]
    Page(#[from] PageError),
    #[error(transparent)]
    Link(#[from] LinkError),
    #[error("cannot keep {}: {reason}; check that the folder is there and may be written", .path.display())]
    File {
        /// What was to be read or written.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error("{}: {reason}", .path.display())]
    Replay {
        /// The recording.
        path: PathBuf,
        /// Why it cannot be read.
        reason: ReadError,
    },
    #[error("cannot write to stdout: {0}")]
    Output(#[from] io::Error),
    #[error("cannot catch Ctrl-C: {0}")]
    Signals(#[from] ctrlc::Error),
}

impl Failure {
    /// Whether nobody reads us any more: `codewheel | head` is a clean end.
    pub(crate) fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    /// 2 for usage, 3 for bus or I/O.
    pub(crate) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Usage(_)
            | Self::Shaft(_)
            | Self::Plant(PlantError::Wrong(_))
            | Self::Page(PageError::NeedsToken(_))
            | Self::Start(
                StartError::Memory(MemoryError::AnotherProduct { .. })
                | StartError::Master(_)
                | StartError::Ssi(_)
                | StartError::Record(RecordError { reason: WriteError::Format(_), .. }),
            )
            | Self::Record(RecordError { reason: WriteError::Format(_), .. }) => 2,
            Self::Plant(PlantError::Read { .. })
            | Self::Start(_)
            | Self::Page(_)
            | Self::Link(_)
            | Self::File { .. }
            | Self::Record(_)
            | Self::Replay { .. }
            | Self::Output(_)
            | Self::Signals(_) => 3,
        })
    }
}
