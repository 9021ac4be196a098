//! What shells and `man` get to know of the program.

use std::path::Path;

use crate::prompt::{codewheel, printed, stderr};

/// The verbs that `codewheel --help` lists.
fn verbs() -> Vec<String> {
    let help = printed(&["--help"]);
    let commands = help.split("Commands:\n").nth(1).expect("commands");
    let list = commands.split("\n\n").next().expect("a list");
    let lines = list.lines().filter_map(|line| line.strip_prefix("  "));
    let first = lines.filter(|line| !line.starts_with(' '));
    let verbs: Vec<String> =
        first.filter_map(|line| Some(line.split_whitespace().next()?.to_owned())).collect();
    assert!(verbs.len() > 10 && verbs.iter().any(|verb| verb == "run"), "{verbs:?}");
    verbs
}

#[test]
fn every_shell_is_told_every_verb_and_option() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = printed(&["completions", shell]);
        for word in verbs().iter().map(String::as_str).chain(["record", "markdown"]) {
            assert!(script.contains(word), "{shell} is not told {word}");
        }
    }
    let output = codewheel(&["completions", "tcsh"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("bash, elvish, fish, powershell, zsh"), "{}", stderr(&output));
}

#[test]
fn every_verb_has_a_manual_page_with_its_options_and_examples() {
    let folder = tempfile::tempdir().expect("a folder");
    let name = folder.path().display().to_string();
    let listed = printed(&["man", "-o", &name]);
    let page = |name: &str| std::fs::read_to_string(Path::new(&folder.path()).join(name));
    for verb in verbs().iter().filter(|verb| *verb != "help") {
        let file = format!("codewheel-{verb}.1");
        let text = page(&file).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert!(text.contains(&format!("codewheel\\-{verb}")) && text.contains(".SH OPTIONS"));
        assert!(listed.contains(&file), "{listed}");
    }
    let run = page("codewheel-run.1").expect("a page");
    assert!(
        run.contains("\\-\\-print\\-config") && run.contains("codewheel run examples"),
        "{run}"
    );
    assert_eq!(printed(&["man"]), page("codewheel.1").expect("the page of all"));
    // Again: what is there says the same.
    assert_eq!(printed(&["man", "-o", &name]), listed);
}
