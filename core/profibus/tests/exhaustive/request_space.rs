//! Every function code with every pair of service access points, in every state.
//!
//! What is expected is written here once more, from the table of services, and not taken from the
//! code that is tested.

use codewheel_profibus::State;
use codewheel_station::rs485::Transmission;

use crate::still::{GOOD_PARAMETERS, INPUTS, answer, request, station};
use crate::whole;

const RS: &[u8] = &[0x10, 2, 7, 3, 0x0C, 0x16];
const STATES: [State; 3] = [State::WaitPrm, State::WaitCfg, State::DataExchange];

/// What the request carries behind its service access points.
fn data(saps: Option<(u8, u8)>) -> &'static [u8] {
    match saps {
        None => &[0; 4],
        Some((61, _)) => &GOOD_PARAMETERS,
        Some((62, _)) => &[0xF1],
        Some((58, _)) => &[0x20, 0],
        Some(_) => &[],
    }
}

/// The answer that is due to master 2 and the state after it; no octets for silence.
fn expected(state: State, code: u8, saps: Option<(u8, u8)>) -> (Vec<u8>, State) {
    let exchanging = state == State::DataExchange;
    let with = |service: u8, ssap: u8, data: &[u8]| {
        let length = data.len() as u8 + 5;
        let mut octets = vec![0x68, length, length, 0x68, 0x82, 0x87, 0x08, ssap, service];
        octets.extend(data);
        let sum = octets[4..].iter().map(|octet| u32::from(*octet)).sum::<u32>();
        octets.extend([(sum % 256) as u8, 0x16]);
        octets
    };
    let refused = (RS.to_vec(), state);
    if !matches!(code, 0x40..=0x7F) {
        return (vec![], state);
    }
    match code % 16 {
        0x9 => return (vec![0x10, 2, 7, 0, 9, 0x16], state),
        0x3 | 0x5 | 0xE | 0xF => return refused,
        0xC | 0xD => {}
        _ => return (vec![], state),
    }
    match saps {
        None if exchanging => {
            (vec![0x68, 7, 7, 0x68, 2, 7, 8, 0, 0, 0x12, 0x34, 0x57, 0x16], state)
        }
        Some((56, ssap)) if exchanging => (with(56, ssap, &INPUTS), state),
        Some((57, ssap)) if exchanging => (with(57, ssap, &[0; 4]), state),
        Some((59, ssap)) => (with(59, ssap, &[0xF1]), state),
        Some((60, ssap)) => {
            let (status, master) = match state {
                State::WaitPrm => ([2, 5, 0], 0xFF),
                State::WaitCfg => ([2, 4, 0], 2),
                State::DataExchange => ([0, 4, 0], 2),
            };
            (with(60, ssap, &[&status[..], &[master, 0x05, 0x9B, 1]].concat()), state)
        }
        Some((61, _)) => (vec![0xE5], State::WaitCfg),
        Some((62, _)) if state != State::WaitPrm => (vec![0xE5], State::DataExchange),
        _ => refused,
    }
}

fn octets(answer: Option<&Transmission>) -> &[u8] {
    answer.map_or(&[], Transmission::octets)
}

#[test]
fn every_request_gets_the_answer_of_the_table_and_leads_to_its_state() {
    let ssaps: Vec<u8> = if whole() { (0..128).collect() } else { vec![0, 62, 127] };
    let mut requests = 0_u64;
    for state in STATES {
        let fresh = station(state);
        for code in 0..=255 {
            let pairs = (0..128).flat_map(|dsap| ssaps.iter().map(move |ssap| Some((dsap, *ssap))));
            for saps in pairs.chain([None]) {
                let mut slave = fresh.clone();
                let given = answer(&mut slave, &request(7, code, saps, data(saps)));
                let (expected, next) = expected(state, code, saps);
                assert!(
                    octets(given.as_ref()) == expected && slave.state() == next,
                    "{state:?} {code:02X} {saps:?}: {given:?} in {:?}",
                    slave.state()
                );
                requests += 1;
            }
        }
    }
    println!("{requests} requests answered as the table says");
}

#[test]
fn every_function_code_to_another_station_or_to_all_meets_silence() {
    for state in STATES {
        let fresh = station(state);
        for code in 0..=255 {
            for destination in (0..128).filter(|destination| *destination != 7) {
                for saps in [None, Some((60, 62)), Some((61, 62)), Some((58, 62))] {
                    let mut slave = fresh.clone();
                    let given = answer(&mut slave, &request(destination, code, saps, data(saps)));
                    assert_eq!(given, None, "{destination} {code:02X} {saps:?}");
                    assert_eq!(slave.state(), state);
                }
            }
        }
    }
}

#[test]
fn every_function_code_with_half_an_extension_is_refused_where_it_would_be_answered() {
    for state in STATES {
        let fresh = station(state);
        for code in 0..=255_u8 {
            for (destination, source) in [(0x87_u8, 0x02_u8), (0x07, 0x82)] {
                let sum = [destination, source, code, 61, 62].into_iter().fold(0, u8::wrapping_add);
                let whole = [0x68, 5, 5, 0x68, destination, source, code, 61, 62, sum, 0x16];
                let mut slave = fresh.clone();
                let telegram = Transmission::new(&whole).expect("room");
                let given = answer(&mut slave, &telegram);
                let silent = expected(state, code, None).0.is_empty();
                assert_eq!(octets(given.as_ref()), if silent { &[] } else { RS }, "{code:02X}");
                assert_eq!(slave.state(), state);
            }
        }
    }
}
