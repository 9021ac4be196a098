//! Explicit requests of the scanner's user: answered, unanswered, interrupted, fragmented.

use codewheel_devicenet::explicit::Path;
use codewheel_devicenet::scanner::{NotTaken, SlaveSettings, SlaveState};
use codewheel_station::Station;
use codewheel_station::can::Input;

use crate::bench::frame;
use crate::scanner_bench::{Bench, Peer, mac, millis, secs, seen};

/// A slave that runs, and a request to it that is on its way as `42C#00 0E640101`.
fn asking() -> (Bench, codewheel_devicenet::scanner::Ticket) {
    let mut bench = Bench::polling(Peer::new(5));
    let ticket = bench.request("0E640102").unwrap();
    assert_eq!(bench.collect().last().unwrap(), "42C#000E640102");
    (bench, ticket)
}

#[test]
fn a_request_whose_slave_is_lost_ends_without_an_answer_and_frees_the_slave() {
    let mut bench = Bench::polling(Peer::new(5));
    let ticket = bench.scanner.request(mac(5), &[0x0E, 0x64, 1, 1], secs(60)).unwrap();
    bench.peer().on = false;
    bench.run(millis(900));
    assert_eq!(bench.view().losses, 1);
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
    bench.peer().on = true;
    bench.run(secs(2));
    assert_eq!(bench.state(), SlaveState::Running);
    bench.peer().rule("0E6401", Some("8E07"));
    let ticket = bench.request("0E640101").unwrap();
    bench.run(millis(10));
    assert_eq!(bench.response(ticket).unwrap(), "07");
}

#[test]
fn an_answer_that_has_arrived_is_kept_when_the_slave_is_lost_and_found_again() {
    let mut bench = Bench::polling(Peer::new(5).answers("0E6401", "8E AA55"));
    let ticket = bench.request("0E640101").unwrap();
    bench.run(millis(10));
    bench.peer().on = false;
    bench.run(secs(2));
    assert_ne!(bench.state(), SlaveState::Running);
    bench.peer().on = true;
    bench.run(secs(2));
    assert_eq!(bench.request("0E640101"), Err(NotTaken::Busy));
    assert_eq!(bench.response(ticket).unwrap(), "AA55");
    assert!(bench.request("0E640101").is_ok());
}

#[test]
fn a_slave_that_takes_700_ms_for_an_answer_is_waited_for() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    bench.peer().rule("0E6401", None);
    let ticket =
        bench.scanner.get(mac(5), Path { class: 0x64, instance: 1, attribute: 2 }).unwrap();
    bench.run(millis(700));
    assert_eq!(bench.response(ticket), None);
    // The transaction bit is that of the request.
    let header = bench.log.last().unwrap().1[4..6].to_owned();
    bench.hears(&format!("42B#{header}8E07"));
    assert_eq!(bench.response(ticket).unwrap(), "07");
}

#[test]
fn a_cancelled_request_frees_the_slave_and_its_late_answer_is_dropped() {
    let (mut bench, ticket) = asking();
    assert!(bench.scanner.cancel(ticket));
    assert!(!bench.scanner.cancel(ticket));
    let next = bench.request("0E640103").unwrap();
    assert_eq!(bench.collect(), ["42C#400E640103"]);
    bench.says("42B#008E01", &[]);
    assert_eq!(bench.response(next), None);
    bench.says("42B#408E02", &[]);
    assert_eq!(bench.response(next).unwrap(), "02");
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
}

#[test]
fn the_acknowledge_of_the_last_fragment_survives_the_fetching_of_the_response() {
    let (mut bench, ticket) = asking();
    bench.says("42B#80 00 8E 3132333435", &["42C#80C000"]);
    bench.scanner.handle(bench.now, Input::Frame(&frame("42B#80 81 36")));
    // The user is quicker than the medium.
    assert_eq!(bench.response(ticket).unwrap(), "313233343536");
    bench.request("0E640103").unwrap();
    assert_eq!(bench.collect(), ["42C#80C100", "42C#400E640103"]);
}

#[test]
fn a_repeated_last_fragment_is_acknowledged_again_even_during_the_next_request() {
    let (mut bench, ticket) = asking();
    bench.says("42B#80 00 8E 3132333435", &["42C#80C000"]);
    bench.says("42B#80 81 36", &["42C#80C100"]);
    bench.says("42B#80 81 36", &["42C#80C100"]);
    assert_eq!(bench.response(ticket).unwrap(), "313233343536");
    bench.says("42B#80 81 36", &["42C#80C100"]);
    let next = bench.request("0E640103").unwrap();
    assert_eq!(bench.collect(), ["42C#400E640103"]);
    bench.says("42B#80 81 36", &["42C#80C100"]);
    bench.says("42B#80 82 36", &[]);
    assert_eq!(bench.response(next), None);
    bench.says("42B#408E09", &[]);
    assert_eq!(bench.response(next).unwrap(), "09");
}

#[test]
fn an_unacknowledged_request_fragment_is_repeated_after_a_second_then_given_up() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let ticket = bench.request("10 64 01 02 3132333435363738").unwrap();
    let first = bench.collect();
    assert_eq!(first.len(), 1);
    assert_eq!(bench.wait(millis(990)), [""; 0]);
    assert_eq!(bench.wait(millis(20)), first);
    assert_eq!(bench.response(ticket), None);
    // Given up after the second second; then the explicit connection is tried.
    assert_eq!(bench.wait(millis(1_010)).len(), 1);
    bench.wait(millis(1_100));
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
}

#[test]
fn the_patience_for_the_answer_begins_when_the_last_fragment_is_acknowledged() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let ticket = bench.request("10 64 01 02 3132333435363738").unwrap();
    let header = &bench.collect()[0][4..6].to_string();
    // The slave takes 0.9 s for each acknowledge, then 0.4 s for the answer.
    bench.wait(millis(900));
    bench.says(&format!("42B#{header}C000"), &[&format!("42C#{header}81333435363738")]);
    bench.wait(millis(900));
    bench.says(&format!("42B#{header}C100"), &[]);
    bench.wait(millis(400));
    let whole = u8::from_str_radix(header, 16).unwrap() & 0x7F;
    bench.says(&format!("42B#{whole:02X}90"), &[]);
    assert_eq!(bench.response(ticket).unwrap(), "");
}

#[test]
fn a_slave_that_repeats_its_fragment_for_ever_is_given_up() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let ticket = bench.request("0E640102").unwrap();
    let whole = u8::from_str_radix(&bench.collect()[0][4..6], 16).unwrap();
    let header = whole | 0x80;
    let end = bench.now + secs(8);
    let mut ended = None;
    while bench.now < end && ended.is_none() {
        bench.hears(&format!("42B#{header:02X}008E3132333435"));
        bench.wait(millis(300));
        ended = bench.response(ticket);
    }
    assert_eq!(ended.unwrap(), "no answer");
    assert!(bench.now < end);
}

#[test]
fn a_slave_that_takes_its_time_with_each_of_many_fragments_is_given_up_after_half_a_minute() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let ticket = bench.request("0E640102").unwrap();
    let header = u8::from_str_radix(&bench.collect()[0][4..6], 16).unwrap() | 0x80;
    let began = bench.now;
    let mut count = 0_u8;
    let ended = loop {
        let octet = if count == 0 { 0 } else { 0x40 | count & 0x3F };
        bench.hears(&format!("42B#{header:02X}{octet:02X}8E3132333435"));
        bench.wait(secs(2));
        count += 1;
        if let Some(ended) = bench.response(ticket) {
            break ended;
        }
        assert!(count < 20, "never given up");
    };
    assert_eq!(ended, "no answer");
    assert!(bench.now.since(began) > secs(30));
}

#[test]
fn a_response_longer_than_its_room_says_so() {
    let (mut bench, ticket) = asking();
    bench.hears("42B#80008E3132333435");
    let mut last = vec![];
    for count in 1..50_u8 {
        last = bench.hears(&format!("42B#80{:02X}313233343536", 0x40 | count & 0x3F));
        if last.first().is_some_and(|sent| sent.ends_with("01")) {
            break;
        }
    }
    assert_eq!(last, ["42C#80EA01"]);
    assert_eq!(bench.response(ticket).unwrap(), "too long");
}

#[test]
fn a_slave_that_forgot_its_explicit_connection_gets_it_anew_and_the_request_once_more() {
    let mut bench = Bench::polling(Peer::new(5).answers("0E6401", "8E07"));
    let polls = bench.view().polls;
    let ticket = bench.request("0E640101").unwrap();
    // The slave does not hear what comes without a connection.
    let mut unheard = 0;
    bench.run_with(millis(700), |_, frame| {
        let dropped = frame.starts_with("42C#") && frame.contains("0E640101") && unheard == 0;
        unheard += u32::from(dropped);
        !dropped
    });
    assert_eq!(bench.response(ticket).unwrap(), "07");
    assert_eq!(bench.state(), SlaveState::Running);
    assert!(bench.view().polls - polls > 50, "polling goes on");
    assert_eq!(bench.peer().was_asked("u4B03010100"), 1);
    // What died with the connection is asked for anew.
    assert_eq!(bench.peer().was_asked("1005010C03"), 2);
    // A second silence is not followed by a third request.
    bench.peer().rule("0E6401", None);
    let ticket = bench.request("0E640101").unwrap();
    bench.run(secs(3));
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
    assert_eq!(bench.peer().was_asked("0E640101"), 1 + 2);
}

#[test]
fn a_request_is_not_repeated_where_the_explicit_connection_lives() {
    let mut bench = Bench::polling(Peer::new(5));
    bench.peer().rule("0E6401", None);
    bench.peer().rule("4B030101", Some("94 0B 02"));
    let ticket = bench.request("0E640101").unwrap();
    bench.run(secs(2));
    assert_eq!(bench.response(ticket).unwrap(), "no answer");
    assert_eq!(bench.peer().was_asked("0E6401"), 1);
    assert_eq!(bench.state(), SlaveState::Running);
}

#[test]
fn a_slave_without_deferred_delete_has_its_explicit_connection_kept_alive_by_requests() {
    let mut bench = Bench::polling(Peer::new(5).answers("1005010C03", "94 09 FF"));
    bench.run(secs(30));
    let kept = bench.peer().was_asked("0E050101");
    assert!((11..=13).contains(&kept), "{kept} requests in 30 s");
    // Where it is lost all the same, it is allocated anew while polling goes on.
    bench.peer().rule("0E050101", None);
    bench.run(millis(7_700));
    assert_eq!(bench.state(), SlaveState::Running);
    assert!(bench.peer().was_asked("u4B03010100") >= 1);
    assert_eq!(bench.view().losses, 0);
}

#[test]
fn a_refusal_with_the_other_transaction_or_before_the_question_is_not_taken() {
    let mut bench = Bench::polling(Peer::new(5));
    let ticket = bench.request("0E640101").unwrap();
    // Nothing of the request is out yet.
    bench.scanner.handle(bench.now, Input::Frame(&frame("42B#009416FF")));
    bench.scanner.handle(bench.now, Input::Frame(&frame("42B#008E01")));
    assert_eq!(bench.response(ticket), None);
    bench.collect();
    bench.says("42B#409416FF", &[]);
    bench.says("42B#019416FF", &[]);
    assert_eq!(bench.response(ticket), None);
    bench.says("42B#009416FF", &[]);
    assert_eq!(bench.response(ticket).unwrap(), "16 object does not exist");
}

#[test]
fn a_success_cannot_come_before_the_last_fragment_of_the_request_but_a_refusal_can() {
    let mut bench = Bench::polling(Peer::new(5));
    let ticket = bench.request("10 64 01 02 3132333435363738").unwrap();
    bench.collect();
    bench.says("42B#0090", &[]);
    assert_eq!(bench.response(ticket), None);
    bench.says("42B#009413FF", &[]);
    assert_eq!(bench.response(ticket).unwrap(), "13 not enough data");
}

#[test]
fn attributes_are_read_and_written_by_their_paths() {
    let path = Path { class: 0x64, instance: 1, attribute: 2 };
    let mut bench = Bench::polling(Peer::new(5).answers("0E640102", "8E AA"));
    let ticket = bench.scanner.get(mac(5), path).unwrap();
    bench.run(millis(10));
    assert_eq!(bench.response(ticket).unwrap(), "AA");
    let ticket = bench.scanner.set(mac(5), path, &[9; 60]).unwrap();
    bench.run(millis(100));
    assert_eq!(bench.response(ticket).unwrap(), "");
    assert_eq!(bench.peer().asked.last().unwrap(), &format!("10640102{}", "09".repeat(60)));
    assert_eq!(bench.scanner.set(mac(5), path, &[9; 61]), Err(NotTaken::Length));
}

#[test]
fn a_slow_slave_is_given_the_patience_that_the_user_has() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let ticket = bench.scanner.request(mac(5), &[0x16, 0x64, 1], secs(5)).unwrap();
    let header = bench.collect()[0][4..6].to_string();
    bench.wait(millis(4_900));
    assert_eq!(bench.response(ticket), None);
    bench.says(&format!("42B#{header}96"), &[]);
    assert_eq!(bench.scanner.response(ticket, seen).unwrap(), "");
}

#[test]
fn a_request_that_the_medium_holds_back_is_not_counted_against_the_slave() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let ticket = bench.request("0E640101").unwrap();
    bench.reports = false;
    let sent = bench.collect();
    let header = sent[0][4..6].to_string();
    bench.wait(millis(900));
    // Only now it got through arbitration.
    bench.scanner.handle(bench.now, Input::Sent(&frame(&sent[0])));
    bench.wait(millis(400));
    bench.says(&format!("42B#{header}8E05"), &[]);
    assert_eq!(bench.response(ticket).unwrap(), "05");
}

#[test]
fn a_fragment_that_the_medium_holds_back_is_not_repeated_too_early() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    bench.request("10 64 01 02 3132333435363738").unwrap();
    bench.reports = false;
    let sent = bench.collect();
    bench.wait(millis(900));
    bench.scanner.handle(bench.now, Input::Sent(&frame(&sent[0])));
    assert_eq!(bench.wait(millis(990)), [""; 0]);
    assert_eq!(bench.wait(millis(20)), sent);
}
