//! Tells what a capture holds: `cargo run --example replay FILE [--json]`.

use std::error::Error;
use std::io::{BufWriter, stdout};
use std::path::PathBuf;

use codewheel_capture::{Assume, Decoder, Output, Reader, replay};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let path = PathBuf::from(arguments.next().ok_or("say the file to read")?);
    let json = arguments.next().is_some_and(|word| word == "--json");
    let mut reader = Reader::open(&path)?;
    let output = if json { Output::Json } else { Output::Text };
    let mut decoder = Decoder::new(output, Assume::Encoders);
    let mut out = BufWriter::new(stdout().lock());
    let complain = &mut |error: &_| eprintln!("{}: {error}", path.display());
    let replayed = replay(&mut reader, &mut decoder, &mut out, complain)?;
    eprintln!("{replayed:?}");
    Ok(())
}
