//! The book and the papers keep their word: commands do what is printed, chapters made by the program
//! are fresh, links lead somewhere.

mod chapters;
mod commands;
mod links;
#[path = "../plant/mod.rs"]
mod plant;

use std::path::{Path, PathBuf};

/// The root of the repository.
fn repository() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    root.canonicalize().expect("the repository is there")
}
