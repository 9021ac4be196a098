//! Sessions of our own devices, told from first to last.

use codewheel_capture::{Assume, Condition, Decoder, Direction, Format, Output, Reader, replay};
use codewheel_station::Instant;
use codewheel_station::can::Frame;

use crate::bench::{BEGIN, Kept, Said, can0, file, pb0};
use crate::sessions;

fn told(format: Format, file: &[u8], output: Output) -> String {
    let mut reader = Reader::new(file, format);
    let mut decoder = Decoder::new(output, Assume::Nothing);
    let mut out = Vec::new();
    let complain = &mut |error: &_| panic!("{error}");
    let replayed = replay(&mut reader, &mut decoder, &mut out, complain).unwrap();
    let text = String::from_utf8(out).unwrap();
    assert_eq!(text.lines().count() as u64, replayed.records);
    text
}

fn devicenet() -> Vec<Kept> {
    let mut records = Vec::new();
    sessions::devicenet(&mut |at: Instant, frame: &Frame| {
        records.push(kept(at, Said::Frame(*frame)));
    });
    records
}

fn profibus() -> Vec<Kept> {
    let mut records = Vec::new();
    sessions::profibus(&mut |at: Instant, octets: &[u8], condition: Condition| {
        records.push(kept(at, Said::Telegram(octets.to_vec(), condition)));
    });
    records
}

fn kept(at: Instant, content: Said) -> Kept {
    Kept { at: BEGIN.at(at), bus: 0, direction: Direction::Received, content }
}

#[test]
fn a_devicenet_session_leaves_nothing_unnamed() {
    let written = file(Format::Log, vec![can0()], &devicenet());
    let text = told(Format::Log, &written, Output::Text);
    for line in text.lines() {
        assert!(!line.contains("not seen"), "{line}");
        let is_fragment = line.contains("fragment");
        assert!(is_fragment || !line.contains(": data "), "{line}");
    }
    for words in [
        "product name (01/1/7): AMG 11 - Multiturn",
        "Get_Attributes_All Identity (01/1): vendor 468, device type 0, product code 10, revision 1",
        "Get_Attributes_All Parameter (0f/5): Steps per turn 3600 step, link path size 6",
        "minimum 1 step, maximum 8192 step, default 8192 step",
        "Set_Attribute_Single Encoder Position Steps per turn (2f/1/7): 3600 step",
        "Preset value (2f/1/10): error 09h, invalid attribute value",
        "Assembly data (04/2/3): position",
        "allocation (03/1/5): choice [explicit, poll], master 10",
        "produced path (05/2/14): 20 04 24 01, Assembly, instance 1",
        "heartbeat: instance 1, state operational",
        "change of state or cyclic: position",
        "acknowledge of change of state or cyclic",
        "poll response: position",
    ] {
        assert!(text.contains(words), "nothing is told of {words}");
    }
}

#[test]
fn a_profibus_session_leaves_nothing_unnamed() {
    let written = file(Format::Pcapng, vec![pb0()], &profibus());
    let text = told(Format::Pcapng, &written, Output::Text);
    let mut broken = 0;
    for line in text.lines() {
        if line.contains("disturbed on the line") {
            broken += 1;
            continue;
        }
        assert!(!line.contains("no telegram") && !line.contains(": data "), "{line}");
        // Behind a request that was destroyed, nobody answers.
        assert!(!line.contains("not seen"), "{line}");
    }
    assert!(broken > 3, "{broken} telegrams disturbed");
    for words in [
        "Set_Prm: station status [WD_On, Freeze_Req, Sync_Req, Lock_Req], T_WD 200 ms",
        "Steps per turn 0 step",
        "[Station_Not_Ready, Prm_Fault]",
        "Data_Exchange: preset 42 step, clock 1",
        "Data_Exchange: position 42 step",
        "DH Data_Exchange: position",
        "Alarm signals [position error or preset out of range]",
        "Chk_Cfg: identifier F1h, 32 bit position and preset",
        "Global_Control: []",
        "OK FDL status: slave",
        "2 → 2  token",
    ] {
        assert!(text.contains(words), "nothing is told of {words}");
    }
}

#[test]
fn as_json_every_line_of_both_sessions_is_an_object_with_the_octets_that_went_over_the_wire() {
    let all = [
        (Format::Log, file(Format::Log, vec![can0()], &devicenet()), "frame"),
        (Format::Pcapng, file(Format::Pcapng, vec![pb0()], &profibus()), "octets"),
    ];
    for (format, written, key) in all {
        for line in told(format, &written, Output::Json).lines() {
            let object: serde_json::Value =
                serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
            assert!(object[key].is_string() && object["message"].is_string(), "{line}");
        }
    }
}

#[test]
fn all_formats_tell_the_same_session() {
    let records = devicenet();
    let one = told(Format::Log, &file(Format::Log, vec![can0()], &records), Output::Text);
    for format in [Format::Asc, Format::Trc, Format::Pcapng] {
        let other = told(format, &file(format, vec![can0()], &records), Output::Text);
        assert_eq!(other.replace(" bus1 ", " can0 "), one, "{format}");
    }
}
