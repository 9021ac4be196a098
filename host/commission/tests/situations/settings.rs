//! Settings that cannot be.

use codewheel_commission::profibus::{
    Master, MasterSettings, NotSet, SettingsError, SlaveSettings, shortest_slot,
};
use codewheel_station::Duration;
use codewheel_station::rs485::BaudRate;

use crate::bench::slave_settings;

fn refusal(change: impl Fn(&mut MasterSettings)) -> SettingsError {
    let mut settings = MasterSettings::new(2, BaudRate::Mbit1_5);
    change(&mut settings);
    Master::new(settings, vec![]).unwrap_err()
}

#[test]
fn every_setting_out_of_range_is_refused_in_words() {
    let seconds = Duration::from_secs;
    let refused = [
        refusal(|s| s.address = 126),
        refusal(|s| s.slot_bits = Some(299)),
        refusal(|s| s.slot_bits = Some(16_384)),
        refusal(|s| s.min_station_delay = 10),
        refusal(|s| s.highest_station_address = 2),
        refusal(|s| s.highest_station_address = 127),
        refusal(|s| s.gap_wait_rotations = 0),
        refusal(|s| s.gap_wait_rotations = 101),
        refusal(|s| s.retries = 0),
        refusal(|s| s.retries = 16),
        refusal(|s| s.watchdog = Some(Duration::from_millis(9))),
        refusal(|s| s.watchdog = Some(seconds(651))),
        refusal(|s| s.token_rotation_bits = Some(255)),
        refusal(|s| s.token_rotation_bits = Some(16_777_961)),
    ];
    assert_eq!(
        refused[0].to_string(),
        "master address 126 does not exist: station addresses are 0 to 125"
    );
    assert_eq!(
        refused[1].to_string(),
        "a slot time of 299 bits is not possible at 1.5M: 300 to 16383 are"
    );
    assert_eq!(
        refused[11].to_string(),
        "a watchdog time of 651.000000 s is not possible: 10 ms to 650 s are; without one, leave \
         it out"
    );
}

#[test]
fn every_setting_at_its_limits_is_taken() {
    for (slot, delay, gap, retries, rotation, watchdog) in [
        (300, 11, 1, 1, 256, Duration::from_millis(10)),
        (16_383, 255, 100, 15, 16_777_960, Duration::from_secs(650)),
    ] {
        let settings = MasterSettings {
            address: 125,
            slot_bits: Some(slot),
            min_station_delay: delay,
            highest_station_address: 126,
            gap_wait_rotations: gap,
            retries,
            token_rotation_bits: Some(rotation),
            watchdog: Some(watchdog),
            ..MasterSettings::new(0, BaudRate::Mbit1_5)
        };
        Master::new(settings, vec![slave_settings(0)]).unwrap();
    }
    for rate in BaudRate::ALL {
        Master::new(MasterSettings::new(0, rate), vec![]).unwrap();
        assert_eq!(MasterSettings::new(0, rate).slot(), shortest_slot(rate));
    }
}

#[test]
fn slaves_that_cannot_be_are_refused() {
    let refusal = |change: &dyn Fn(&mut SlaveSettings)| {
        let mut slave = slave_settings(7);
        change(&mut slave);
        let settings = MasterSettings::new(2, BaudRate::Mbit1_5);
        Master::new(settings, vec![slave_settings(9), slave]).unwrap_err()
    };
    assert_eq!(refusal(&|s| s.address = 126), SettingsError::SlaveAddress(126));
    assert_eq!(refusal(&|s| s.address = 2), SettingsError::AddressInUse(2));
    assert_eq!(refusal(&|s| s.address = 9), SettingsError::AddressInUse(9));
    assert_eq!(
        refusal(&|s| s.user_parameters = vec![0; 238]),
        SettingsError::UserParameters { address: 7, given: 238 }
    );
    for given in [0, 245] {
        assert_eq!(
            refusal(&|s| s.configuration = vec![0; given]),
            SettingsError::Configuration { address: 7, given }
        );
    }
    assert_eq!(refusal(&|s| s.inputs = 245), SettingsError::Data { address: 7, given: 245 });
    assert_eq!(refusal(&|s| s.outputs = 245), SettingsError::Data { address: 7, given: 245 });
}

#[test]
fn outputs_of_a_wrong_length_or_for_nobody_are_refused() {
    let settings = MasterSettings::new(2, BaudRate::Mbit1_5);
    let mut master = Master::new(settings, vec![slave_settings(7)]).unwrap();
    assert_eq!(master.set_outputs(8, &[0; 4]), Err(NotSet::UnknownSlave(8)));
    let refused = master.set_outputs(7, &[1; 3]);
    assert_eq!(refused, Err(NotSet::Length { address: 7, given: 3, expected: 4 }));
    assert_eq!(master.slave(7).unwrap().outputs, [0; 4]);
}

#[test]
fn a_master_may_be_moved_to_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<Master>();
}
