//! The end of a recording, told on stderr.

use codewheel_plant::Recording;

use crate::arguments::Chatter;
use crate::failure::Failure;

/// Ends a recording whose buses have ended, and tells what became of it; a loss also to those who
/// asked for silence.
pub(crate) fn end(recording: Recording, chatter: Chatter) -> Result<(), Failure> {
    let path = recording.path().to_owned();
    let so_far = recording.recorded();
    let finished = recording.finish();
    let recorded = finished.as_ref().map_or(so_far, |recorded| *recorded);
    let file = path.display();
    match &finished {
        Err(_) if recorded.lost > 0 => {
            eprintln!("codewheel: {file} lacks {} frames and telegrams", recorded.lost);
        }
        Ok(_) if recorded.lost > 0 => eprintln!(
            "codewheel: {file} lacks {} frames and telegrams, which the disk did not take in time; \
             {} were recorded",
            recorded.lost, recorded.records
        ),
        Ok(_) if chatter > Chatter::Quiet => {
            eprintln!("codewheel: {file} holds {} frames and telegrams", recorded.records);
        }
        _ => {}
    }
    finished?;
    Ok(())
}
