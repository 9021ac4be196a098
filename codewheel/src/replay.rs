//! `codewheel replay`: what a recording holds, line by line.

use std::process::ExitCode;

use codewheel_capture::{Assume, Decoder, Output, ReadError, Reader, replay};

use crate::arguments::{Chatter, ReplayArguments};
use crate::failure::Failure;

/// Something in the recording is damaged. What is whole has been told all the same.
const DAMAGED: u8 = 1;
/// Damages told one by one; of a file of something else each line is one.
const COMPLAINTS: u64 = 10;
/// The system stopped giving it.
const BROKEN_OFF: u8 = 3;

pub(crate) fn run(arguments: &ReplayArguments, chatter: Chatter) -> Result<ExitCode, Failure> {
    let path = &arguments.file;
    let mut reader = Reader::open(path).map_err(|reason| match reason {
        ReadError::Format(reason) => Failure::Usage(reason.to_string()),
        reason => Failure::Replay { path: path.clone(), reason },
    })?;
    let output = if arguments.json { Output::Json } else { Output::Text };
    let mut decoder = Decoder::new(output, Assume::Encoders);
    let mut broken_off = false;
    let mut told = 0_u64;
    let complain = &mut |error: &ReadError| {
        broken_off |= matches!(error, ReadError::Io(_));
        told += 1;
        if told <= COMPLAINTS || broken_off {
            eprintln!("codewheel: {}: {error}", path.display());
        }
    };
    let replayed = replay(&mut reader, &mut decoder, &mut std::io::stdout().lock(), complain)?;
    if told > COMPLAINTS {
        let more = told - COMPLAINTS;
        eprintln!("codewheel: {}: and {more} more places like these", path.display());
    }
    if chatter > Chatter::Quiet && replayed.skipped > 0 {
        eprintln!(
            "codewheel: {}: records that are no traffic of ours, such as error frames: {}",
            path.display(),
            replayed.skipped
        );
    }
    Ok(match replayed.damages {
        _ if broken_off => ExitCode::from(BROKEN_OFF),
        0 => ExitCode::SUCCESS,
        _ => ExitCode::from(DAMAGED),
    })
}
