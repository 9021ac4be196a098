//! Which files there are, and what is true of each.

use std::path::{Path, PathBuf};
use std::{env, fs};

use codewheel_datasheet::{sheet_for, sheets};
use codewheel_device::Product;

/// Where a file stands in this repository, seen from this crate.
pub(crate) fn kept_at(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Holds a file of the repository against what it should be; with `WRITE_GOLDEN=1` writes it.
#[track_caller]
pub(crate) fn is_kept(path: &Path, text: &str) {
    if env::var_os("WRITE_GOLDEN").is_some() {
        fs::write(path, text).expect("the repository can be written");
    }
    let kept = fs::read_to_string(path).unwrap_or_default();
    let line = kept.lines().zip(text.lines()).position(|(kept, new)| kept != new);
    let line = line.unwrap_or_else(|| kept.lines().count().min(text.lines().count())) + 1;
    assert!(
        kept == text,
        "{} differs from line {line} on. If it should: WRITE_GOLDEN=1 cargo test -p \
         codewheel-datasheet, look at the difference, and if a file says something new to a tool, \
         raise its revision",
        path.display()
    );
}

/// DeviceNet manual §1.2, PROFIBUS manual §1.2.
#[test]
fn there_are_the_thirteen_files_that_the_manuals_name() {
    let names: Vec<&str> = sheets().map(|sheet| sheet.file_name).collect();
    let manuals = [
        "AMG11D13.eds",
        "AMG11D29.eds",
        "AMG81D13.eds",
        "AMG81D29.eds",
        "PMG10D13.eds",
        "PMG10D29.eds",
        "HMG11D13.eds",
        "HMG11D29.eds",
        "HMG10D13.eds",
        "HMG10D29.eds",
        "PB13DPV0.GSD",
        "PB29DPV0.GSD",
        "PB18DPV0.GSD",
    ];
    assert_eq!(names, manuals);
}

#[test]
fn every_product_has_its_file_and_shares_it_only_with_those_of_its_geometry() {
    for product in Product::all() {
        let sheet = sheet_for(product);
        assert_eq!(sheet.file_name, product.data_sheet);
        let same = sheets().find(|other| other.file_name == sheet.file_name);
        assert_eq!(same, Some(sheet), "{}", product.model);
    }
}

#[test]
fn every_file_is_ascii_with_the_line_ends_of_configuration_tools() {
    for sheet in sheets() {
        let lines = sheet.text.strip_suffix("\r\n").expect("the last line ends");
        for line in lines.split("\r\n") {
            assert!(line.bytes().all(|octet| (b' '..=b'~').contains(&octet)), "{line}");
            assert_eq!(line.trim_end(), line, "{}", sheet.file_name);
            // GSD specification: at most 80 characters.
            assert!(line.len() <= 80 || sheet.file_name.ends_with(".eds"), "{line}");
        }
    }
}

#[test]
fn every_file_is_the_one_that_is_kept() {
    for sheet in sheets() {
        is_kept(&kept_at("tests/golden").join(sheet.file_name), &sheet.text);
    }
    let kept = fs::read_dir(kept_at("tests/golden")).expect("the kept files").count();
    assert_eq!(kept, sheets().count(), "a file is kept that is made no more");
}
