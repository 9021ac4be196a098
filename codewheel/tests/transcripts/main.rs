//! What the verbs of the master's side print, word for word, on buses with encoders that stand still.
//!
//! Each `.md` beside this file is one conversation with the plant in the `.toml` of its name.
//! `TRYCMD=overwrite` writes down what is printed now.

#[path = "../plant/mod.rs"]
mod plant;

use std::fs;
use std::path::{Path, PathBuf};

use plant::Plant;

const CODEWHEEL: &str = env!("CARGO_BIN_EXE_codewheel");

/// Conversations that run at the same time. They mostly wait for the clock of the bus.
const AT_ONCE: usize = 8;

fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/transcripts")
}

/// The conversations, and those that have a plant of their own.
fn transcripts() -> Vec<PathBuf> {
    let mut files: Vec<_> =
        fs::read_dir(here()).expect("here").map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|suffix| suffix == "md"));
    files.sort();
    files
}

#[test]
fn every_conversation_is_as_it_is_written_down() {
    let folder = tempfile::tempdir().expect("a folder");
    rayon::ThreadPoolBuilder::new().num_threads(AT_ONCE).build_global().expect("the first pool");
    let mut plants = Vec::new();
    for transcript in transcripts() {
        let copy = folder.path().join(transcript.file_name().expect("a name"));
        let plant = transcript.with_extension("toml").exists().then(|| {
            let file = copy.with_extension("toml");
            fs::copy(transcript.with_extension("toml"), &file).expect("a copy");
            Plant::start(CODEWHEEL, &file)
        });
        let text = fs::read_to_string(&transcript).expect("text");
        let text = plant.iter().fold(text, |text, plant| plant.at_its_ports(&text));
        fs::write(&copy, text).expect("written");
        plants.push((transcript, copy, plant));
    }
    assert!(plants.len() >= 6, "{}", plants.len());
    std::env::set_current_dir(folder.path()).expect("a folder to be in");
    let cases = trycmd::TestCases::new();
    cases.register_bin("codewheel", Path::new(CODEWHEEL));
    cases.case(folder.path().join("*.md").to_str().expect("text"));
    let overwrites = std::env::var_os("TRYCMD").is_some_and(|mode| mode == "overwrite");
    if !overwrites {
        return cases.run();
    }
    // It fails where something is different, after it has written that down.
    let _ = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| cases.run()));
    for (transcript, copy, plant) in plants {
        let text = fs::read_to_string(copy).expect("text");
        let text = plant.iter().fold(text, |text, plant| plant.on_paper(&text));
        fs::write(transcript, text).expect("written");
    }
}
