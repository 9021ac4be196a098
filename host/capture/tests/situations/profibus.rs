//! What is told of PROFIBUS telegrams.

use codewheel_capture::{Assume, Condition, Output};

use crate::bench::{Telling, pb0};

#[track_caller]
fn told(telling: &mut Telling, lines: &[(&str, &str)]) {
    for (telegram, expected) in lines {
        assert_eq!(telling.telegram(telegram), *expected, "{telegram}");
    }
}

#[test]
fn a_bring_up_is_told_service_by_service() {
    told(
        &mut Telling::profibus(),
        &[
            ("68 05 05 68 87 82 6C 3C 3E EF 16", "2 → 7  SRD_low FCB 1 FCV 0 Slave_Diag"),
            (
                "68 16 16 68 87 82 5C 3D 3E B8 01 14 0B 05 9B 00 00 0A 00 00 20 00 20 00 00 00 A2 16",
                "2 → 7  SRD_low FCB 0 FCV 1 Set_Prm: station status [WD_On, Freeze_Req, Sync_Req, \
                 Lock_Req], T_WD 200 ms, min T_SDR 11 bit, ident number 059Bh, group 00h, octet 8 [], \
                 Sense of rotation CW, Class 2 functionality ON, Commissioning diagnostics OFF, \
                 Scaling function ON, Steps per turn 8192 step, Total resolution 536870912 step",
            ),
            ("E5", "7 → 2  acknowledge Set_Prm"),
            (
                "68 06 06 68 87 82 7C 3E 3E F1 F2 16",
                "2 → 7  SRD_low FCB 1 FCV 1 Chk_Cfg: identifier F1h, 32 bit position and preset",
            ),
            ("E5", "7 → 2  acknowledge Chk_Cfg: identifier F1h"),
            (
                "68 07 07 68 07 02 7D 80 00 00 2A 30 16",
                "2 → 7  SRD_high FCB 1 FCV 1 Data_Exchange: preset 42 step, clock 1",
            ),
            (
                "68 07 07 68 02 07 08 00 00 10 00 21 16",
                "7 → 2  DL Data_Exchange: position 4096 step",
            ),
        ],
    );
}

#[test]
fn a_diagnosis_is_told_octet_by_octet() {
    let mut telling = Telling::profibus();
    telling.telegram("68 05 05 68 87 82 6C 3C 3E EF 16");
    // PROFIBUS manual §7: 29 bit, slave 7, master 2, power-up.
    let said = telling.telegram(
        "68 3E 3E 68 82 87 08 3E 3C 02 05 00 FF 05 9B 33 00 0A 01 00 00 20 00 FF FF 00 00 01 00 00 \
         00 00 01 10 01 21 FF FF FF FF 00 00 00 00 00 00 00 00 00 00 20 00 20 00 00 00 2A 2A 2A 2A \
         2A 2A 2A 2A 2A 2A A1 16",
    );
    assert_eq!(
        said,
        "7 → 2  DL Slave_Diag: [Station_Not_Ready], [Prm_Req], master none, ident number 059Bh, \
         Extended diagnosis header 51 octet, Alarm signals [], Operating status [class 2 supported, \
         scaling on], Encoder type 1, Singleturn resolution 8192 step, Max. number of revolutions \
         65535, Additional alarm signals [], Supported alarm signals [position error or preset out \
         of range], Warnings [], Supported warning signals [], Profile version 0110h, Software \
         version 0121h, Hours-run counter 4294967295, Offset value 0 step, Manufacturer offset 0 \
         step, Steps per revolution 8192 step, Total resolution in steps 536870912 step, Serial \
         number **********"
    );
}

#[test]
fn tokens_status_and_refusals_are_named() {
    told(
        &mut Telling::profibus(),
        &[
            ("DC 03 02", "2 → 3  token"),
            ("10 07 02 49 52 16", "2 → 7  FDL status FCB 0 FCV 0"),
            ("10 02 07 00 09 16", "7 → 2  OK FDL status: slave"),
            ("10 03 02 49 4E 16", "2 → 3  FDL status FCB 0 FCV 0"),
            ("10 02 03 30 35 16", "3 → 2  OK FDL status: master, in the ring"),
            ("68 05 05 68 87 82 6C 37 3E EA 16", "2 → 7  SRD_low FCB 1 FCV 0 Set_Slave_Add"),
            ("10 02 07 03 0C 16", "7 → 2  RS Set_Slave_Add"),
            ("68 05 05 68 87 82 6C 30 3E E3 16", "2 → 7  SRD_low FCB 1 FCV 0 SAP: 48"),
            (
                "68 07 07 68 FF 82 46 3A 3E 22 01 62 16",
                "2 → 127  SDN_high FCB 0 FCV 0 Global_Control: [Clear_Data, Sync], group 01h",
            ),
            ("10 07 02 40 49 16", "2 → 7  request: function code 40h – a reserved function code"),
        ],
    );
}

#[test]
fn what_belongs_to_another_ident_number_is_shown_as_octets() {
    let mut telling = Telling::profibus();
    telling.telegram("68 05 05 68 87 82 6C 3C 3E EF 16");
    let said = telling.telegram("68 0D 0D 68 82 87 08 3E 3C 00 0C 00 02 12 34 02 55 36 16");
    assert_eq!(
        said,
        "7 → 2  DL Slave_Diag: [], [WD_On], master 2, ident number 1234h, extended diagnosis 02 55"
    );
    let asked = "68 07 07 68 07 02 7D 00 00 00 00 86 16";
    assert_eq!(
        telling.telegram(asked),
        "2 → 7  SRD_high FCB 1 FCV 1 Data_Exchange: outputs 00 00 00 00"
    );
    assert_eq!(
        telling.telegram("68 07 07 68 02 07 08 00 00 10 00 21 16"),
        "7 → 2  DL Data_Exchange: inputs 00 00 10 00"
    );
    let mut strict = Telling::new(pb0(), Output::Text, Assume::Nothing);
    assert_eq!(
        strict.telegram(asked),
        "2 → 7  SRD_high FCB 1 FCV 1 Data_Exchange: outputs 00 00 00 00"
    );
}

#[test]
fn an_answer_counts_only_from_the_slave_that_was_asked() {
    told(
        &mut Telling::profibus(),
        &[
            ("E5", "acknowledge – its request was not seen"),
            (
                "68 06 06 68 87 82 7C 3E 3E F1 F2 16",
                "2 → 7  SRD_low FCB 1 FCV 1 Chk_Cfg: identifier F1h, 32 bit position and preset",
            ),
            ("DC 02 02", "2 → 2  token"),
            ("E5", "acknowledge – its request was not seen"),
            (
                "68 07 07 68 07 02 7D 00 00 00 00 86 16",
                "2 → 7  SRD_high FCB 1 FCV 1 Data_Exchange: preset 0 step, clock 0",
            ),
            (
                "68 07 07 68 02 09 08 00 00 10 00 23 16",
                "9 → 2  DL: data 00 00 10 00 – its request was not seen",
            ),
        ],
    );
}

#[test]
fn an_answer_that_names_its_service_is_not_taken_for_that_of_the_request() {
    told(
        &mut Telling::profibus(),
        &[
            ("68 05 05 68 87 82 5C 3B 3E DE 16", "2 → 7  SRD_low FCB 0 FCV 1 Get_Cfg"),
            (
                "68 0B 0B 68 82 87 08 3E 3C 02 05 00 FF 05 9B 31 16",
                "7 → 2  DL Slave_Diag: [Station_Not_Ready], [Prm_Req], master none, ident number \
                 059Bh",
            ),
            ("68 05 05 68 87 82 5C 33 3E D6 16", "2 → 7  SRD_low FCB 0 FCV 1 SAP: 51"),
            ("E5", "7 → 2  acknowledge SAP: 51"),
        ],
    );
}

#[test]
fn what_is_no_telegram_says_why() {
    told(
        &mut Telling::profibus(),
        &[
            ("55 AA", "no telegram – no start delimiter"),
            (
                "68 05 06 68 87 82 6C 3C 3E EF 16",
                "no telegram – lengths that differ, or that no telegram has",
            ),
            ("68 05 05 68 87 82 6C 3C 3E EE 16", "no telegram – a wrong FCS"),
            ("68 05 05 68 87 82 6C 3C 3E EF 17", "no telegram – no end delimiter"),
            ("68 05 05 68 87", "no telegram – an incomplete telegram"),
            ("E5 E5", "no telegram – octets behind the end of a telegram"),
        ],
    );
    let mut telling = Telling::profibus();
    assert_eq!(telling.octets(&[0xE5], Condition::Broken), "disturbed on the line");
}

#[test]
fn parameters_that_no_row_names_are_shown() {
    let mut telling = Telling::profibus();
    // Octet 8 with DPV1_Enable and WD_Base_1ms, octet 9 with bit 7, reserved octets not 0.
    let head = "68 1E 1E 68 87 82 5C 3D 3E 88 02 05 0B 05 9B 00 84 83 00 00 20 00 20 00 00 00";
    let octets: Vec<u8> = format!("{head} 01 00 00 00 00 00 00 00")
        .split(' ')
        .map(|octet| u8::from_str_radix(octet, 16).unwrap())
        .collect();
    let sum = octets[4..].iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet));
    let octets = [octets.as_slice(), &[sum, 0x16]].concat();
    let said = telling.octets(&octets, Condition::Intact);
    assert!(said.contains("T_WD 10 ms"), "{said}");
    assert!(said.contains("octet 8 [WD_Base_1ms, DPV1_Enable]"), "{said}");
    assert!(said.contains("Sense of rotation CCW"), "{said}");
    assert!(said.contains("octet 9, reserved [bit 7], rest 01 00 00 00 00 00 00 00"), "{said}");
}

#[test]
fn as_json_a_diagnosis_has_the_keys_of_the_rows() {
    let mut telling = Telling::new(pb0(), Output::Json, Assume::Encoders);
    telling.telegram("68 05 05 68 87 82 6C 3C 3E EF 16");
    let line = telling.telegram(
        "68 15 15 68 82 87 08 3E 3C 08 0C 00 02 05 9B 0A 01 0B 01 00 00 20 00 FF FF 76 16",
    );
    let object: serde_json::Value = serde_json::from_str(&line).unwrap();
    let values = &object["values"];
    assert_eq!(values["alarms"][0], "position error or preset out of range", "{line}");
    assert_eq!(
        values["operating-status"],
        serde_json::json!(["CCW", "class 2 supported", "scaling on"])
    );
    assert_eq!(values["singleturn-resolution"], 8192);
    assert_eq!(values["status-1"][0], "Ext_Diag");
    assert_eq!(object["service"], "Slave_Diag");
}
