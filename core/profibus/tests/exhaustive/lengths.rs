//! Set_Prm and Chk_Cfg of every length, with whatever octets.

use codewheel_profibus::State;

use crate::still::{answer, request, station};
use crate::whole;

#[test]
fn parameters_and_configurations_of_every_length_are_answered_and_leave_a_legal_state() {
    let contents = if whole() { 5_000 } else { 50 };
    let mut random = fastrand::Rng::with_seed(1);
    for state in [State::WaitPrm, State::WaitCfg, State::DataExchange] {
        let fresh = station(state);
        for length in 0..=244 {
            for content in 0..contents {
                for service in [61, 62] {
                    let mut data: Vec<u8> = (0..length).map(|_| random.u8(..)).collect();
                    // Half of the parameters are plausible, or none would come past the standard part.
                    if service == 61 && content % 2 == 0 {
                        for (octet, good) in data.iter_mut().zip([0x88, 1, 1, 0, 0x05, 0x9B]) {
                            *octet = good;
                        }
                        data.iter_mut().skip(7).take(1).for_each(|octet| *octet &= 0x1F);
                    }
                    let mut slave = fresh.clone();
                    let given = answer(&mut slave, &request(7, 0x6D, Some((service, 62)), &data));
                    let given = given.expect("an answer");
                    let refused = service == 62 && state == State::WaitPrm;
                    assert_eq!(given.octets().len(), if refused { 6 } else { 1 });
                    let free = slave.state() == State::WaitPrm;
                    assert_eq!(free, slave.master().is_none());
                    if service == 61 && content % 2 == 0 {
                        let good = (7..=25).contains(&length);
                        assert_eq!(!free, good, "{length} octets of parameters");
                        assert_eq!(slave.faults().parameters, !good);
                    }
                    if service == 62 && !refused {
                        assert_eq!(slave.faults().configuration, data != [0xF1]);
                    }
                }
            }
        }
    }
}
