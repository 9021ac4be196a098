//! Any octets whatever from a peer that should speak SLCAN: never a panic, never more than was asked.
//!
//! The modules are the bodies of the fuzz targets in `fuzz/`; here they run over the corpus that is
//! committed there.

#[path = "../../../../fuzz/corpus.rs"]
mod corpus;
mod slcan_adapter;
mod slcan_client;

#[test]
fn nothing_in_the_corpus_shakes_the_adapter() {
    corpus::run("slcan_adapter", slcan_adapter::body);
}

#[test]
fn nothing_in_the_corpus_shakes_the_client() {
    corpus::run("slcan_client", slcan_client::body);
}
