//! What the papers name is there: tests and files. Links are followed in `tests/book/links.rs`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The papers of the root; each is read whole.
const PAPERS: &[&str] =
    &["ARCHITECTURE.md", "CHANGELOG.md", "CONFORMANCE.md", "CONTRIBUTING.md", "README.md"];

/// Folders that are not ours to read.
const LEFT_OUT: &[&str] = &["target", "corpus", "artifacts", "node_modules", ".git"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn paper(name: &str) -> String {
    fs::read_to_string(root().join(name)).expect("a paper of the root")
}

/// What stands between two backticks on one line, with the number of the line.
fn quoted(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().flat_map(|(line, text)| {
        text.split('`').skip(1).step_by(2).map(move |quoted| (line + 1, quoted))
    })
}

/// Every file of the repository, as its path from the root.
fn files() -> Vec<String> {
    let root = root();
    let mut found = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder that can be read") {
            let path = entry.expect("an entry that can be read").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if !path.is_dir() {
                let path = path.strip_prefix(&root).expect("below the root");
                found.push(path.to_string_lossy().into_owned());
            } else if !LEFT_OUT.contains(&name.as_str()) {
                folders.push(path);
            }
        }
    }
    found
}

/// Whether `source`, written in the language that `path` ends with, has a test of this name: a
/// function that is a test, one that a macro of the file makes, a step of a walk.
fn has_test(path: &str, source: &str, name: &str) -> bool {
    if path.ends_with(".py") {
        return source.lines().any(|line| line.trim_start().starts_with(&format!("def {name}(")));
    }
    let function = format!("fn {name}(");
    let made = format!("{name}: ");
    let mut is_test = false;
    for line in source.lines().map(str::trim) {
        if line == "#[test]" {
            is_test = true;
        } else if line.starts_with(&function) {
            return is_test;
        } else if line.contains("fn ") {
            is_test = false;
        } else if line.starts_with(&made) && source.contains("macro_rules!") {
            return true;
        }
    }
    false
}

#[test]
fn every_test_that_conformance_names_is_there() {
    let text = paper("CONFORMANCE.md");
    let mut sources = BTreeMap::new();
    let (mut named, mut missing) = (0, Vec::new());
    for (line, quoted) in quoted(&text) {
        let Some((path, name)) = quoted.split_once("::").filter(|(path, _)| path.contains('/'))
        else {
            continue;
        };
        named += 1;
        let source = sources
            .entry(path)
            .or_insert_with(|| fs::read_to_string(root().join(path)).unwrap_or_default());
        if !has_test(path, source, name) {
            missing.push(format!("line {line}: {path}::{name}"));
        }
    }
    assert!(named > 500, "only {named} tests are named: how they are written has changed");
    assert!(missing.is_empty(), "CONFORMANCE.md names what is not there:\n{}", missing.join("\n"));
}

#[test]
fn every_row_of_conformance_has_a_test_or_says_why_not() {
    let text = paper("CONFORMANCE.md");
    let excuses = ["paper", "no test", "not yet", "deviates", "library"];
    let rows: Vec<_> = text.lines().filter(|line| line.starts_with("| ")).collect();
    assert!(rows.len() > 300);
    for row in rows {
        let cells: Vec<_> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        if let [clause, statement, "–", state] = cells[..] {
            let excused = excuses.iter().any(|excuse| state.contains(excuse));
            assert!(excused, "{clause}, {statement}: {state}");
        }
    }
}

#[test]
fn every_file_that_the_papers_name_is_there() {
    let files = files();
    let endings = [".rs", ".toml", ".py", ".sh", ".md", ".json", ".svg", ".lua"];
    let mut missing = Vec::new();
    for name in PAPERS {
        let text = paper(name);
        for (line, quoted) in quoted(&text) {
            let plain = |letter: char| letter.is_ascii_alphanumeric() || "/-_.".contains(letter);
            let is_file = endings.iter().any(|ending| quoted.ends_with(ending))
                && quoted.contains('/')
                && !quoted.starts_with(['.', '/'])
                && quoted.chars().all(plain);
            let end = format!("/{quoted}");
            if is_file && !files.iter().any(|file| file == quoted || file.ends_with(&end)) {
                missing.push(format!("{name}, line {line}: {quoted}"));
            }
        }
    }
    assert!(missing.is_empty(), "the papers name what is not there:\n{}", missing.join("\n"));
}

#[test]
fn a_name_in_a_comment_or_of_no_test_counts_for_nothing() {
    let source = "// fn a_comment() {\nfn a_helper() {\n    #[test]\n    fn a_test() {\n";
    assert!(has_test("x.rs", source, "a_test"));
    for name in ["a_comment", "a_helper", "a_tes", "nothing"] {
        assert!(!has_test("x.rs", source, name), "{name}");
    }
    let made = "macro_rules! at {\n#[test]\n    a_rate: Kbit500,\n";
    assert!(has_test("x.rs", made, "a_rate") && !has_test("x.rs", made, "a_speed"));
    assert!(has_test("x.py", "    def a_step(self) -> str:\n", "a_step"));
    assert!(!has_test("x.py", "    # a_step(\n", "a_step"));
}
