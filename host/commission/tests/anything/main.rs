//! Anything whatever comes to the master: never a panic, never out of turn, and always a way back.
//!
//! `profibus_master` is the body of the fuzz target in `fuzz/`; here it runs over the corpus that is
//! committed there.

#[path = "../../../../fuzz/corpus.rs"]
mod corpus;
mod profibus_master;

#[test]
fn after_anything_in_the_corpus_the_master_exchanges_data_with_all_its_slaves() {
    corpus::run("profibus_master", profibus_master::body);
}
