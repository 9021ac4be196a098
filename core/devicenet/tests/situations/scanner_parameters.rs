//! A device never seen before, read by its Parameter object.

use codewheel_devicenet::explicit::{Error, GeneralStatus};
use codewheel_devicenet::scanner::{DataType, Parameter, ParameterWalk, Response, Walked};
use proptest::prelude::*;

use crate::scanner_bench::{Bench, Peer, millis};

const REFUSED: Response<'static> =
    Response::Refused(Error { general: GeneralStatus::ATTRIBUTE_NOT_SUPPORTED, additional: 0xFF });
const MISSING: Response<'static> =
    Response::Refused(Error { general: GeneralStatus::OBJECT_DOES_NOT_EXIST, additional: 0xFF });

/// Walks a device that answers as `answer` says.
fn walk(answer: impl FnMut(u8, u8) -> Response<'static>) -> (Vec<Parameter>, Vec<[u8; 4]>) {
    take(ParameterWalk::new(), answer)
}

fn take(
    mut walk: ParameterWalk,
    mut answer: impl FnMut(u8, u8) -> Response<'static>,
) -> (Vec<Parameter>, Vec<[u8; 4]>) {
    let (mut found, mut asked) = (Vec::new(), Vec::new());
    while let Some(request) = walk.request() {
        asked.push(request);
        let [0x0E, 0x0F, instance, attribute] = request else { panic!("{request:02X?}") };
        if let Walked::Parameter(parameter) = walk.take(answer(instance, attribute)) {
            found.push(*parameter);
        }
    }
    (found, asked)
}

fn full(instance: u8, attribute: u8) -> Response<'static> {
    Response::Done(match (instance, attribute) {
        (0, 2) => &[2, 0],
        (0, 8) => &[0x0F, 0],
        (_, 1) => &[0xFE, 0xFF],
        (_, 3) => &[0x20, 0x2F, 0x24, 0x01, 0x30, 0x07],
        (_, 4) => &[0x10, 0],
        (_, 5) => &[0xC3],
        (_, 6) => &[2],
        (_, 7) => b"\x05Speed",
        (_, 8) => b"\x03rpm",
        (_, 9) => b"\x0Ahow fast\x01?",
        (_, 10) => &[0, 0x80],
        (_, 11) => &[0xFF, 0x7F],
        (_, 12) => &[0, 0],
        (_, 13) => &[2, 0],
        (_, 17) => &[3, 0],
        (_, 21) => &[1],
        _ => &[1, 0],
    })
}

#[test]
fn each_full_instance_is_asked_for_all_its_attributes() {
    let (found, asked) = walk(full);
    assert_eq!(found.len(), 2);
    assert_eq!(asked.len(), 2 + 2 * 20);
    assert_eq!(asked[..4], [[14, 15, 0, 2], [14, 15, 0, 8], [14, 15, 1, 1], [14, 15, 1, 3]]);
    let second = &found[1];
    assert_eq!(second.number, 2);
    assert_eq!(second.link.as_slice(), [0x20, 0x2F, 0x24, 0x01, 0x30, 0x07]);
    assert_eq!(second.data_type.name(), Some("INT"));
    assert_eq!(second.data_type.number(second.value.as_slice()), Some(-2));
    assert_eq!(second.data_type.number(second.minimum.as_slice()), Some(-32768));
    assert_eq!(second.data_type.number(second.maximum.as_slice()), Some(32767));
    assert_eq!((second.name.to_string(), second.units.to_string()), ("Speed".into(), "rpm".into()));
    assert_eq!(second.help.to_string(), "how fast??");
    assert_eq!((second.scaling, second.scaling_links), ([2, 1, 1, 1], [3, 1, 1, 1]));
    assert!(second.is_read_only() && !second.is_enumerated());
    assert_eq!((second.size, second.decimals), (2, 1));
}

#[test]
fn one_instance_is_walked_alone() {
    let (found, asked) = take(ParameterWalk::of_one(2), full);
    assert_eq!(found.iter().map(|parameter| parameter.number).collect::<Vec<_>>(), [2]);
    assert_eq!(asked.len(), 1 + 20);
    assert_eq!(asked[..2], [[14, 15, 0, 8], [14, 15, 2, 1]]);
    let (found, asked) = take(ParameterWalk::of_one(255), |_, _| MISSING);
    assert!(found.is_empty());
    assert_eq!(asked.len(), 2);
}

#[test]
fn stubs_are_asked_for_six_attributes_and_gaps_are_passed_over() {
    let (found, asked) = walk(|instance, attribute| match (instance, attribute) {
        (0, 2) => Response::Done(&[3, 0]),
        (0, 8) => Response::Done(&[1, 0]),
        (2, _) => MISSING,
        (_, 5) => Response::Done(&[0x08]),
        (_, 1) => Response::Done(&[200]),
        _ => REFUSED,
    });
    assert_eq!(found.iter().map(|parameter| parameter.number).collect::<Vec<_>>(), [1, 3]);
    assert_eq!(asked.len(), 2 + 5 + 1 + 5);
    assert_eq!(found[1].data_type.number(found[1].value.as_slice()), Some(200));
    assert!(found[1].name.is_empty());
}

#[test]
fn a_device_without_a_parameter_object_ends_the_walk_at_once() {
    for answer in [MISSING, REFUSED, Response::Done(&[0, 0]), Response::Done(&[])] {
        let mut walk = ParameterWalk::new();
        assert_eq!(walk.take(answer), Walked::End);
        assert_eq!(walk.request(), None);
    }
}

#[test]
fn a_request_without_an_answer_is_repeated_once() {
    let mut walk = ParameterWalk::new();
    let first = walk.request();
    assert_eq!(walk.take(Response::NoAnswer), Walked::On);
    assert_eq!(walk.request(), first);
    assert_eq!(walk.take(Response::Done(&[1, 0])), Walked::On);
    assert_eq!(walk.count(), 1);
    assert_eq!(walk.take(Response::NoAnswer), Walked::On);
    assert_eq!(walk.take(Response::NoAnswer), Walked::NoAnswer);
    assert_eq!(walk.request(), None);
}

#[test]
fn the_last_instance_that_a_request_can_name_is_255() {
    let (found, _) = walk(|instance, attribute| match (instance, attribute) {
        (0, 2) => Response::Done(&[0xFF, 0xFF]),
        (0, 8) => Response::Done(&[1, 0]),
        _ => Response::Done(&[1]),
    });
    assert_eq!(found.len(), 255);
}

#[test]
fn numbers_are_read_as_their_types_say() {
    let (found, _) = walk(|instance, attribute| match (instance, attribute) {
        (0, 2) => Response::Done(&[1, 0]),
        (0, 8) => Response::Done(&[1, 0]),
        (_, 1) => Response::Done(&[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]),
        _ => REFUSED,
    });
    // Texts are longer than numbers, so all of it is there.
    let value = found[0].value.as_slice();
    assert_eq!((value.len(), DataType(0xC9).number(value)), (9, None));
    let value = &value[..8];
    assert_eq!(DataType(0xC5).number(value), Some(-1));
    assert_eq!(DataType(0xC9).number(value), Some(i128::from(u64::MAX)));
    assert_eq!(DataType(0xCA).number(value), None);
    assert_eq!(DataType(0x77).name(), None);
}

#[test]
fn a_walk_is_driven_with_tickets() {
    let peer = Peer::new(5)
        .answers("0E0F0002", "8E 0100")
        .answers("0E0F0008", "8E 0100")
        .answers("0E0F0101", "8E 2A");
    let mut bench = Bench::polling(peer);
    let mut walk = ParameterWalk::new();
    let mut found = Vec::new();
    while let Some(request) = walk.request() {
        let body: String = request.iter().map(|octet| format!("{octet:02X}")).collect();
        let ticket = bench.request(&body).unwrap();
        bench.run(millis(10));
        bench
            .scanner
            .response(ticket, |response| {
                if let Walked::Parameter(parameter) = walk.take(response) {
                    found.push(*parameter);
                }
            })
            .unwrap();
    }
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].value.as_slice(), [42]);
}

proptest! {
    #[test]
    fn whatever_is_answered_the_walk_ends(
        answers in prop::collection::vec(
            prop_oneof![
                4 => prop::collection::vec(any::<u8>(), 0..300).prop_map(Some),
                1 => Just(None),
            ],
            1..50,
        )
    ) {
        let mut walk = ParameterWalk::new();
        let mut asked = 0_usize;
        while walk.request().is_some() {
            let answer = &answers[asked % answers.len()];
            let response = answer.as_deref().map_or(Response::NoAnswer, Response::Done);
            walk.take(response);
            asked += 1;
            prop_assert!(asked <= 2 * (2 + 255 * 20));
        }
    }
}
