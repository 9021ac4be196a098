//! More than one master on the line.

use codewheel_commission::profibus::{Event, Master, MasterSettings, SlaveState};
use codewheel_station::rs485::{BaudRate, Input};
use codewheel_station::{Duration, Station};

use crate::bench::{Bench, octets, slave_settings};
use crate::scripted::Scripted;

const RATE: BaudRate = BaudRate::Mbit1_5;

fn master(address: u8, slave: u8) -> Master {
    let mut settings = MasterSettings::new(address, RATE);
    settings.highest_station_address = 6;
    settings.gap_wait_rotations = 2;
    Master::new(settings, vec![slave_settings(slave)]).unwrap()
}

#[test]
fn two_masters_pass_the_token_and_each_serves_its_slave() {
    let masters = vec![master(2, 7), master(4, 8)];
    let mut bench = Bench::of(RATE, masters, vec![Scripted::new(7), Scripted::new(8)]);
    bench.run(Duration::from_millis(300));
    for (master, slave) in [(0, 7), (1, 8)] {
        let master = &bench.masters[master];
        assert!(master.is_in_ring());
        assert_eq!(master.slave(slave).unwrap().state, SlaveState::DataExchange);
    }
    let before = bench.log.len();
    let answers = [0, 1].map(|m| bench.masters[m].slaves().next().unwrap().answers);
    bench.run(Duration::from_millis(20));
    let there = octets("DC 04 02");
    let back = octets("DC 02 04");
    let tokens: Vec<_> = bench.log[before..].iter().filter(|sent| sent.octets[0] == 0xDC).collect();
    assert!(tokens.len() > 20);
    for pair in tokens.windows(2) {
        assert_ne!(pair[0].octets, pair[1].octets);
        assert!(pair.iter().all(|sent| sent.octets == there || sent.octets == back));
    }
    for (master, before) in answers.into_iter().enumerate() {
        assert!(bench.masters[master].slaves().next().unwrap().answers > before + 10);
    }
}

#[test]
fn a_master_whose_neighbour_vanishes_goes_on_alone() {
    let masters = vec![master(2, 7), master(4, 8)];
    let mut bench = Bench::of(RATE, masters, vec![Scripted::new(7), Scripted::new(8)]);
    bench.run(Duration::from_millis(300));
    bench.masters.pop();
    bench.run(Duration::from_millis(50));
    let before = bench.master().slave(7).unwrap().answers;
    bench.run(Duration::from_millis(50));
    assert!(bench.master().slave(7).unwrap().answers > before + 50);
}

#[test]
fn a_master_that_hears_its_own_address_is_silent_for_a_second_and_joins_anew() {
    let mut bench = Bench::new(RATE, vec![Scripted::new(7)]);
    bench.run_bits(100);
    for _ in 0..2 {
        bench.run_bits(100);
        let now = bench.now;
        bench.master().handle(now, Input::Octets(&octets("DC 05 02")));
    }
    assert_eq!(bench.events(), [Event::AddressCollision]);
    bench.run(Duration::from_millis(990));
    assert!(bench.log.is_empty());
    bench.run(Duration::from_millis(20));
    bench.bring_up();
}
