//! How a verb ends when it does not succeed.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use codewheel_capture::{ReadError, WriteError};
use codewheel_commission::passport::FileError;
use codewheel_commission::{Kind, Trouble};
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
    #[error("cannot read {}: {reason}; check its name and its rights", .path.display())]
    Read {
        /// What was to be read.
        path: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    #[error("{} is no passport that can be used:\n{}", .path.display(), .reason.to_string().trim_end())]
    Passport {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        reason: FileError,
    },
    #[error(transparent)]
    Trouble(#[from] Trouble),
    #[error("interrupted")]
    Interrupted,
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

    /// What kind it is, in a word for programs.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Trouble(trouble) => match trouble.kind {
                Kind::Differs => "differs",
                Kind::Usage => "usage",
                Kind::Bus => "bus",
                Kind::Refused => "refused",
                Kind::TimeOut => "time-out",
            },
            Self::Usage(_) | Self::Passport { .. } => "usage",
            Self::Interrupted => "interrupted",
            _ => "bus",
        }
    }

    /// 1 for what is not as it should be, 2 for usage, 3 for bus or I/O, 4 for a refusal, 5 for a
    /// time-out; 130 where a person ended it, as shells have it.
    pub(crate) fn exit_code(&self) -> ExitCode {
        ExitCode::from(match self {
            Self::Trouble(trouble) => match trouble.kind {
                Kind::Differs => 1,
                Kind::Usage => 2,
                Kind::Bus => 3,
                Kind::Refused => 4,
                Kind::TimeOut => 5,
            },
            Self::Interrupted => 130,
            Self::Usage(_)
            | Self::Passport { .. }
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
            | Self::Read { .. }
            | Self::Record(_)
            | Self::Replay { .. }
            | Self::Output(_)
            | Self::Signals(_) => 3,
        })
    }
}
