//! The commands that the book prints: with their output in blocks marked `console`, without it in
//! blocks marked `sh`.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};

use crate::repository;

const CODEWHEEL: &str = env!("CARGO_BIN_EXE_codewheel");
/// The exit code of a port or an adapter that is not there.
const NO_BUS: i32 = 3;

#[test]
fn every_command_of_the_book_does_what_the_book_says() {
    // Commands may write files and read the examples, as in a folder that has both.
    let folder = tempfile::tempdir().expect("a folder");
    let examples = folder.path().join("examples");
    fs::create_dir(&examples).expect("a new folder");
    for file in fs::read_dir(repository().join("examples")).expect("the examples") {
        let file = file.expect("a file");
        fs::copy(file.path(), examples.join(file.file_name())).expect("a copy");
    }
    std::env::set_current_dir(folder.path()).expect("a folder to be in");
    let pages = repository().join("docs/book/src/**/*.md");
    trycmd::TestCases::new()
        .register_bin("codewheel", Path::new(CODEWHEEL))
        .case(pages.to_str().expect("a path that is text"))
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
            Some(1 | NO_BUS) => arguments[0] == "doctor",
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
    let folder = tempfile::tempdir().expect("a folder");
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
