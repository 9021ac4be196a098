//! Polls that are begun and ended while the explicit connection stays.

use codewheel_devicenet::scanner::{NotTaken, PollSettings, SlaveSettings, SlaveState};

use crate::scanner_bench::{Bench, Peer, mac, millis, secs};

#[test]
fn polls_are_begun_and_ended_while_the_explicit_connection_stays() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let poll = PollSettings { expected_packet_rate: 200, assembly: None };
    let before = bench.peer().asked.len();
    bench.scanner.begin_polling(mac(5), poll).unwrap();
    assert_eq!(bench.scanner.begin_polling(mac(5), poll), Err(NotTaken::Busy));
    bench.run(millis(100));
    assert_eq!((bench.state(), bench.view().input), (SlaveState::Running, &[1, 2, 3, 4][..]));
    let asked = bench.peer().asked[before..].to_vec();
    assert_eq!(asked[0], "4B03010200");
    assert_eq!(asked.last().unwrap(), "10050209C800");
    let before = bench.peer().asked.len();
    bench.scanner.end_polling(mac(5)).unwrap();
    bench.run(millis(100));
    assert_eq!(bench.peer().asked[before..], ["u4C030102"]);
    let polls = bench.peer().polls.len();
    bench.run(secs(5));
    assert_eq!((bench.state(), bench.peer().polls.len()), (SlaveState::Running, polls));
    // A second time the input of the first is none.
    bench.peer().input = None;
    bench.scanner.begin_polling(mac(5), poll).unwrap();
    bench.run(millis(100));
    assert_eq!(bench.view().input_at, None);
}

#[test]
fn a_slave_that_is_removed_while_its_polls_end_loses_both_connections() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    let poll = PollSettings { expected_packet_rate: 200, assembly: None };
    bench.scanner.begin_polling(mac(5), poll).unwrap();
    bench.run(millis(100));
    bench.scanner.end_polling(mac(5)).unwrap();
    bench.scanner.remove(mac(5));
    let before = bench.peer().asked.len();
    bench.run(millis(100));
    assert_eq!(bench.peer().asked[before..], ["u4C030102", "u4C030101"]);
}

#[test]
fn a_poll_connection_of_an_earlier_life_is_released_before_polls_begin() {
    let mut bench = Bench::running(Peer::new(5), SlaveSettings::explicit(mac(5)));
    bench.peer().rule("4B03010200", Some("940B02"));
    let poll = PollSettings { expected_packet_rate: 200, assembly: None };
    bench.scanner.begin_polling(mac(5), poll).unwrap();
    bench.run(millis(100));
    assert_eq!(bench.state(), SlaveState::Running);
    assert_eq!(bench.peer().was_asked("u4B03010300"), 1);
    assert!(bench.view().responses > 0);
}
