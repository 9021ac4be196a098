//! Anything whatever happens to the scanner: never a panic, always a legal state.
//!
//! `scanner` is the body of a fuzz target in `fuzz/`; here it runs over the corpus that is committed
//! there.

#[path = "../../../../fuzz/corpus.rs"]
mod corpus;
mod scanner;

#[test]
fn nothing_in_the_corpus_shakes_the_scanner() {
    corpus::run("scanner", scanner::body);
}
