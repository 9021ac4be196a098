//! Any octets whatever from a peer that should speak SLCAN or socketcand: never a panic, never more than was asked.
//!
//! The modules are the bodies of the fuzz targets in `fuzz/`; here they run over the corpus that is
//! committed there.

#[path = "../../../../fuzz/corpus.rs"]
mod corpus;
mod slcan_adapter;
mod slcan_client;
mod socketcand_server;

use proptest::prelude::*;
use proptest::{collection, sample};

#[test]
fn nothing_in_the_corpus_shakes_the_adapter() {
    corpus::run("slcan_adapter", slcan_adapter::body);
}

#[test]
fn nothing_in_the_corpus_shakes_the_client() {
    corpus::run("slcan_client", slcan_client::body);
}

/// Octets that look enough like socketcand to get somewhere.
fn socketcand_talk() -> impl Strategy<Value = Vec<u8>> {
    let words = [
        "< open can0 >",
        "< rawmode >",
        "<controlmode>",
        "< echo >",
        "< statistics 100 >",
        "< send 42D 0 >",
        "< send ",
        "< sendrtr ",
        "1AAAAAAA ",
        "7FF ",
        "2 1 F1 ",
        " >",
        "<",
        ">",
    ];
    let piece = prop_oneof![
        8 => sample::select(words.to_vec()).prop_map(|word| word.as_bytes().to_vec()),
        1 => collection::vec(any::<u8>(), 0..4),
    ];
    (any::<u8>(), collection::vec(piece, 0..60)).prop_map(|(cut, pieces)| {
        let mut octets = vec![cut];
        octets.extend(pieces.concat());
        octets
    })
}

proptest! {
    #[test]
    fn no_talk_whatever_shakes_the_server(octets in socketcand_talk()) {
        socketcand_server::body(&octets);
    }

    #[test]
    fn nothing_whatever_shakes_the_server(octets in collection::vec(any::<u8>(), 0..300)) {
        socketcand_server::body(&octets);
    }
}
