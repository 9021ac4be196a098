//! The events, as they happen.

use std::time::{Duration, Instant};

use serde_json::Value;

use crate::client::Page;

#[test]
fn the_first_state_is_whole_and_patches_make_every_later_one_of_it() {
    let page = Page::start();
    let mut events = page.events("");
    let (name, first) = events.next();
    assert_eq!(name, "state");
    for (bus, device) in [("line", "drive"), ("line", "spare/1"), ("field", "table")] {
        assert!(first["buses"][bus]["devices"][device].is_object(), "{first:#}");
    }
    assert!(first["buses"]["line"]["masters"]["scanner"].is_object());
    page.done("POST", "line/devices/drive/shaft", r#"{"motion":"turn rpm=60"}"#);
    page.done("PUT", "line/devices/spare%2F1/power", r#"{"on":false}"#);
    for _ in 0..20 {
        let patch = events.next_of("state");
        assert!(patch["at"].is_number(), "{patch}");
    }
    page.done("POST", "line/devices/drive/shaft", r#"{"stop":true}"#);
    events.until("the power is off", |state| {
        state["buses"]["line"]["devices"]["spare/1"]["power"] == false
    });
    // A stand-still: whoever comes now sees what the patches have made.
    events.until("it stands", |state| {
        let drive = &state["buses"]["line"]["devices"]["drive"];
        drive["velocity"] == 0 && drive["shaft"]["turning"] == false
    });
    let mut late = page.events("");
    late.next_of("state");
    for (bus, device) in [("line", "drive"), ("line", "spare/1"), ("field", "table")] {
        for part in ["power", "position", "code", "steps_per_turn", "lamp", "switches", "shaft"] {
            let (ours, theirs) =
                (&events.device(bus, device)[part], &late.device(bus, device)[part]);
            assert_eq!(without_nulls(ours), without_nulls(theirs), "{part} of {device}");
        }
    }
}

fn without_nulls(value: &Value) -> Value {
    match value {
        Value::Object(members) => members
            .iter()
            .filter(|(_, value)| !value.is_null())
            .map(|(name, value)| (name.clone(), without_nulls(value)))
            .collect(),
        other => other.clone(),
    }
}

#[test]
fn what_happened_before_comes_at_once_and_what_happens_then_one_by_one() {
    let page = Page::start();
    let mut events = page.events("");
    events.next_of("reports");
    page.done("POST", "line/devices/drive/faults", r#"{"kind":"stuck"}"#);
    let is_it = |report: &Value| {
        report["bus"] == "line"
            && report["device"] == "drive"
            && report["text"] == "fault: the sensor is stuck"
            && report["trouble"] == true
    };
    while !is_it(&events.next_of("report")) {}
    let before = page.events("").next_of("reports");
    assert!(before.as_array().expect("reports").iter().any(is_it), "{before:#}");
}

#[test]
fn nothing_that_happens_is_told_twice_however_readers_come_and_go() {
    let page = Page::start();
    for _ in 0..3 {
        page.events("").next_of("reports");
        page.done("POST", "line/devices/drive/faults", r#"{"kind":"jump","steps":1}"#);
    }
    let mut events = page.events("");
    let mut told = events.next_of("reports").as_array().expect("reports").clone();
    let jumps = |told: &[Value]| {
        told.iter().filter(|report| report["text"] == "fault: the code jumps by 1 steps").count()
    };
    while jumps(&told) < 3 {
        told.push(events.next_of("report"));
    }
    for _ in 0..5 {
        let (name, data) = events.next();
        if name == "report" {
            told.push(data);
        }
    }
    assert_eq!(jumps(&told), 3, "{told:#?}");
}

#[test]
fn the_objects_of_one_device_come_whole_and_then_as_they_change() {
    let page = Page::start();
    let mut events = page.events("?device=line/drive");
    let first = events.next_of("objects");
    assert_eq!(first["steps-per-turn"], 8_192);
    page.done("PUT", "line/devices/drive/objects/steps-per-turn", r#"{"value":1000}"#);
    loop {
        let changed = events.next_of("objects");
        if changed["steps-per-turn"] == 1_000 {
            assert!(changed.as_object().is_some_and(|all| all.len() < 10), "{changed}");
            break;
        }
    }
}

#[test]
fn a_trace_shows_what_the_bus_carries() {
    let page = Page::start();
    let mut events = page.events("?trace=line");
    loop {
        let trace = events.next_of("trace");
        let lines = trace["lines"].as_array().expect("lines");
        if let Some(line) = lines.iter().find(|line| line["name"] == "poll response") {
            assert_eq!(line["from"], "5");
            assert_eq!(line["identifier"], "3C5");
            assert_eq!(line["octets"], "00 00 00 00");
            assert!(line["at"].is_number() && line["text"].is_string());
            break;
        }
    }
}

#[test]
fn a_slower_rate_brings_fewer_patches_and_leaves_nothing_out() {
    let page = Page::start();
    page.done("POST", "line/devices/drive/shaft", r#"{"motion":"turn rpm=60"}"#);
    let mut slow = page.events("?rate=2");
    slow.next_of("state");
    let first = slow.next_of("state")["at"].as_f64().expect("a moment");
    let then = slow.next_of("state")["at"].as_f64().expect("a moment");
    assert!((0.4..3.0).contains(&(then - first)), "{first} … {then}");
    let steps = "line/devices/drive/objects/steps-per-turn";
    for value in [1_000, 2_000, 3_000] {
        page.done("PUT", steps, &format!(r#"{{"value":{value}}}"#));
        slow.until("the new steps", |state| {
            state["buses"]["line"]["devices"]["drive"]["steps_per_turn"] == value
        });
    }
}

#[test]
fn no_stream_gets_more_than_20_states_a_second() {
    let page = Page::start();
    page.done("POST", "line/devices/drive/shaft", r#"{"motion":"turn rpm=60"}"#);
    let mut events = page.events("");
    events.next_of("state");
    let first = events.next_of("state")["at"].as_f64().expect("a moment");
    for _ in 0..39 {
        events.next_of("state");
    }
    let last = events.next_of("state")["at"].as_f64().expect("a moment");
    assert!(last - first >= 1.95, "40 states in {} s", last - first);
}

#[test]
fn a_page_that_closes_lets_go_of_its_plant_even_while_somebody_watches() {
    let page = Page::start();
    let mut events = page.events("?device=line/drive&trace=line");
    events.next_of("state");
    let begin = Instant::now();
    let running = page.close();
    assert!(begin.elapsed() < Duration::from_secs(5));
    let (_, ended) = running.stop();
    ended.expect("no bus was lost");
}
