//! Masters with a token, late with it, and without.

use codewheel_commission::Kind;
use codewheel_commission::profibus::ScanSettings;
use codewheel_station::Duration;

use crate::bench::{Bench, PLC, RATE, joining, node, quick, with_others};
use crate::speaker::{Speaker, TOKEN, fdl_status, slave_diag};

/// The slot time of a PC: 150 ms of silence are a lost token.
fn patient() -> ScanSettings {
    ScanSettings { join: true, slot_bits: None, ..quick(RATE) }
}

/// A master that asks a slave and pauses, and has no token.
fn tokenless(pause: Duration) -> Bench {
    let speaker = Speaker::new(RATE, vec![(slave_diag(7), pause)]);
    Bench::new().with(7, "amg11-p29").with_speaker(speaker)
}

/// A master that is busy without a pause in which its token seems lost, and then does something else.
fn busy(requests: usize, last: &[Vec<u8>]) -> Bench {
    let pause = Duration::from_millis(50);
    let asks = std::iter::repeat_n(slave_diag(7), requests).chain(last.iter().cloned());
    let speaker = Speaker::new(RATE, asks.map(|octets| (octets, pause)).collect());
    Bench::new().with(7, "amg11-p29").with_speaker(speaker)
}

#[test]
fn nobody_joins_where_no_token_goes_round() {
    for pause in [Duration::from_millis(250), Duration::from_millis(50)] {
        let mut bench = tokenless(pause);
        for settings in [joining(RATE), patient(), ScanSettings { address: 0, ..patient() }] {
            let trouble = bench.scan(settings).unwrap_err();
            assert_eq!(trouble.kind, Kind::Bus, "{trouble}");
            assert!(trouble.came.contains("no token was heard in 5."), "{trouble}");
            assert!(!trouble.remedy.contains("lower address"), "{trouble}");
        }
        let trouble = bench.open(7, &with_others()).unwrap_err();
        assert_eq!(trouble.kind, Kind::Bus, "{trouble}");
        bench.run(Duration::from_secs(1));
        assert_eq!(bench.said, 0);
        assert_eq!(bench.complaints, [""; 0]);
    }
}

#[test]
fn a_scan_beside_a_master_without_token_does_not_recommend_to_join_it() {
    let mut bench = tokenless(Duration::from_millis(250));
    let survey = bench.scan(quick(RATE)).unwrap();
    assert_eq!(node(&survey, PLC).state, "asks without a token");
    assert!(survey.remarks[0].contains("master 2 is on the bus"), "{:?}", survey.remarks);
    assert!(!survey.remarks[0].contains("--join"), "{:?}", survey.remarks);
    let trouble = bench.open(7, &crate::bench::alone()).unwrap_err();
    assert!(!trouble.remedy.contains("--join"), "{trouble}");
    assert_eq!(bench.said, 0);
}

#[test]
fn a_master_that_hands_its_token_on_after_a_long_cycle_is_of_a_ring() {
    let mut bench = busy(70, &[TOKEN.to_vec()]);
    let survey = bench.scan(quick(RATE)).unwrap();
    assert_eq!(node(&survey, PLC).state, "in the ring");
    assert!(survey.remarks[0].contains("--join"), "{:?}", survey.remarks);
    let trouble = bench.scan(patient()).unwrap_err();
    assert_eq!(trouble.came, "master 2 does not admit master 4 to its ring");
    assert_eq!(bench.said, 0);
}

#[test]
fn a_master_that_looks_for_others_is_listened_to_for_longer() {
    let says = [vec![slave_diag(7); 20], vec![fdl_status(3)], vec![slave_diag(7); 120]].concat();
    let mut bench = busy(0, &[says.clone(), vec![TOKEN.to_vec()]].concat());
    let survey = bench.scan(quick(RATE)).unwrap();
    assert_eq!(node(&survey, PLC).state, "in the ring");
    let mut bench = busy(0, &says);
    let survey = bench.scan(quick(RATE)).unwrap();
    assert_eq!(node(&survey, PLC).state, "looks for others, no token was heard");
    let trouble = bench.scan(patient()).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus, "{trouble}");
    assert!(trouble.came.contains("no token was heard in 10."), "{trouble}");
    assert_eq!(bench.said, 0);
}

/// Tokens have no checksum.
#[test]
fn a_token_out_of_the_noise_is_no_license_to_speak() {
    let noise = (vec![0xDC, 9, 9], Duration::from_millis(20));
    let asks = std::iter::repeat_n((slave_diag(7), Duration::from_millis(20)), 600);
    let says = std::iter::once(noise).chain(asks).collect();
    let mut bench = Bench::new().with(7, "amg11-p29").with_speaker(Speaker::new(RATE, says));
    let trouble = bench.scan(patient()).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus, "{trouble}");
    assert_eq!(bench.said, 0);
}
