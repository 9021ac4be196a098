//! What the verbs of the master's side print, word for word, on buses with encoders that stand still.
//!
//! Each `.md` beside this file is one conversation with the plant in the `.toml` of its name, which
//! another process runs. `127.0.0.1:4001` stands there for the port of its DeviceNet and
//! `127.0.0.1:4002` for that of its PROFIBUS. `TRYCMD=overwrite` writes down what is printed now.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;

const CODEWHEEL: &str = env!("CARGO_BIN_EXE_codewheel");

/// The ports that the transcripts name, by the kind of their bus.
const PORTS: [(&str, &str); 2] =
    [("slcan-listen:", "127.0.0.1:4001"), ("rs485-listen:", "127.0.0.1:4002")];

/// Conversations that run at the same time. They mostly wait for the clock of the bus.
const AT_ONCE: usize = 8;

/// A plant that runs; killed when dropped.
struct Plant {
    child: Child,
    /// The port of each kind of bus.
    ports: BTreeMap<&'static str, String>,
}

impl Plant {
    fn start(file: &Path) -> Self {
        let mut child = Command::new(CODEWHEEL)
            .args(["run", file.to_str().expect("text")])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut lines = BufReader::new(child.stderr.take().expect("a pipe")).lines();
        let text = fs::read_to_string(file).expect("a plant");
        let mut ports = BTreeMap::new();
        for _ in text.lines().filter(|line| line.starts_with("[[bus]]")) {
            let line = lines.next().expect("a line for each bus").expect("text");
            let port = PORTS.into_iter().find_map(|(kind, _)| {
                let uri = line.split_whitespace().find_map(|word| word.strip_prefix(kind))?;
                Some((kind, uri.strip_suffix(':')?.to_owned()))
            });
            ports.extend([port.unwrap_or_else(|| panic!("{}: {line}", file.display()))]);
        }
        // What else it says must not fill the pipe.
        thread::spawn(move || lines.for_each(drop));
        Self { child, ports }
    }

    /// `text` with the ports that it has in place of those that transcripts name, or back.
    fn translate(&self, text: &str, back: bool) -> String {
        PORTS.iter().fold(text.to_owned(), |text, (kind, named)| match self.ports.get(kind) {
            None => text,
            Some(port) if back => text.replace(port, named),
            Some(port) => text.replace(named, port),
        })
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

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
            Plant::start(&file)
        });
        let text = fs::read_to_string(&transcript).expect("text");
        let text = plant.iter().fold(text, |text, plant| plant.translate(&text, false));
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
        let text = plant.iter().fold(text, |text, plant| plant.translate(&text, true));
        fs::write(transcript, text).expect("written");
    }
}
