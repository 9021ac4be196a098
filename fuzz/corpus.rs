//! The committed corpus of a fuzz target, for the ordinary tests that run it.

use std::fs;
use std::path::Path;

/// Names the input that failed, when it did.
struct Named<'a>(&'a Path);

impl Drop for Named<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the input that failed: {}", self.0.display());
        }
    }
}

/// Runs `body` over every input in `fuzz/corpus/<target>`.
pub(crate) fn run(target: &str, body: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target);
    let mut inputs = 0;
    for entry in fs::read_dir(&folder).expect("the corpus is committed") {
        let path = entry.expect("a folder that can be read").path();
        let named = Named(&path);
        body(&fs::read(&path).expect("a file that can be read"));
        drop(named);
        inputs += 1;
    }
    assert!(inputs > 10, "only {inputs} inputs in {}", folder.display());
}
