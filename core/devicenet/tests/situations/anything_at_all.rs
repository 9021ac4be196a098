//! Arbitrary frames at arbitrary times: never a panic, always a legal state.

use codewheel_devicenet::NetworkStatus;
use codewheel_devicenet::connection::State;
use codewheel_station::can::{Frame, Input};
use codewheel_station::{Duration, Station};
use proptest::prelude::*;

use crate::bench::Bench;

/// One thing that happens to the node.
#[derive(Clone, Debug)]
enum Happening {
    Frame(u16, Vec<u8>),
    Time(u64),
    Complete(bool),
}

fn happening() -> impl Strategy<Value = Happening> {
    let plausible = (
        prop_oneof![Just(0x42C_u16), Just(0x42D), Just(0x42E), Just(0x42F)],
        prop_oneof![Just(0x0A_u8), Just(0x8A), Just(0x4A), any::<u8>()],
        prop::sample::select(vec![0x0E_u8, 0x10, 0x05, 0x0D, 0x4B, 0x4C, 0x16, 0x00, 0x41, 0x81]),
        prop::sample::select(vec![1_u8, 2, 3, 4, 5, 0x64]),
        0..4_u8,
        prop::collection::vec(0..16_u8, 0..4),
    )
        .prop_map(|(id, header, service, class, instance, rest)| {
            let mut data = vec![header, service, class, instance];
            data.extend(rest);
            Happening::Frame(id, data)
        });
    prop_oneof![
        4 => plausible,
        2 => (0..0x800_u16, prop::collection::vec(any::<u8>(), 0..9))
            .prop_map(|(id, data)| Happening::Frame(id, data)),
        2 => Just(Happening::Frame(0x42D, vec![])),
        1 => Just(Happening::Frame(0x42E, vec![0x0A, 0x4B, 3, 1, 3, 0x0A])),
        1 => Just(Happening::Frame(0x42C, vec![0x0A, 0x10, 5, 2, 9, 100, 0])),
        2 => (0..12_000_u64).prop_map(Happening::Time),
        1 => any::<bool>().prop_map(Happening::Complete),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn whatever_arrives_the_state_stays_legal_and_the_node_falls_silent(
        happenings in prop::collection::vec(happening(), 1..80)
    ) {
        let mut bench = Bench::allocated();
        for happening in happenings {
            match happening {
                Happening::Frame(id, data) => {
                    let frame = Frame::standard(id, &data);
                    bench.node.handle(bench.now, Input::Frame(&frame));
                }
                Happening::Time(millis) => {
                    bench.wait(Duration::from_millis(millis));
                }
                Happening::Complete(good) => bench.node.server.complete(if good {
                    Ok(())
                } else {
                    Err(codewheel_devicenet::explicit::GeneralStatus::STORE_FAILED.into())
                }),
            }
            // `collect` fails if the node never stops sending.
            bench.collect();
            let server = &bench.node.server;
            let explicit = server.connection_state(1);
            let poll = server.connection_state(2);
            prop_assert!(matches!(
                explicit,
                None | Some(State::Established | State::DeferredDelete)
            ));
            prop_assert!(poll != Some(State::DeferredDelete));
            prop_assert_eq!(server.master().is_some(), explicit.is_some() || poll.is_some());
            if let NetworkStatus::Faulted(_) = server.status() {
                prop_assert!(explicit.is_none() && poll.is_none());
            }
            if explicit == Some(State::DeferredDelete) {
                prop_assert_eq!(poll, Some(State::Established));
            }
            if explicit.is_none() {
                prop_assert!(matches!(poll, None | Some(State::Established)));
            }
        }
    }
}
