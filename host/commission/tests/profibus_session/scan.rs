//! Who is on the bus.

use codewheel_commission::profibus::SlaveState;
use codewheel_commission::{Kind, Owner, Role, Seat};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::{Bench, PLC, RATE, joining, node, quick};
use crate::stranger::Stranger;

#[test]
fn every_encoder_is_found_with_its_models_and_what_it_works_with() {
    let mut bench = Bench::new()
        .with(3, "amg11-p13")
        .with(5, "heag162-p18")
        .with(7, "amg81-p29")
        .with(99, "hmg11-p29");
    let survey = bench.scan(quick(RATE)).unwrap();
    let addresses: Vec<u8> = survey.nodes.iter().map(|node| node.address).collect();
    assert_eq!(addresses, [3, 5, 7, 99]);
    assert_eq!(survey.remarks, [""; 0]);
    for found in &survey.nodes {
        assert_eq!((found.role, found.owner), (Role::Slave, Some(Owner::Nobody)));
        assert_eq!(found.lamp, Some("yellow"));
        assert_eq!(found.identity.as_ref().unwrap().product_code, 0x059B);
    }
    let models = |address| {
        let identity = node(&survey, address).identity.clone().unwrap();
        identity.models.iter().map(|product| product.model).collect::<Vec<_>>()
    };
    assert_eq!(models(5), ["heag162-p18"]);
    assert_eq!(models(7), ["amg81-p29"], "the cell tells it from the others");
    assert!(models(99).contains(&"hmg11-p29") && !models(99).contains(&"amg81-p29"));
    assert_eq!(
        node(&survey, 7).state,
        "waits for parameters; CW, 8192 steps per turn, 536870912 in all"
    );
    assert_eq!(node(&survey, 7).identity.as_ref().unwrap().firmware.as_deref(), Some("1.21"));
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn after_a_scan_the_console_is_silent_again() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    bench.scan(quick(RATE)).unwrap();
    let said = bench.said;
    assert!(said > 250, "125 addresses, those without an answer twice");
    bench.run(Duration::from_secs(2));
    assert_eq!(bench.said, said);
    assert!(bench.station().master().is_none());
}

#[test]
fn a_full_segment_of_31_slaves_is_scanned() {
    let mut bench = Bench::new();
    for address in 10..41 {
        bench.attach(address, "amg11-p29", RATE);
    }
    let survey = bench.scan(quick(RATE)).unwrap();
    assert_eq!(survey.nodes.len(), 31);
    assert!(survey.nodes.iter().all(|node| node.identity.is_some()));
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn who_joins_finds_everybody_and_the_other_master_loses_no_slave() {
    let mut bench = Bench::new()
        .with(7, "amg11-p29")
        .with(8, "amg11-p13")
        .with_plc(&[7])
        .after(Duration::from_millis(500));
    let before = bench.plc().slave(7).unwrap().answers;
    let survey = bench.scan(joining(RATE)).unwrap();
    assert_eq!(node(&survey, 8).owner, Some(Owner::Nobody));
    let locked = node(&survey, 7);
    assert_eq!((locked.owner, locked.lamp), (Some(Owner::Master(PLC)), Some("green")));
    assert!(locked.state.contains("3600 steps per turn, 921600 in all"), "{}", locked.state);
    assert_eq!(node(&survey, PLC).role, Role::Master);
    bench.run(Duration::from_millis(200));
    let slave = bench.plc().slave(7).unwrap();
    assert_eq!((slave.state, slave.losses), (SlaveState::DataExchange, 0));
    assert!(slave.answers > before + 1_000);
    assert_eq!(bench.complaints, [""; 0]);
}

#[test]
fn an_address_that_somebody_has_is_not_taken() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]);
    bench.run(Duration::from_millis(500));
    let settings = codewheel_commission::profibus::ScanSettings { address: PLC, ..joining(RATE) };
    let trouble = bench.scan(settings).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus);
    assert!(trouble.came.contains("address 2 already"), "{trouble}");
    assert_eq!(bench.said, 0);
}

#[test]
fn a_slave_of_another_make_is_found_without_a_model() {
    let diagnosis = [0x02, 0x05, 0x00, 0xFF, 0x80, 0x1D];
    let mut bench = Bench::new().with_stranger(Stranger::new(20, RATE, &diagnosis));
    let survey = bench.scan(quick(RATE)).unwrap();
    let found = node(&survey, 20);
    let identity = found.identity.as_ref().unwrap();
    assert_eq!(identity.product_code, 0x801D);
    assert!(identity.models.is_empty());
    assert_eq!((found.lamp, found.state.as_str()), (None, "waits for parameters"));
}

#[test]
fn a_bus_is_scanned_at_every_rate() {
    for rate in BaudRate::ALL {
        let mut bench = Bench::at(rate).with(7, "amg11-p29").with(99, "amg11-p13");
        let survey = bench.scan(quick(rate)).unwrap();
        let addresses: Vec<u8> = survey.nodes.iter().map(|node| node.address).collect();
        assert_eq!(addresses, [7, 99], "{rate}");
        assert!(survey.nodes.iter().all(|node| node.identity.is_some()), "{rate}");
        assert_eq!(bench.complaints, [""; 0], "{rate}");
    }
}

#[test]
fn with_the_slot_time_of_a_pc_everybody_is_found_too() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let patient = codewheel_commission::profibus::ScanSettings { slot_bits: None, ..quick(RATE) };
    let survey = bench.scan(patient).unwrap();
    assert_eq!(survey.nodes.len(), 1);
    assert!(survey.nodes[0].identity.is_some());
}
