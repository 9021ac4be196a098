//! Anything whatever happens to the encoder and to its memory: never a panic, always a legal state.
//!
//! `device`, `profibus_slave` and `memory` are the bodies of the fuzz targets in `fuzz/`; here they
//! run over the corpus that is committed there.

mod any_record;
#[path = "../../../../fuzz/corpus.rs"]
mod corpus;
mod device;
mod memory;
mod profibus_slave;
mod requests;

#[test]
fn nothing_in_the_corpus_shakes_the_device() {
    corpus::run("device", device::body);
}

#[test]
fn nothing_in_the_corpus_makes_a_third_thing_of_old_and_new_records() {
    corpus::run("memory", memory::body);
}

#[test]
fn after_anything_in_the_corpus_a_proper_master_exchanges_data_with_the_slave() {
    corpus::run("profibus_slave", profibus_slave::body);
}
