//! Services that are answered when the device has really done them (encoder clause 4).

use codewheel_devicenet::explicit::GeneralStatus;
use codewheel_station::Duration;

use crate::bench::Bench;

#[test]
fn while_a_service_is_pending_polls_go_on_and_requests_get_device_state_conflict() {
    let mut bench = Bench::polled();
    assert_eq!(bench.ask("16 64 01"), None);
    bench.says("42D#", &["3C5#01000000"]);
    bench.asks("0E 01 01 01", "94 10 FF");
    bench.says("42D#", &["3C5#02000000"]);
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), ["42B#0A96"]);
    bench.asks("0E 01 01 01", "8E 3412");
}

#[test]
fn a_failed_service_is_answered_with_its_refusal() {
    let mut bench = Bench::polled();
    assert_eq!(bench.ask("16 64 01"), None);
    bench.node.server.complete(Err(GeneralStatus::STORE_FAILED.into()));
    assert_eq!(bench.collect(), ["42B#0A9419FF"]);
}

#[test]
fn a_completion_without_a_pending_service_or_after_a_release_is_silent() {
    let mut bench = Bench::polled();
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), [""; 0]);
    assert_eq!(bench.ask("16 64 01"), None);
    bench.says("42E#0A4C030103", &["42B#0ACC"]);
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), [""; 0]);
}

#[test]
fn a_refused_request_and_a_completion_in_one_breath_are_both_answered() {
    let mut bench = Bench::polled();
    assert_eq!(bench.ask("16 64 01"), None);
    let get = crate::bench::frame("42C#0A0E010101");
    codewheel_station::Station::handle(
        &mut bench.node,
        bench.now,
        codewheel_station::can::Input::Frame(&get),
    );
    bench.node.server.complete(Ok(()));
    assert_eq!(bench.collect(), ["42B#0A9410FF", "42B#0A96"]);
    bench.wait(Duration::from_secs(1));
}
