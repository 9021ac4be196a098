//! The commands that the book prints: with their output in blocks marked `console`, those of the
//! README too, without it in blocks marked `sh`.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};
use tempfile::TempDir;

use crate::plant::Plant;
use crate::repository;

const CODEWHEEL: &str = env!("CARGO_BIN_EXE_codewheel");
/// The exit code of a port or an adapter that is not there.
const NO_BUS: i32 = 3;

/// A new folder in which commands may write files and read the examples.
fn folder_with_examples() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let examples = folder.path().join("examples");
    fs::create_dir(&examples).expect("a new folder");
    for file in fs::read_dir(repository().join("examples")).expect("the examples") {
        let file = file.expect("a file");
        fs::copy(file.path(), examples.join(file.file_name())).expect("a copy");
    }
    folder
}

/// The plant that readers talk to with the verbs of the master's side.
const BENCH: &str = "bench.toml";

/// Whether somebody must be there to talk to.
fn needs_the_bench(text: &str) -> bool {
    ["slcan:127.0.0.1:", "rs485:127.0.0.1:"].iter().any(|client| text.contains(client))
}

/// Copies the page, told by its path, into `folder`; its commands find a bench of their own there.
fn copy_page(page: &Path, folder: &Path) -> Option<Plant> {
    let name = page.strip_prefix(repository()).expect("a page of ours").display().to_string();
    let text = fs::read_to_string(page).expect("text");
    let bench = needs_the_bench(&text).then(|| {
        let plan = fs::read_to_string(repository().join("examples").join(BENCH)).expect("a plant");
        let file = folder.join(name.replace('/', "-")).with_extension("toml");
        fs::write(&file, plan.replace(":4001", ":0").replace(":4002", ":0")).expect("a copy");
        Plant::start(CODEWHEEL, &file)
    });
    let text = bench.iter().fold(text, |text, bench| bench.at_its_ports(&text));
    fs::write(folder.join(name.replace('/', "-")), text).expect("a copy");
    bench
}

#[test]
fn every_command_of_the_book_and_the_readme_does_what_is_printed() {
    let folder = folder_with_examples();
    std::env::set_current_dir(folder.path()).expect("a folder to be in");
    let pages = folder.path().join("pages");
    fs::create_dir(&pages).expect("a new folder");
    let mut papers = self::pages(&repository().join("docs/book/src"));
    papers.push(repository().join("README.md"));
    let benches: Vec<_> = papers.iter().filter_map(|page| copy_page(page, &pages)).collect();
    assert!(benches.len() >= 2, "the chapter and the README are read");
    trycmd::TestCases::new()
        .register_bin("codewheel", Path::new(CODEWHEEL))
        .case(pages.join("*.md").to_str().expect("a path that is text"))
        .run();
}

/// An encoder that is dropped is switched off.
struct Encoder(Child);

impl Drop for Encoder {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Every line of every `sh` block, continued ones joined, that begins with `codewheel` and a verb.
fn commands_without_output() -> Vec<Vec<String>> {
    let mut commands = Vec::new();
    for page in pages(&repository().join("docs/book/src")) {
        let text = fs::read_to_string(page).expect("a page");
        let mut is_shell = false;
        for event in Parser::new(&text) {
            match event {
                Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) => {
                    is_shell = &*kind == "sh";
                }
                Event::End(TagEnd::CodeBlock) => is_shell = false,
                Event::Text(block) if is_shell => {
                    let block = block.replace("\\\n", " ");
                    let lines = block.lines().filter_map(|line| line.strip_prefix("codewheel "));
                    commands.extend(lines.map(words));
                }
                _ => {}
            }
        }
    }
    commands
}

fn pages(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(pages(&path));
        } else {
            found.push(path);
        }
    }
    found.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    found
}

/// The words of a line, those between single quotes as one.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (place, part) in line.split('\'').enumerate() {
        if place % 2 == 1 {
            words.push(part.to_owned());
        } else {
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    words
}

/// Runs one of them in `folder`, on ports that are free; why it is not what the book promises.
fn run(mut arguments: Vec<String>, folder: &Path) -> Result<(), String> {
    for argument in &mut arguments {
        let free = argument.replace("127.0.0.1:4001", "127.0.0.1:0");
        *argument = free.replace("pty:/tmp/", &format!("pty:{}/", folder.display()));
    }
    let mut command = Command::new(CODEWHEEL);
    command.args(&arguments).current_dir(folder).stdin(Stdio::null());
    let needs_hardware =
        |argument: &String| argument.contains("/dev/") || argument.contains("can:");
    if arguments[0] != "encoder" {
        let output = command.output().expect("the program runs");
        let code = output.status.code();
        let is_good = match code {
            Some(0) => true,
            // What it looked for is not here, or not as it should be.
            Some(1) => arguments[0] == "doctor",
            Some(NO_BUS) => arguments[0] == "doctor" || arguments.iter().any(needs_hardware),
            _ => false,
        };
        let says = String::from_utf8_lossy(&output.stderr);
        return if is_good { Ok(()) } else { Err(format!("{arguments:?}: {code:?} {says}")) };
    }
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut encoder = Encoder(child.expect("the program starts"));
    let mut line = String::new();
    let out = encoder.0.stdout.take().expect("a pipe");
    BufReader::new(out).read_line(&mut line).expect("stdout");
    if line.starts_with(&format!("ready {} ", arguments[1])) {
        return Ok(());
    }
    let code = encoder.0.wait().expect("a child").code();
    if arguments.iter().any(needs_hardware) && code == Some(NO_BUS) {
        return Ok(());
    }
    Err(format!("{arguments:?}: {code:?}"))
}

#[test]
fn every_command_without_output_is_taken_and_every_encoder_gets_ready_that_needs_no_hardware() {
    let folder = folder_with_examples();
    let mut commands = commands_without_output();
    commands.sort_unstable();
    commands.dedup();
    let encoders = commands.iter().filter(|command| command[0] == "encoder").count();
    assert!(encoders >= 4, "{commands:?}");
    let wrong: Vec<_> =
        commands.into_iter().filter_map(|command| run(command, folder.path()).err()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let nonsense = ["encoder", "amg11-d99"].map(str::to_owned).to_vec();
    assert!(run(nonsense, folder.path()).is_err(), "a command that is refused is found");
}
