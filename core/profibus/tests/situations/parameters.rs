//! Set_Prm: lock, unlock, and everything that can be wrong with it.

use codewheel_profibus::{Event, Faults, Loss, ParameterFault, State};
use codewheel_station::Duration;

use crate::bench::{Bench, GOOD_PARAMETERS, RS, SC, telegram};

const PRM_FAULT: Faults = Faults { parameters: true, configuration: false, not_supported: false };
const NO_FAULT: Faults = Faults { parameters: false, configuration: false, not_supported: false };

#[test]
fn good_parameters_lock_the_slave() {
    let bench = Bench::parameterized();
    assert_eq!(bench.slave.master(), Some(2));
    assert_eq!(bench.slave.watchdog(), Some(Duration::from_millis(200)));
    assert_eq!(bench.toy.user.as_deref(), Some(&[0][..]));
    assert_eq!(bench.toy.events, [Event::Parameterized { master: 2 }]);
}

#[test]
fn the_shortest_form_has_no_user_parameters() {
    let bench = Bench::power_up().then_parameterized("80 00 00 00 05 9B 00");
    assert_eq!(bench.toy.user.as_deref(), Some(&[][..]));
    assert_eq!(bench.slave.watchdog(), None);
}

#[test]
fn bad_parameters_lead_back_from_every_state_and_say_why() {
    let short = ParameterFault::Short { octets: 6 };
    let factor = ParameterFault::WatchdogFactor { factors: [0, 20] };
    let ident = ParameterFault::IdentNumber { given: 0x1234, own: 0x059B };
    let octet_8 = ParameterFault::NotSupported { octet: 0x80 };
    for (octets, fault) in [
        ("B8 01 14 0B 05 9B", short),
        ("B8 00 14 0B 05 9B 03 00", factor),
        ("B8 01 14 0B 12 34 03 00", ident),
        ("B8 01 14 0B 05 9B 03 80", octet_8),
    ] {
        for mut bench in [Bench::power_up(), Bench::parameterized(), Bench::exchanging()] {
            let had_master = bench.slave.master().is_some();
            bench.toy.user = Some(Vec::new());
            bench.toy.events.clear();
            bench.asks(2, Some(61), octets, SC);
            assert_eq!(bench.slave.state(), State::WaitPrm);
            let not_supported = fault == octet_8;
            assert_eq!(bench.slave.faults(), Faults { not_supported, ..PRM_FAULT });
            assert_eq!((bench.slave.master(), bench.slave.watchdog()), (None, None));
            assert_eq!(bench.toy.user, None, "the device was told");
            let lost = had_master.then_some(Event::Lost(Loss::Parameters));
            let events: Vec<_> =
                [Event::ParametersRefused(fault)].into_iter().chain(lost).collect();
            assert_eq!(bench.toy.events, events);
        }
    }
}

#[test]
fn parameters_that_the_device_refuses_are_a_fault_as_well() {
    let mut bench = Bench::exchanging();
    bench.toy.refuses = Some(0x00);
    bench.asks(2, Some(61), GOOD_PARAMETERS, SC);
    assert_eq!((bench.slave.state(), bench.slave.faults()), (State::WaitPrm, PRM_FAULT));
    assert_eq!(bench.toy.events.last(), Some(&Event::Lost(Loss::Parameters)));
}

#[test]
fn with_the_watchdog_off_its_factors_are_not_looked_at() {
    let bench = Bench::power_up().then_parameterized("80 00 00 00 05 9B 00 00");
    assert_eq!(bench.slave.watchdog(), None);
}

#[test]
fn identical_parameters_again_demand_the_configuration_again() {
    let mut bench = Bench::exchanging();
    bench.exchanges("00 00 00 05", "00 00 12 34", &["00 00 00 05"]);
    bench.global_control(2, 0x28, 0);
    bench.asks(2, Some(61), GOOD_PARAMETERS, SC);
    assert_eq!(bench.slave.state(), State::WaitCfg);
    assert!(!bench.slave.is_in_sync_mode() && !bench.slave.is_in_freeze_mode());
    let mut bench = bench.then_configured("F1");
    bench.asks(2, Some(57), "", &telegram(2, 7, 0x08, Some((62, 57)), "00 00 00 00"));
}

#[test]
fn unlock_lets_go_of_the_slave_whatever_else_it_says() {
    for status in ["40", "C0"] {
        for mut bench in [Bench::parameterized(), Bench::exchanging()] {
            bench.asks(2, Some(61), &format!("{status} 00 00 64 12 34 00 FF"), SC);
            assert_eq!((bench.slave.state(), bench.slave.master()), (State::WaitPrm, None));
            assert_eq!(bench.slave.faults(), NO_FAULT);
            assert_eq!(bench.slave.station_delay(), 11, "not taken");
            assert_eq!(bench.toy.events.last(), Some(&Event::Lost(Loss::Unlocked)));
            assert_eq!(bench.diagnosis(), "02 05 00 FF 05 9B 02 00");
        }
    }
}

#[test]
fn unlock_of_a_free_slave_clears_its_faults_and_nothing_else() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(61), "80 00 00 00 12 34 00", SC);
    assert_eq!(bench.slave.faults(), PRM_FAULT);
    bench.toy.events.clear();
    bench.asks(2, Some(61), "40 00 00 00 12 34 00", SC);
    assert_eq!((bench.slave.faults(), bench.slave.state()), (NO_FAULT, State::WaitPrm));
    assert_eq!(bench.toy.events, []);
}

#[test]
fn without_lock_and_unlock_only_the_station_delay_is_taken() {
    for mut bench in [Bench::power_up(), Bench::parameterized(), Bench::exchanging()] {
        let (state, master) = (bench.slave.state(), bench.slave.master());
        let (faults, watchdog) = (bench.slave.faults(), bench.slave.watchdog());
        bench.toy.user = None;
        bench.asks(2, Some(61), "38 00 00 64 12 34 FF FF", SC);
        assert_eq!(bench.slave.station_delay(), 100);
        bench.asks(2, Some(61), "00 00 00 00 12 34 FF FF", SC);
        assert_eq!(bench.slave.station_delay(), 100, "0 keeps it");
        assert_eq!((bench.slave.state(), bench.slave.master()), (state, master));
        assert_eq!((bench.slave.faults(), bench.slave.watchdog()), (faults, watchdog));
        assert_eq!(bench.toy.user, None, "the device is not asked");
    }
}

#[test]
fn faults_outlast_a_set_prm_that_only_changes_the_station_delay() {
    let mut bench = Bench::power_up();
    bench.asks(2, Some(61), "80 00 00 00 12 34 00", SC);
    bench.asks(2, Some(61), "00 00 00 14 12 34 00", SC);
    assert_eq!(bench.slave.faults(), PRM_FAULT);
    bench.asks(2, Some(62), "F1", SC);
}

#[test]
fn reserved_bits_are_ignored_and_noticed() {
    let bench = Bench::power_up().then_parameterized("87 00 00 00 05 9B 00 1B");
    assert_eq!(
        bench.toy.events,
        [
            Event::Parameterized { master: 2 },
            Event::ReservedStationStatus { bits: 7 },
            Event::ReservedOperating { bits: 0x18 }
        ]
    );
}

#[test]
fn a_stranger_can_neither_parameterize_nor_unlock_nor_configure() {
    for mut bench in [Bench::parameterized(), Bench::exchanging()] {
        let before = (bench.slave.state(), bench.slave.watchdog(), bench.slave.station_delay());
        let refused = RS.replace("02 07 03 0C", "03 07 03 0D");
        bench.toy.events.clear();
        for octets in [GOOD_PARAMETERS, "40 0 0 0 5 9B 0", "00 0 0 64 5 9B 0", ""] {
            bench.asks(3, Some(61), octets, &refused);
        }
        bench.asks(3, Some(62), "F0", &refused);
        assert_eq!(bench.toy.events, [Event::Stranger { master: 3 }; 5]);
        let after = (bench.slave.state(), bench.slave.watchdog(), bench.slave.station_delay());
        assert_eq!((before, bench.slave.master()), (after, Some(2)));
    }
}

#[test]
fn not_supported_shows_beside_another_fault() {
    for set_prm in ["80 00 00 00 12 34 00 80", "88 00 01 00 05 9B 00 80"] {
        let mut bench = Bench::power_up();
        bench.asks(2, Some(61), set_prm, SC);
        assert!(bench.diagnosis().starts_with("52"), "{set_prm}: {}", bench.diagnosis());
    }
}

#[test]
fn without_lock_and_unlock_the_owner_changes_the_station_delay_alone() {
    let mut bench = Bench::exchanging();
    bench.global_control(2, 0x28, 0);
    bench.asks(2, Some(61), "38 00 00 64 FF FF FF E0", SC);
    assert_eq!(bench.slave.station_delay(), 100);
    assert!(bench.slave.is_in_sync_mode() && bench.slave.is_in_freeze_mode());
    assert_eq!(bench.slave.watchdog(), Some(Duration::from_millis(200)));
    assert_eq!(bench.diagnosis(), "00 3C 00 02 05 9B 02 00");
}
