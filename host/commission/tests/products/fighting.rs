//! Masters that vanish, come back, or want the same encoders; a line that is bad.

use codewheel_commission::profibus::{MasterSettings, SlaveState};
use codewheel_device::Product;
use codewheel_profibus::{Baud, State};
use codewheel_sim::rs485::Faults;
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::segment::{MASTER, Segment, Wanted, encoder, some_cycles};

const RATE: BaudRate = BaudRate::Kbit500;
const ADDRESSES: [u8; 3] = [10, 11, 12];

fn wanted() -> Vec<Wanted> {
    let settings = |address| Wanted {
        address,
        class_2: true,
        configuration: 0xF1,
        steps_per_turn: 3_600,
        total_resolution: 921_600,
    };
    ADDRESSES.map(settings).to_vec()
}

fn master(address: u8, watchdog: Option<Duration>) -> MasterSettings {
    let mut settings = MasterSettings::new(address, RATE);
    settings.highest_station_address = 8;
    settings.watchdog = watchdog;
    settings
}

fn segment() -> Segment {
    let mut segment = Segment::new();
    let product = Product::find("amg81-p29").expect("in the catalogue");
    let now = segment.wire.now();
    for address in ADDRESSES {
        let shaft = "turn rpm=60 angle=12turns";
        segment.attach_encoder(address, encoder(now, product, address, shaft, Baud::Fixed(RATE)));
    }
    segment
}

fn exchanging(segment: &mut Segment) -> bool {
    let before: Vec<_> = ADDRESSES
        .iter()
        .map(|address| segment.master().slave(*address).map_or(0, |slave| slave.answers))
        .collect();
    segment.run_till(Duration::from_secs(20), some_cycles(RATE), |segment| {
        ADDRESSES.iter().zip(&before).all(|(address, before)| {
            segment.master().slave(*address).is_some_and(|slave| {
                slave.state == SlaveState::DataExchange && slave.answers > before + 3
            })
        })
    })
}

#[test]
fn a_master_that_vanishes_leaves_free_encoders_behind_once_their_watchdogs_have_run() {
    let mut segment = segment();
    segment.attach_master(master(MASTER, Some(Duration::from_millis(100))), &wanted());
    assert!(exchanging(&mut segment));
    segment.detach_master();
    segment.run(Duration::from_millis(50));
    assert!(ADDRESSES.iter().all(|of| segment.encoder(*of).slave().master() == Some(MASTER)));
    segment.run(Duration::from_millis(100));
    for address in ADDRESSES {
        let slave = segment.encoder(address).slave();
        assert_eq!((slave.state(), slave.master()), (State::WaitPrm, None));
    }
    segment.attach_master(master(5, None), &wanted());
    assert!(exchanging(&mut segment), "another master takes them");
    assert!(ADDRESSES.iter().all(|of| segment.encoder(*of).slave().master() == Some(5)));
}

#[test]
fn a_master_that_restarts_takes_up_its_encoders_though_their_watchdogs_are_off() {
    let mut segment = segment();
    for _ in 0..3 {
        segment.attach_master(master(MASTER, None), &wanted());
        assert!(exchanging(&mut segment));
        segment.detach_master();
        segment.run(Duration::from_millis(7));
    }
}

#[test]
fn of_two_masters_that_want_the_same_encoders_each_encoder_has_one() {
    let mut segment = segment();
    segment.attach_master(master(MASTER, None), &wanted());
    segment.attach_master(master(5, None), &wanted());
    segment.run(Duration::from_secs(2));
    let owners: Vec<_> = ADDRESSES.iter().map(|of| segment.encoder(*of).slave().master()).collect();
    assert!(owners.iter().all(Option::is_some), "{owners:?}");
    for address in ADDRESSES {
        assert_eq!(segment.encoder(address).slave().state(), State::DataExchange);
    }
    segment.expect_peace();
    // The one that has them goes; after a restart of the bus the other one gets what is free.
    let first = segment.master().settings().address;
    segment.detach_master();
    assert_ne!(segment.master().settings().address, first);
}

#[test]
fn whatever_the_line_does_all_encoders_exchange_data_again_once_it_is_good() {
    for seed in 0..4_u64 {
        let mut segment = segment();
        segment.attach_master(master(MASTER, Some(Duration::from_millis(200))), &wanted());
        assert!(exchanging(&mut segment));
        let share = [0.002, 0.01, 0.05, 0.2][seed as usize];
        segment.set_faults(Faults {
            loss: share,
            corruption: share / 2.0,
            broken: share / 20.0,
            flipped: share / 20.0,
            pause: share / 20.0,
        });
        segment.run(Duration::from_secs(3));
        segment.set_faults(Faults::default());
        assert!(exchanging(&mut segment), "with {share} of everything");
        for address in ADDRESSES {
            let settings = segment.encoder(address).encoder().settings();
            assert_eq!((settings.steps_per_turn, settings.total_resolution), (3_600, 921_600));
        }
    }
}
