//! Anything whatever comes to the master: never a panic, never out of turn, and always a way back.
//!
//! `profibus_master` is the body of the fuzz target in `fuzz/`; here it runs over the corpus that is
//! committed there, and over operations drawn at random.

#[path = "../../../../fuzz/corpus.rs"]
mod corpus;
mod profibus_master;

use proptest::prelude::*;

#[test]
fn after_anything_in_the_corpus_the_master_exchanges_data_with_all_its_slaves() {
    corpus::run("profibus_master", profibus_master::body);
}

/// Operations with what they take: those of the master's owner, and time.
fn operation() -> impl Strategy<Value = Vec<u8>> {
    let slave = 6..11_u8;
    prop_oneof![
        (slave.clone(), 0..4_u8).prop_map(|(slave, what)| vec![0x8A, slave, what]),
        slave.prop_map(|slave| vec![0x8B, slave]),
        (0x00..0x62_u8, any::<[u8; 4]>()).prop_map(|(kind, rest)| [&[kind], &rest[..]].concat()),
        prop_oneof![Just(0x62_u8), Just(0x64), Just(0x85)].prop_map(|kind| vec![kind]),
        any::<u8>().prop_map(|bits| vec![0x83, 0, bits & 0x3F]),
        any::<[u8; 2]>().prop_map(|[to, from]| vec![0x88, to & 0x7F, from & 0x7F]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn whatever_its_owner_asks_meanwhile_it_comes_back_to_its_slaves(
        head in 0..32_u8,
        operations in prop::collection::vec(operation(), 0..60),
    ) {
        profibus_master::body(&[&[head], operations.concat().as_slice()].concat());
    }
}
