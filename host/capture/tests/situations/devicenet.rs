//! What is told of DeviceNet frames.

use codewheel_capture::{Assume, Output};

use crate::bench::{Telling, can0};

/// Frames and what is told of them.
#[track_caller]
fn told(telling: &mut Telling, lines: &[(&str, &str)]) {
    for (frame, expected) in lines {
        assert_eq!(telling.frame(frame), *expected, "{frame}");
    }
}

#[test]
fn identifiers_are_named_by_group_and_message() {
    told(
        &mut Telling::devicenet(),
        &[
            (
                "42F#00D401D2040000",
                "5  duplicate MAC ID check request: vendor 468, serial number 1234",
            ),
            (
                "42F#80D401D2040000",
                "5  duplicate MAC ID check response: vendor 468, serial number 1234",
            ),
            ("42F#00D4", "5  duplicate MAC ID check: data 00 D4 – too short"),
            ("42D#", "→ 5  poll command"),
            ("3C5#00100000", "5  poll response: position 4096 step"),
            ("3C5#0010000003", "5  poll response: position 4096 step, flags [alarm, warning]"),
            ("3C5#", "5  poll response, or acknowledge of a change of state"),
            ("345#00100000", "5  change of state or cyclic: position 4096 step"),
            ("42A#", "→ 5  acknowledge of change of state or cyclic"),
            ("300#01", "0  multicast poll response: data 01"),
            ("380#01", "0  bit-strobe response: data 01"),
            ("400#FF", "0  bit-strobe command: data FF"),
            ("401#", "0  multicast poll command"),
            ("0C5#AA", "5  group 1 message: 3, data AA"),
            ("745#0A0E0101", "5  unconnected response (UCMM): data 0A 0E 01 01"),
            ("7EF#01", "off-line ownership request: data 01"),
            ("7F5#01", "no DeviceNet: an invalid identifier: data 01"),
            ("00012345#AB", "no DeviceNet: an extended identifier"),
            ("42D#R4", "no DeviceNet: a remote frame"),
        ],
    );
}

#[test]
fn an_allocation_names_its_choices_and_why_it_is_refused() {
    told(
        &mut Telling::devicenet(),
        &[
            (
                "42E#0A4B0301130A",
                "10 → 5  unconnected request Allocate_Master/Slave_Connection_Set DeviceNet (03/1): \
                 choice [explicit, poll, change of state], master 10",
            ),
            (
                "42B#0ACB00",
                "5 → 10  explicit response Allocate_Master/Slave_Connection_Set DeviceNet (03/1): \
                 body format 8/8",
            ),
            (
                "42E#0B4B0301800B",
                "11 → 5  unconnected request Allocate_Master/Slave_Connection_Set DeviceNet (03/1): \
                 choice [bit 7], master 11",
            ),
            (
                "42B#0B940C01",
                "5 → 11  explicit response Allocate_Master/Slave_Connection_Set DeviceNet (03/1): \
                 error 0Ch, object state conflict, additional code 01h – another master owns the \
                 connection set",
            ),
            (
                "42E#0A4C030102",
                "10 → 5  unconnected request Release_Master/Slave_Connection_Set DeviceNet (03/1): \
                 choice [poll]",
            ),
            (
                "42B#0ACC",
                "5 → 10  explicit response Release_Master/Slave_Connection_Set DeviceNet (03/1)",
            ),
        ],
    );
}

#[test]
fn a_response_is_told_with_the_attribute_that_its_request_named() {
    told(
        &mut Telling::devicenet(),
        &[
            (
                "42C#0A0E2F0103",
                "10 → 5  explicit request Get_Attribute_Single Encoder Position Sense of rotation \
                 (2f/1/3)",
            ),
            (
                "42B#0A8E01",
                "5 → 10  explicit response Get_Attribute_Single Encoder Position Sense of rotation \
                 (2f/1/3): CCW",
            ),
            (
                "42C#4A0E2F010C",
                "10 → 5  explicit request Get_Attribute_Single Encoder Position Position value (2f/1/12)",
            ),
            (
                "42B#4A8E00100000",
                "5 → 10  explicit response Get_Attribute_Single Encoder Position Position value (2f/1/12): 4096 step",
            ),
            (
                "42C#0A0E0F0501",
                "10 → 5  explicit request Get_Attribute_Single Parameter Steps per turn (0f/5/1)",
            ),
            (
                "42B#0A8E00200000",
                "5 → 10  explicit response Get_Attribute_Single Parameter Steps per turn (0f/5/1): 8192 step",
            ),
            (
                "42C#4A10050209C800",
                "10 → 5  explicit request Set_Attribute_Single Connection expected packet rate (05/2/9): 200 ms",
            ),
            (
                "42B#4A9409FF",
                "5 → 10  explicit response Set_Attribute_Single Connection expected packet rate (05/2/9): error 09h, invalid attribute value",
            ),
            (
                "42C#0A0E050401",
                "10 → 5  explicit request Get_Attribute_Single Connection state (05/4/1)",
            ),
            (
                "42B#0A8E04",
                "5 → 10  explicit response Get_Attribute_Single Connection state (05/4/1): timed out",
            ),
            (
                "42C#4A0E2F015A",
                "10 → 5  explicit request Get_Attribute_Single Encoder Position (2f/1/90)",
            ),
            (
                "42B#4A9414FF",
                "5 → 10  explicit response Get_Attribute_Single Encoder Position (2f/1/90): error 14h, attribute not supported",
            ),
            ("42C#0A162F01", "10 → 5  explicit request Save Encoder Position (2f/1)"),
            ("42B#0A96", "5 → 10  explicit response Save Encoder Position (2f/1)"),
            ("42C#0A330501", "10 → 5  explicit request service 33h Connection (05/1)"),
            (
                "42B#05CD010003000200",
                "5  heartbeat: instance 1, state operational, flags [], configuration consistency value 2",
            ),
        ],
    );
}

#[test]
fn fragments_of_two_masters_that_interleave_are_put_together_apart() {
    told(
        &mut Telling::devicenet(),
        &[
            (
                "42C#8A00102F0107100E",
                "10 → 5  explicit request first fragment 0: data 10 2F 01 07 10 0E",
            ),
            (
                "42C#8B00102F01080020",
                "11 → 5  explicit request first fragment 0: data 10 2F 01 08 00 20",
            ),
            ("42B#8AC000", "5 → 10  explicit response acknowledge of fragment 0"),
            ("42B#8BC000", "5 → 11  explicit response acknowledge of fragment 0"),
            (
                "42C#8A810000",
                "10 → 5  explicit request last fragment 1 Set_Attribute_Single Encoder Position Steps per turn (2f/1/7): 3600 step",
            ),
            (
                "42C#8B810000",
                "11 → 5  explicit request last fragment 1 Set_Attribute_Single Encoder Position Total resolution (2f/1/8): 8192 step",
            ),
            ("42B#8AC100", "5 → 10  explicit response acknowledge of fragment 1"),
            (
                "42B#0B940EFF",
                "5 → 11  explicit response Set_Attribute_Single Encoder Position Total resolution (2f/1/8): error 0Eh, attribute not settable",
            ),
            (
                "42B#0A90",
                "5 → 10  explicit response Set_Attribute_Single Encoder Position Steps per turn (2f/1/7)",
            ),
        ],
    );
}

#[test]
fn a_repeated_fragment_is_not_appended_and_a_lost_one_ends_the_message() {
    told(
        &mut Telling::devicenet(),
        &[
            (
                "42C#8A00102F0107100E",
                "10 → 5  explicit request first fragment 0: data 10 2F 01 07 10 0E",
            ),
            (
                "42C#8A00102F0107100E",
                "10 → 5  explicit request first fragment 0: data 10 2F 01 07 10 0E",
            ),
            (
                "42C#8A810000",
                "10 → 5  explicit request last fragment 1 Set_Attribute_Single Encoder Position Steps per turn (2f/1/7): 3600 step",
            ),
            (
                "42C#8A00102F0107100E",
                "10 → 5  explicit request first fragment 0: data 10 2F 01 07 10 0E",
            ),
            (
                "42C#8A820000",
                "10 → 5  explicit request last fragment 2: data 00 00 – it belongs to no message that was begun",
            ),
            ("42B#8AC001", "5 → 10  explicit response acknowledge of fragment 0 – too much data"),
        ],
    );
}

#[test]
fn what_was_not_seen_is_not_guessed() {
    told(
        &mut Telling::devicenet(),
        &[
            (
                "42B#0A8E00100000",
                "5 → 10  explicit response Get_Attribute_Single: data 00 10 00 00 – its request was not seen",
            ),
            (
                "42B#0A9414FF",
                "5 → 10  explicit response: error 14h, attribute not supported – its request was not seen",
            ),
            ("42C#0A0E640107", "10 → 5  explicit request Get_Attribute_Single class (64/1/7)"),
            (
                "42B#0A8E0102",
                "5 → 10  explicit response Get_Attribute_Single class (64/1/7): data 01 02",
            ),
            (
                "42C#0A0E2F0107",
                "10 → 5  explicit request Get_Attribute_Single Encoder Position Steps per turn (2f/1/7)",
            ),
            (
                "42B#0A8E0010",
                "5 → 10  explicit response Get_Attribute_Single Encoder Position Steps per turn (2f/1/7): data 00 10",
            ),
            ("42C#", "→ 5  explicit request – empty"),
            ("42C#0A", "10 → 5  explicit request – a header and nothing else"),
            (
                "42C#0A0E",
                "10 → 5  explicit request: data 0E – no request: a service, a class and an instance are missing",
            ),
            ("3C5#001000", "5  poll response: data 00 10 00"),
        ],
    );
}

#[test]
fn a_node_of_another_vendor_has_no_position() {
    let mut telling = Telling::devicenet();
    assert_eq!(telling.frame("3C5#00100000"), "5  poll response: position 4096 step");
    telling.frame("42F#000100D2040000");
    assert_eq!(telling.frame("3C5#00100000"), "5  poll response: data 00 10 00 00");
    assert_eq!(telling.frame("3C6#00100000"), "6  poll response: position 4096 step");
    telling.frame("42C#0A0E2F010C");
    assert_eq!(
        telling.frame("42B#0A8E00100000"),
        "5 → 10  explicit response Get_Attribute_Single class (2f/1/12): data 00 10 00 00"
    );
    let mut strict = Telling::new(can0(), Output::Text, Assume::Nothing);
    assert_eq!(strict.frame("3C5#00100000"), "5  poll response: data 00 10 00 00");
    strict.frame("42F#00D401D2040000");
    assert_eq!(strict.frame("3C5#00100000"), "5  poll response: position 4096 step");
}

#[test]
fn a_node_of_another_vendor_has_no_attributes_of_ours_but_those_of_the_standard() {
    let mut telling = Telling::devicenet();
    telling.frame("42F#000100D2040000");
    told(
        &mut telling,
        &[
            (
                "42C#0A102F01070004",
                "10 → 5  explicit request Set_Attribute_Single class (2f/1/7): data 00 04",
            ),
            (
                "42B#0A9409FF",
                "5 → 10  explicit response Set_Attribute_Single class (2f/1/7): error 09h, invalid \
                 attribute value",
            ),
            ("42C#0A0E0F0101", "10 → 5  explicit request Get_Attribute_Single Parameter (0f/1/1)"),
            (
                "42B#0A8E01",
                "5 → 10  explicit response Get_Attribute_Single Parameter (0f/1/1): data 01",
            ),
            (
                "42C#0A0E0F0104",
                "10 → 5  explicit request Get_Attribute_Single Parameter descriptor (0f/1/4)",
            ),
            (
                "42B#0A8E0200",
                "5 → 10  explicit response Get_Attribute_Single Parameter descriptor (0f/1/4): 0002h",
            ),
        ],
    );
}

#[test]
fn an_additional_code_has_its_meaning_only_with_its_request() {
    told(
        &mut Telling::devicenet(),
        &[(
            "42B#0A940902",
            "5 → 10  explicit response: error 09h, invalid attribute value, additional code 02h – \
             its request was not seen",
        )],
    );
}

#[test]
fn as_json_each_line_is_an_object_with_the_keys_of_the_command_line() {
    let mut telling = Telling::new(can0(), Output::Json, Assume::Encoders);
    telling.frame("42C#0A0E2F0107");
    let line = telling.frame("42B#0A8E00200000");
    let object: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!(object["values"]["steps-per-turn"], 8192);
    assert_eq!(object["path"], "2f/1/7");
    assert_eq!(object["service"], "Get_Attribute_Single");
    assert_eq!((&object["from"], &object["to"]), (&5.into(), &10.into()));
    assert_eq!(object["frame"], "42B#0A8E00200000");
    assert_eq!(object["bus"], "can0");
    assert_eq!(object["direction"], "received");
}
