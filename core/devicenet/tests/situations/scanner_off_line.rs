//! The scanner leaves the bus, and comes back.

use codewheel_devicenet::Fault;
use codewheel_devicenet::scanner::{NotTaken, Probing, ScanProgress, SlaveState};
use codewheel_station::Station;
use codewheel_station::can::Input;

use crate::scanner_bench::{Bench, Peer, millis, secs};

#[test]
fn a_bus_off_ends_all_requests_and_the_scanner_begins_again_when_the_controller_recovers() {
    let mut bench = Bench::polling(Peer::new(5).answers("0E6401", "8E07"));
    let ticket = bench.request("0E640101").unwrap();
    bench.scanner.scan(bench.now, Probing::Gentle).unwrap();
    bench.scanner.handle(bench.now, Input::BusOff);
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.scanner.faulted(), Some(Fault::BusOff));
    assert_eq!(bench.scanner.deadline(), None);
    assert_eq!(bench.state(), SlaveState::Absent);
    assert_eq!(bench.scanner.live_list().progress, ScanProgress::Aborted);
    assert_eq!(bench.request("0E640101"), Err(NotTaken::OffLine));
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
    bench.run(secs(5));
    bench.log.clear();
    bench.scanner.handle(bench.now, Input::Recovered);
    bench.run(millis(2_500));
    assert_eq!(bench.log[0].1, "407#00010063000000");
    assert_eq!(bench.log[1].1, "407#00010063000000");
    assert_eq!(bench.log[1].0.since(bench.log[0].0), secs(1));
    assert_eq!(bench.log[2].1, "42E#404B03010300");
    assert_eq!(bench.state(), SlaveState::Running);
    let ticket = bench.request("0E640101").unwrap();
    bench.run(millis(10));
    assert_eq!(bench.response(ticket).unwrap(), "07");
}

#[test]
fn an_answer_that_has_arrived_survives_a_bus_off() {
    let mut bench = Bench::polling(Peer::new(5).answers("0E6401", "8E07"));
    let ticket = bench.request("0E640101").unwrap();
    bench.run(millis(10));
    bench.scanner.handle(bench.now, Input::BusOff);
    assert_eq!(bench.response(ticket).unwrap(), "07");
}

#[test]
fn a_scanner_whose_mac_id_another_node_has_stays_silent_until_it_is_restarted() {
    let mut bench = Bench::polling(Peer::new(5));
    let ticket = bench.request("0E640101").unwrap();
    bench.says("407#80010063000001", &[]);
    assert_eq!(bench.scanner.faulted(), Some(Fault::DuplicateMac));
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
    assert_eq!(bench.scanner.deadline(), None);
    // Not even a bus-off brings it back.
    bench.scanner.handle(bench.now, Input::BusOff);
    bench.scanner.handle(bench.now, Input::Recovered);
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.scanner.faulted(), Some(Fault::DuplicateMac));
    bench.scanner.restart();
    bench.run(millis(2_500));
    assert_eq!(bench.state(), SlaveState::Running);
}

#[test]
fn a_recovery_without_a_bus_off_changes_nothing() {
    let mut bench = Bench::polling(Peer::new(5));
    bench.scanner.handle(bench.now, Input::Recovered);
    assert_eq!(bench.state(), SlaveState::Running);
    bench.run(millis(100));
    assert_eq!(bench.view().losses, 0);
}

#[test]
fn a_bus_off_while_the_mac_id_is_checked_begins_the_check_anew() {
    let mut bench = Bench::new(&[Peer::new(5)], &[]);
    bench.run(millis(500));
    bench.scanner.handle(bench.now, Input::BusOff);
    bench.run(secs(3));
    assert!(!bench.scanner.is_on_line());
    bench.scanner.handle(bench.now, Input::Recovered);
    bench.run(millis(1_990));
    assert!(!bench.scanner.is_on_line());
    bench.run(millis(20));
    assert!(bench.scanner.is_on_line());
}
