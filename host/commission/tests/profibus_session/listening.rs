//! Before anybody speaks, and without ever speaking.

use codewheel_commission::profibus::{Console, Eavesdropper};
use codewheel_commission::{Kind, Owner, Role, Seat};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Instant, Station};
use proptest::prelude::*;

use crate::bench::{Bench, PLC, RATE, alone, node, quick};

const SETTLED: Duration = Duration::from_millis(500);

#[test]
fn a_console_listens_for_a_second_before_it_speaks() {
    let mut bench = Bench::new().with(7, "amg11-p29");
    let mut said = Vec::new();
    let mut silent_until = 0;
    codewheel_commission::profibus::scan(&mut bench, quick(RATE), &mut |progress| {
        said.push((progress.doing, progress.percent));
    })
    .unwrap();
    for (place, (doing, percent)) in said.iter().enumerate() {
        if doing == "listening" {
            silent_until = place;
            assert!(*percent <= 100);
        }
    }
    assert_eq!(said[0], ("listening".to_owned(), 0));
    assert_eq!(said[silent_until].1, 100);
    assert!(said[silent_until + 1].0.starts_with("asked address"));
    assert_eq!(said.last().unwrap().1, 100);
    // Ten rounds of a bus were listened to, and nothing was said meanwhile.
    let mut quiet = Bench::new().with(7, "amg11-p29");
    quiet.run(Duration::from_secs(5));
    assert_eq!(quiet.said, 0, "a console alone says nothing");
}

#[test]
fn where_a_master_is_heard_nothing_is_sent_and_the_survey_is_what_was_overheard() {
    let mut bench =
        Bench::new().with(7, "amg11-p29").with(8, "hmg10-p13").with_plc(&[7]).after(SETTLED);
    let survey = bench.scan(quick(RATE)).unwrap();
    assert_eq!(bench.said, 0);
    assert_eq!(node(&survey, PLC).role, Role::Master);
    let slave = node(&survey, 7);
    assert_eq!((slave.role, slave.owner), (Role::Slave, Some(Owner::Master(PLC))));
    assert!(slave.state.starts_with("exchanges data, 0."), "{}", slave.state);
    let remark = &survey.remarks[0];
    assert!(remark.contains("master 2 is on the bus") && remark.contains("--join"), "{remark}");
}

#[test]
fn no_session_takes_the_token_where_a_master_is_heard() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]).after(SETTLED);
    let trouble = bench.open(7, &alone()).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus);
    assert_eq!(
        trouble.to_string(),
        "cannot open the slave at address 7: master 2 is on the bus, and 2 exchanges data with it; \
         watch without a word, or take turns with the others: join the ring (--join)"
    );
    assert_eq!(bench.said, 0);
}

#[test]
fn an_encoder_is_watched_without_a_word_while_its_master_asks_it() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]).after(SETTLED);
    let mut ears = Eavesdropper::open(&mut bench, 7, &mut |_| {}).unwrap();
    let first = ears.sample().unwrap();
    let second = ears.sample().unwrap();
    assert!(second.at > first.at);
    assert!(second.cycle.is_some_and(|cycle| (10_000..2_000_000).contains(&cycle)));
    let heard = ears.heard().unwrap().exchange.as_ref().unwrap();
    assert_eq!((heard.master, heard.outputs.as_slice()), (PLC, &[0; 4][..]));
    assert_eq!(bench.said, 0);
    assert_eq!(second.position, bench.device(7).encoder().position());
}

#[test]
fn what_its_master_sets_is_overheard_with_whom_and_what() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]).after(SETTLED);
    let heard = bench.station().overheard().slave(7).unwrap().clone();
    let parameters = heard.parameters.unwrap();
    assert!(parameters.confirmed);
    assert_eq!((parameters.master, &parameters.octets[4..6]), (PLC, &[0x05, 0x9B][..]));
    assert_eq!(parameters.octets[11..13], [0x0E, 0x10]);
    assert_eq!(heard.configuration.unwrap().octets, [0xF1]);
    let diagnosis = heard.diagnosis.unwrap();
    assert_eq!((diagnosis.master, diagnosis.state()), (Some(PLC), "exchanges data"));
    let (address, master) = bench.station().overheard().masters().next().unwrap();
    assert_eq!(address, PLC);
    assert!(master.tokens > 10 && master.rotation.shortest > Duration::ZERO);
}

#[test]
fn nobody_can_be_watched_whom_no_master_asks() {
    let mut bench = Bench::new().with(7, "amg11-p29").with(8, "amg11-p13").with_plc(&[7]);
    bench.run(SETTLED);
    let trouble = Eavesdropper::open(&mut bench, 8, &mut |_| {}).unwrap_err();
    assert_eq!(trouble.came, "master 2 is on the bus and exchanges no data with it");
    bench.unplug_plc();
    let mut silent = Bench::new().with(7, "amg11-p29");
    let trouble = Eavesdropper::open(&mut silent, 7, &mut |_| {}).unwrap_err();
    assert_eq!((trouble.kind, trouble.came.as_str()), (Kind::Bus, "no master is on the bus"));
}

#[test]
fn a_watch_ends_with_its_master() {
    let mut bench = Bench::new().with(7, "amg11-p29").with_plc(&[7]).after(SETTLED);
    bench.unplug_after(Duration::from_millis(1_500), PLC);
    let mut ears = Eavesdropper::open(&mut bench, 7, &mut |_| {}).unwrap();
    let trouble = loop {
        match ears.sample() {
            Ok(sample) => assert!(sample.cycle.is_some()),
            Err(trouble) => break trouble,
        }
    };
    assert_eq!(trouble.kind, Kind::TimeOut);
    let trouble = Eavesdropper::open(&mut bench, 7, &mut |_| {}).unwrap_err();
    assert_eq!(trouble.came, "no master is on the bus", "what was heard before is over");
}

#[test]
fn a_bus_at_another_rate_is_called_so_and_not_spoken_to() {
    let mut bench = Bench::at(BaudRate::Kbit500);
    bench.attach(7, "amg11-p29", BaudRate::Mbit1_5);
    let mut bench = bench.with_plc_at(BaudRate::Mbit1_5, &[7]);
    let survey = bench.scan(quick(BaudRate::Kbit500)).unwrap();
    assert!(survey.nodes.is_empty(), "{survey:#?}");
    assert!(survey.remarks[0].contains("the bus runs at another rate"), "{:?}", survey.remarks);
    let trouble = bench.open(7, &alone()).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus);
    assert!(trouble.came.contains("makes a telegram at 500k"), "{trouble}");
    assert_eq!(bench.said, 0);
}

#[test]
fn on_a_silent_bus_it_is_said_what_to_look_at() {
    let trouble = Bench::new().scan(quick(RATE)).unwrap_err();
    assert_eq!(trouble.kind, Kind::Bus);
    assert!(trouble.came.contains("1.5M"), "{trouble}");
    assert!(trouble.remedy.contains("supply, wiring, termination and rate"), "{trouble}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(500) })]

    /// Octets that look like telegrams more often than chance has it.
    #[test]
    fn whatever_comes_by_a_console_without_a_voice_says_nothing(
        pieces in prop::collection::vec(
            prop_oneof![
                prop::collection::vec(any::<u8>(), 0..20),
                (any::<[u8; 3]>(), prop::collection::vec(any::<u8>(), 0..70)).prop_map(telegram),
                any::<[u8; 2]>().prop_map(|[to, from]| vec![0xDC, to, from]),
                Just(vec![0xE5]),
            ],
            0..60,
        ),
    ) {
        let mut console = Console::new(RATE);
        let mut now = Instant::ZERO;
        for piece in pieces {
            now += RATE.bits(40) + RATE.characters(piece.len() as u32);
            match piece.as_slice() {
                [] => console.handle(now, Input::BrokenCharacter),
                octets => console.handle(now, Input::Octets(octets)),
            }
            console.advance(now);
            prop_assert_eq!(console.transmit(now), None);
            prop_assert_eq!(console.deadline(), None);
        }
        let heard = console.overheard();
        prop_assert!(heard.masters().all(|(address, _)| address <= 125));
        prop_assert!(heard.slaves().all(|(address, _)| address <= 125));
    }
}

/// A sound telegram, SD1 or SD2.
fn telegram(([to, from, code], data): ([u8; 3], Vec<u8>)) -> Vec<u8> {
    let body = [&[to, from, code][..], &data].concat();
    let sum = body.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet));
    let length = body.len() as u8;
    let head = if data.is_empty() { vec![0x10] } else { vec![0x68, length, length, 0x68] };
    [head, body, vec![sum, 0x16]].concat()
}
