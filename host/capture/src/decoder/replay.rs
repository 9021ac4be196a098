//! A whole capture, line by line.

use std::io::{self, BufRead, Write};

use super::Decoder;
use crate::{ReadError, Reader};

/// What a replay has seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Records that were decoded.
    pub records: u64,
    /// Records passed over since they are no traffic of ours: error frames, other links.
    pub skipped: u64,
    /// Places that could not be read.
    pub damages: u64,
}

/// As much is gathered before it is given out.
const GATHERED: usize = 1 << 16;

/// Decodes all that `reader` gives and writes a line for each record to `out`. `complain` hears what
/// cannot be read, when everything before it has been written; the replay goes on behind it where it can.
///
/// # Errors
/// What `out` says.
pub fn replay<R: BufRead>(
    reader: &mut Reader<R>,
    decoder: &mut Decoder,
    out: &mut impl Write,
    complain: &mut impl FnMut(&ReadError),
) -> io::Result<Replayed> {
    let mut lines = Vec::with_capacity(GATHERED + 4_096);
    let mut replayed = Replayed::default();
    loop {
        match reader.read() {
            Ok(Some((bus, record))) => {
                decoder.decode(bus, &record, &mut lines);
                replayed.records += 1;
                if lines.len() < GATHERED {
                    continue;
                }
                out.write_all(&lines)?;
                lines.clear();
            }
            Ok(None) => break,
            Err(error) => {
                out.write_all(&lines)?;
                lines.clear();
                replayed.damages += 1;
                complain(&error);
            }
        }
    }
    out.write_all(&lines)?;
    out.flush()?;
    replayed.skipped = reader.skipped();
    Ok(replayed)
}
