//! Controllers that leave the bus.

use codewheel_devicenet::{Fault, NetworkStatus};
use codewheel_sim::can::{Either, NodeId};
use codewheel_station::Duration;
use codewheel_station::Station;
use codewheel_station::can::{BitRate, Frame, Input};

use crate::segment::Segment;

const BUS_OFF: NetworkStatus = NetworkStatus::Faulted(Fault::BusOff);

fn polled(addresses: &[u8]) -> (Segment, NodeId, Vec<NodeId>) {
    let mut segment = Segment::new(BitRate::Kbit500, 1);
    let scanner = segment.attach_scanner(addresses, Duration::from_millis(1));
    let attach = |address: &u8| segment.attach_encoder(*address, u32::from(*address));
    let encoders = addresses.iter().map(attach).collect();
    segment.run(Duration::from_secs(5));
    for address in addresses {
        assert!(segment.is_running(scanner, *address));
    }
    (segment, scanner, encoders)
}

#[test]
fn a_node_that_was_bus_off_stays_off_by_default_and_the_others_are_polled_on() {
    let (mut segment, scanner, encoders) = polled(&[5, 6]);
    segment.wire.bus_off(encoders[0], &mut |_| {});
    segment.run(Duration::from_secs(30));
    assert!(!segment.wire.is_bus_off(encoders[0]), "the controller is back");
    assert_eq!(segment.status(encoders[0]), BUS_OFF, "the node is not");
    assert_eq!(segment.encoder(encoders[0]).server().master(), None);
    assert!(!segment.is_running(scanner, 5));
    assert!(segment.is_running(scanner, 6));
    assert_eq!(segment.slave(scanner, 6).losses, 0);
}

#[test]
fn a_node_with_bus_off_interrupt_1_checks_its_address_anew_and_is_polled_again() {
    let (mut segment, scanner, encoders) = polled(&[5, 6]);
    // DeviceNet object, attribute 3.
    let now = segment.wire.now();
    if let Some(Either::Right(encoder)) = segment.wire.node_mut(encoders[0]) {
        let request = Frame::standard(0x42C, &[0x00, 0x10, 3, 1, 3, 1]);
        encoder.handle(now, Input::Frame(&request));
    }
    segment.run(Duration::from_millis(100));
    segment.wire.bus_off(encoders[0], &mut |_| {});
    assert_eq!(segment.status(encoders[0]), BUS_OFF);
    let running = |segment: &Segment| segment.is_running(scanner, 5);
    assert!(segment.run_until(Duration::from_secs(1), |segment| !running(segment)).is_some());
    assert!(segment.run_until(Duration::from_secs(15), running).is_some());
    assert_eq!(segment.slave(scanner, 6).losses, 0);
}

#[test]
fn a_bad_transceiver_takes_its_node_off_the_bus_and_no_other() {
    let (mut segment, scanner, encoders) = polled(&[5, 6]);
    segment.wire.set_corruption_at(encoders[0], Some(1.0));
    segment.run(Duration::from_secs(30));
    assert_eq!(segment.status(encoders[0]), BUS_OFF);
    assert_eq!(segment.wire.statistics().bus_offs, 1);
    assert!(segment.is_running(scanner, 6));
    assert_eq!(segment.slave(scanner, 6).losses, 0);

    // Another transceiver, and power again.
    segment.wire.detach(encoders[0]);
    segment.attach_encoder(5, 5);
    let running = |segment: &Segment| segment.is_running(scanner, 5);
    assert!(segment.run_until(Duration::from_secs(15), running).is_some());
}

#[test]
fn a_scanner_that_was_bus_off_checks_its_address_anew_and_polls_all_again() {
    let (mut segment, scanner, encoders) = polled(&[5, 6]);
    segment.wire.bus_off(scanner, &mut |_| {});
    assert_eq!(segment.scanner(scanner).faulted(), Some(Fault::BusOff));
    let running =
        |segment: &Segment| segment.is_running(scanner, 5) && segment.is_running(scanner, 6);
    assert!(segment.run_until(Duration::from_secs(15), running).is_some());
    for encoder in encoders {
        assert_eq!(segment.status(encoder), NetworkStatus::Connected);
    }
}

#[test]
fn when_the_transceiver_of_the_scanner_is_bad_nobody_stays_owned() {
    let (mut segment, scanner, encoders) = polled(&[5, 6]);
    segment.wire.set_corruption_at(scanner, Some(1.0));
    segment.run(Duration::from_secs(11));
    for encoder in encoders {
        assert_eq!(segment.encoder(encoder).server().master(), None);
        assert_eq!(segment.status(encoder), NetworkStatus::OnLine);
    }
}
