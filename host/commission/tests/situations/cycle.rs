//! How fast the bus goes round.

use codewheel_commission::profibus::MasterSettings;
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::Bench;
use crate::scripted::Scripted;

/// n·(33 + 143 + T_SDR + 143) + GAP (33 + 66 + T_SL) + token 33 bits: the GAP request goes
/// unanswered, and the token needs no other pause.
#[test]
fn the_cycle_lasts_as_long_as_its_bits() {
    for (rate, slot) in [(BaudRate::Kbit187_5, 100), (BaudRate::Mbit12, 1_000)] {
        for slaves in [1_u32, 2, 32] {
            let addresses = (0..slaves).map(|place| u8::try_from(place + 10).unwrap());
            let mut settings = MasterSettings::new(2, rate);
            settings.highest_station_address = 4;
            settings.token_rotation_bits = Some(100_000);
            let mut bench = Bench::with(settings, addresses.map(Scripted::new).collect());
            bench.bring_up();
            bench.run(Duration::from_millis(20));
            let bits = slaves * (33 + 143 + 11 + 143) + (33 + 66 + slot) + 33;
            let times = bench.master().cycle_times();
            // Global_Control, 33 and 143 bits, is broadcast every 50 slot times.
            let broadcasts = bits / (50 * slot) + 1;
            let (least, most) = (rate.bits(bits), rate.bits(bits + broadcasts * (33 + 143)));
            let late = Duration::from_micros(u64::from(slaves) + 3);
            assert!(times.last >= least, "{slaves} at {rate}: {} for {least}", times.last);
            assert!(times.last <= most + late, "{slaves} at {rate}: {} for {most}", times.last);
            assert!(times.shortest <= times.mean() && times.mean() <= times.longest);
            assert!(times.count > 2);
        }
    }
}

#[test]
fn thirty_two_encoders_at_12_megabit_are_polled_within_a_millisecond() {
    let slaves = (10..42).map(Scripted::new).collect();
    let mut settings = MasterSettings::new(2, BaudRate::Mbit12);
    settings.highest_station_address = 4;
    settings.token_rotation_bits = Some(100_000);
    let mut bench = Bench::with(settings, slaves);
    bench.bring_up();
    bench.run(Duration::from_millis(50));
    let times = bench.master().cycle_times();
    assert!(times.mean() <= Duration::from_millis(1), "{times:?}");
}

#[test]
fn a_slave_that_takes_its_whole_time_loses_no_answer() {
    for (rate, delay) in [(BaudRate::Kbit9_6, 60), (BaudRate::Mbit12, 800)] {
        let mut slave = Scripted::new(7);
        slave.delay_bits = delay;
        slave.extended = vec![0; 51];
        let mut bench = Bench::new(rate, vec![slave]);
        bench.bring_up();
        bench.run_bits(20_000);
        assert_eq!(bench.master().slave(7).unwrap().repetitions, 0);
        assert!(bench.master().slave(7).unwrap().answers > 5);
    }
}

#[test]
fn answers_may_come_as_their_first_octet_and_the_rest() {
    for rate in [BaudRate::Kbit9_6, BaudRate::Mbit12] {
        let mut slave = Scripted::new(7);
        slave.extended = vec![0; 51];
        let mut bench = Bench::new(rate, vec![slave]);
        bench.in_portions = true;
        bench.bring_up();
        bench.run_bits(20_000);
        assert_eq!(bench.master().slave(7).unwrap().repetitions, 0);
        assert_eq!(bench.master().slave(7).unwrap().diagnosis.unwrap().extended.len(), 51);
    }
}
