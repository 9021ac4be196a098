//! Chapters that the program writes.

use std::fs;
use std::process::Command;

use crate::repository;

#[test]
fn the_chapters_on_models_are_what_the_program_says_today() {
    let fresh = tempfile::tempdir().expect("a folder");
    let status = Command::new(env!("CARGO_BIN_EXE_codewheel"))
        .args(["describe", "--all", "--markdown", "-o"])
        .arg(fresh.path())
        .output()
        .expect("the program runs")
        .status;
    assert!(status.success());
    let kept = repository().join("docs/book/src/reference");
    for name in ["devicenet.md", "profibus.md"] {
        let fresh = fs::read_to_string(fresh.path().join(name)).expect("written");
        let kept = fs::read_to_string(kept.join(name)).unwrap_or_default();
        assert!(
            fresh == kept,
            "{name} is stale: run cargo run -- describe --all --markdown -o docs/book/src/reference \
             --force"
        );
    }
}

#[test]
fn every_chapter_stands_in_the_summary() {
    let source = repository().join("docs/book/src");
    let summary = fs::read_to_string(source.join("SUMMARY.md")).expect("a summary");
    let mut count = 0;
    for folder in [".", "commissioning", "recipes", "reference"] {
        for file in fs::read_dir(source.join(folder)).expect("a folder") {
            let path = file.expect("a file").path();
            let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
            if !name.ends_with(".md") || name == "SUMMARY.md" {
                continue;
            }
            let target = if folder == "." { name.to_owned() } else { format!("{folder}/{name}") };
            assert!(summary.contains(&format!("]({target})")), "{target} is in no summary");
            count += 1;
        }
    }
    assert!(count > 10, "{count} chapters");
}
