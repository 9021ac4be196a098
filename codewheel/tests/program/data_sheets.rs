//! `codewheel eds`, `gsd` and `hilo`: what a configuration tool is fed with.

use std::fs;
use std::path::Path;

use crate::prompt::{codewheel, printed, stderr};

#[track_caller]
fn refused(arguments: &[&str], status: i32, sentence: &str) {
    let output = codewheel(arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {text}");
    assert!(text.contains(sentence), "{arguments:?} lacks {sentence:?}: {text}");
    assert!(output.stdout.is_empty());
}

fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let mut names: Vec<_> =
        names.map(|entry| entry.file_name().into_string().expect("text")).collect();
    names.sort_unstable();
    names
}

#[test]
fn a_sheet_goes_to_stdout_octet_for_octet_as_to_its_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().join("new/folder");
    for (verb, model, name) in
        [("eds", "amg11-d29", "AMG11D29.eds"), ("gsd", "HEAG162-P18", "PB18DPV0.GSD")]
    {
        let text = printed(&[verb, model]);
        assert!(text.contains("\r\n") && text.is_ascii());
        let path = place.join(name);
        let told = printed(&[verb, model, "-o", place.to_str().expect("text")]);
        assert_eq!(told, format!("{}\n", path.display()));
        assert_eq!(fs::read_to_string(&path).expect("written"), text);
    }
    assert_eq!(names(&place), ["AMG11D29.eds", "PB18DPV0.GSD"]);
}

#[test]
fn without_a_model_every_file_of_the_bus_is_written_under_its_name_in_the_manual() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().to_str().expect("text");
    assert_eq!(printed(&["gsd", "-o", place]).lines().count(), 3);
    assert_eq!(names(folder.path()), ["PB13DPV0.GSD", "PB18DPV0.GSD", "PB29DPV0.GSD"]);
    assert_eq!(printed(&["eds", "-o", place]).lines().count(), 10);
    assert_eq!(names(folder.path()).len(), 13);
    assert!(folder.path().join("PMG10D29.eds").is_file());
}

#[test]
fn a_file_that_says_something_else_is_kept_and_none_is_written_unless_forced() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().to_str().expect("text");
    let vendors = folder.path().join("PB29DPV0.GSD");
    fs::write(&vendors, "the vendor's own").expect("written");
    refused(&["gsd", "-o", place], 2, "add --force");
    assert_eq!(fs::read_to_string(&vendors).expect("there"), "the vendor's own");
    assert_eq!(names(folder.path()), ["PB29DPV0.GSD"]);

    printed(&["gsd", "-o", place, "--force"]);
    assert_eq!(fs::read_to_string(&vendors).expect("there"), printed(&["gsd", "amg11-p29"]));
    // What says the same is no conflict.
    printed(&["gsd", "-o", place]);
    assert_eq!(names(folder.path()).len(), 3, "and nothing else is left behind");
}

#[cfg(unix)]
#[test]
fn a_sheet_may_be_read_by_whoever_may_read_other_files() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
    let other = folder.path().join("other");
    fs::write(&other, "").expect("written");
    printed(&["eds", "amg11-d13", "-o", folder.path().to_str().expect("text")]);
    assert_eq!(mode(&folder.path().join("AMG11D13.eds")), mode(&other));
}

#[test]
fn the_wrong_bus_no_model_and_no_folder_are_refused_with_what_to_write() {
    refused(&["gsd", "amg11-d29"], 2, "write codewheel eds amg11-d29");
    refused(&["eds", "heag162-p29"], 2, "write codewheel gsd heag162-p29");
    refused(&["eds"], 2, "-o DIR");
    refused(&["eds", "amg11-d30"], 2, "the models are");
    refused(&["eds", "amg11-d29", "--force"], 2, "--output <DIR>");
    let file = tempfile::NamedTempFile::new().expect("a file");
    let below = file.path().join("folder");
    refused(&["eds", "amg11-d29", "-o", below.to_str().expect("text")], 3, "cannot keep");
}

/// PROFIBUS manual §8.
#[test]
fn the_example_of_the_manual_is_split_and_put_together() {
    assert_eq!(printed(&["hilo", "921600"]), "hi 14 lo 4096\n");
    assert_eq!(printed(&["hilo", "14", "4096"]), "921600\n");
    assert_eq!(printed(&["hilo", "E1000h"]), "hi 14 lo 4096\n");
    assert_eq!(printed(&["hilo", "0xE", "0x1000"]), "921600\n");
    let json = "{\"value\":921600,\"hi\":14,\"lo\":4096}\n";
    assert_eq!(printed(&["hilo", "--json", "921600"]), json);
    assert_eq!(printed(&["hilo", "--json", "14", "4096"]), json);
}

#[test]
fn what_fits_no_word_and_what_is_no_number_is_refused() {
    refused(&["hilo", "14", "65536"], 2, "lo 65536 does not fit 16 bits");
    refused(&["hilo", "65536", "0"], 2, "hi 65536 does not fit 16 bits");
    refused(&["hilo", "4294967296"], 2, "0 to 4294967295");
    refused(&["hilo", "12.5"], 2, "0xE1000");
    refused(&["hilo"], 2, "NUMBER");
}
