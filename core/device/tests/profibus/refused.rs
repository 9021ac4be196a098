//! Parameters and configurations that are refused, and how a person learns why (profibus clause 2).

use codewheel_profibus::State;

use crate::bench::{Bench, EXAMPLE, STANDARD, octets_of};

/// Set_Prm as a whole, the diagnosis of it, and what is told.
#[track_caller]
fn refuses(model: &str, set_prm: &str, diagnosis: &str, told: &str) {
    let mut bench = Bench::power_up(model);
    assert_eq!(bench.asks(0x3D, &octets_of(set_prm)).as_deref(), Some("E5"), "{set_prm}");
    // The master learns of it only after the configuration, which is not looked at.
    assert_eq!(bench.asks(0x3E, &[0xF1]).as_deref(), Some("E5"), "{set_prm}");
    assert_eq!(bench.state().state, State::WaitPrm, "{set_prm}");
    let answer = bench.diagnosis();
    assert_eq!(answer[..6], octets_of(diagnosis), "{set_prm}: {answer:02X?}");
    assert_eq!(answer.len(), 57);
    let events = bench.events();
    let text = format!("parameters refused: {told}");
    let event = events.iter().find(|event| event.to_string() == text);
    assert!(event.is_some_and(|event| event.is_trouble()), "{set_prm}: {events:?}");
    // Good parameters end it.
    bench.brings_up("00", 0xD1);
}

const PRM_FAULT: &str = "42 05 00 FF 05 9B";

#[test]
fn values_beyond_their_limits_are_refused_with_the_octets_the_value_and_what_is_allowed() {
    for (model, values, told) in [
        (
            "amg11-p29",
            "00000000 00000001",
            "Set_Prm octets 10–13: steps per turn 0; 1 to 8192 are possible",
        ),
        (
            "amg11-p29",
            "00002001 20000000",
            "Set_Prm octets 10–13: steps per turn 8193 exceeds 8192",
        ),
        (
            "heag162-p18",
            "00040001 00000001",
            "Set_Prm octets 10–13: steps per turn 262145 exceeds 262144",
        ),
        (
            "amg11-p13",
            "FFFFFFFF 00000001",
            "Set_Prm octets 10–13: steps per turn 4294967295 exceeds 8192",
        ),
        (
            "amg11-p29",
            "00000E10 20000000",
            "Set_Prm octets 14–17: total resolution 536870912 exceeds 3600 × 65536 = 235929600",
        ),
        (
            "amg11-p13",
            "00000064 00000065",
            "Set_Prm octets 14–17: total resolution 101 exceeds 100 × 1 = 100",
        ),
        (
            "amg11-p29",
            "00000064 00000000",
            "Set_Prm octets 14–17: total resolution 0; 1 to 100 × 65536 = 6553600 are possible",
        ),
    ] {
        refuses(model, &[STANDARD, "0A", values].concat(), PRM_FAULT, told);
    }
}

#[test]
fn the_limits_themselves_are_accepted() {
    for (model, values) in [
        ("amg11-p29", "00000001 00000001"),
        ("amg11-p29", "00002000 20000000"),
        ("amg11-p29", "00000E10 0E100000"),
        ("amg11-p13", "00000064 00000064"),
        ("heag162-p18", "00040000 00040000"),
        ("amg11-p13", "00002000 00000001"),
    ] {
        Bench::power_up(model).running(&["0A", values].concat());
    }
}

#[test]
fn lengths_that_no_set_prm_has_are_refused() {
    let longest = [STANDARD, EXAMPLE, "0000000000000000 00"].concat();
    let octets = octets_of(&longest);
    for length in 8..=26 {
        if [9, 17, 25].contains(&length) {
            continue;
        }
        let set_prm = crate::bench::hex(&octets[..length]);
        let told = format!("Set_Prm has {length} octets: 7, 9, 17 or 25 are possible");
        refuses("amg11-p29", &set_prm, PRM_FAULT, &told);
    }
}

#[test]
fn class_2_with_scaling_needs_its_values() {
    refuses(
        "amg11-p29",
        &[STANDARD, "0A"].concat(),
        PRM_FAULT,
        "Set_Prm octets 10–17 missing: octet 9 switches on class 2 and scaling, which need them",
    );
}

#[test]
fn what_the_standard_refuses_is_told_by_the_stack() {
    refuses(
        "amg11-p29",
        "88 01 C8 0B 05 9C 00 00 00",
        PRM_FAULT,
        "Set_Prm octets 5–6: ident number 059Ch, this device is 059Bh: the master has the GSD file \
         of another device",
    );
    refuses(
        "amg11-p29",
        "88 00 C8 0B 05 9B 00 00 00",
        PRM_FAULT,
        "Set_Prm octets 2–3: watchdog factors 0 and 200; with the watchdog on both are 1 to 255",
    );
    refuses(
        "amg11-p29",
        "88 01 C8 0B 05 9B 00 80 00",
        "52 05 00 FF 05 9B",
        "Set_Prm octet 8: 80h asks for DP-V1, fail-safe or publisher; a DP-V0 slave has only bit \
         2, the watchdog base of 1 ms",
    );
}

#[test]
fn a_refused_configuration_is_a_cfg_fault_that_says_what_is_possible() {
    for (identifiers, told) in [
        (&[0x55][..], "Chk_Cfg has identifier 55h: D1h, F1h, D0h or F0h is possible"),
        (&[0xF2], "Chk_Cfg has identifier F2h: D1h, F1h, D0h or F0h is possible"),
        (&[], "Chk_Cfg has 0 identifiers: one of D1h, F1h, D0h or F0h is possible"),
        (&[0xF1, 0xF1], "Chk_Cfg has 2 identifiers: one of D1h, F1h, D0h or F0h is possible"),
    ] {
        let mut bench = Bench::power_up("amg11-p29");
        bench.parameterizes(EXAMPLE);
        assert_eq!(bench.asks(0x3E, identifiers).as_deref(), Some("E5"), "{identifiers:02X?}");
        assert_eq!(bench.status(), "060500FF059B", "{identifiers:02X?}");
        let told_now = bench.told();
        let text = format!("configuration refused: {told}");
        assert!(told_now.contains(&text), "{told_now:?}");
        bench.brings_up("00", 0xD1);
    }
}

#[test]
fn refused_parameters_change_nothing_and_the_long_diagnosis_shows_what_is_kept() {
    let mut bench = Bench::power_up("amg11-p29").running(EXAMPLE);
    bench.turn_to(8_192);
    bench.position("00000000");
    assert_eq!(bench.position("80000064"), 100);
    assert_eq!(
        bench.asks(0x3D, &octets_of(&[STANDARD, "0A 00000E10 FFFFFFFF"].concat())).as_deref(),
        Some("E5")
    );
    assert_eq!(bench.state().state, State::WaitPrm);
    let diagnosis = bench.diagnosis();
    assert_eq!(diagnosis.len(), 57);
    let offset = 100 - 3_600_i32;
    assert_eq!(diagnosis[31..35], offset.to_be_bytes());
    assert_eq!(diagnosis[39..47], octets_of("00000E10 000E1000"));
    // The same parameters as before: everything is as it was.
    bench.brings_up(EXAMPLE, 0xF1);
    assert_eq!(bench.position("00000000"), 100);
}
