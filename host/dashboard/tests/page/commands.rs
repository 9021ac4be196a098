//! Every command reaches the plant, and the state shows what it has done.

use serde_json::Value;

use crate::client::{Events, Page};

fn drive(state: &Value) -> &Value {
    &state["buses"]["line"]["devices"]["drive"]
}

fn table(state: &Value) -> &Value {
    &state["buses"]["field"]["devices"]["table"]
}

/// A plant whose masters have made both slaves ready.
fn running() -> (Page, Events) {
    let page = Page::start();
    let mut events = page.events("");
    events.until("both run", |state| {
        drive(state)["master"]["state"] == "running" && table(state)["master"]["state"] == "running"
    });
    (page, events)
}

#[test]
fn the_shaft_turns_by_to_in_a_motion_and_stops() {
    let (page, mut events) = running();
    let shaft = "line/devices/drive/shaft";
    page.done("POST", shaft, r#"{"by":100}"#);
    page.done("POST", shaft, r#"{"by":28}"#);
    events.until("128 steps on", |state| drive(state)["position"] == 128);
    events.until("the master sees it", |state| drive(state)["master"]["position"] == 128);
    page.done("POST", shaft, r#"{"to":4096}"#);
    events.until("half a turn", |state| {
        drive(state)["code"] == 4_096 && drive(state)["angle"] == 0.5
    });
    assert_eq!(drive(&events.state)["alarm"], false, "as a shaft, not as a jump");
    page.done("POST", shaft, r#"{"motion":"turn rpm=60"}"#);
    events.until("it turns", |state| {
        drive(state)["rpm"].as_f64().is_some_and(|rpm| (50.0..70.0).contains(&rpm))
    });
    assert_eq!(drive(&events.state)["shaft"]["turning"], true);
    page.done("POST", shaft, r#"{"stop":true}"#);
    events.until("it stands", |state| drive(state)["shaft"]["turning"] == false);
    let detail = page.ask("POST", shaft, r#"{"motion":"turn fast"}"#).problem(422);
    assert!(detail.contains("fast"), "{detail}");
}

#[test]
fn a_shaft_on_the_other_bus_turns_too() {
    let (page, mut events) = running();
    let before = table(&events.state)["code"].as_u64().expect("a code");
    page.done("POST", "field/devices/table/shaft", r#"{"by":100}"#);
    events.until("100 steps on", |state| table(state)["code"] == before + 100);
}

#[test]
fn the_power_goes_and_comes_and_switches_act_then() {
    let (page, mut events) = running();
    page.done("PUT", "line/devices/drive/switches", r#"{"rotary":[1,7]}"#);
    events.until("the switches stand", |state| {
        drive(state)["switches"]["now"] == serde_json::json!([1, 7])
    });
    assert_eq!(drive(&events.state)["switches"]["at_power_up"], serde_json::json!([0, 5]));
    assert_eq!(drive(&events.state)["master"]["state"], "running", "nothing has changed yet");
    page.done("PUT", "line/devices/drive/power", r#"{"on":false}"#);
    events.until("it is off", |state| {
        drive(state)["power"] == false && drive(state)["position"].is_null()
    });
    assert_eq!(drive(&events.state)["lamp"]["colour"], "off");
    page.done("PUT", "line/devices/drive/power", r#"{"on":true}"#);
    events.until("it is on, elsewhere", |state| {
        drive(state)["power"] == true
            && drive(state)["switches"]["at_power_up"] == serde_json::json!([1, 7])
    });
    page.done("PUT", "line/devices/drive/switches", r#"{"termination":true}"#);
    events.until("it is terminated", |state| drive(state)["switches"]["termination"] == true);
    page.ask("PUT", "line/devices/drive/switches", r#"{"rotary":[10,0]}"#).problem(422);
}

#[test]
fn a_fault_begins_with_its_parameters_and_ends() {
    let (page, mut events) = running();
    let faults = "line/devices/drive/faults";
    page.done("POST", faults, r#"{"kind":"jump","steps":4000}"#);
    events.until("the alarm", |state| drive(state)["alarm"] == true);
    page.done("POST", faults, r#"{"kind":"late-answers","delay":"2ms"}"#);
    let has = |state: &Value, kind: &str| {
        drive(state)["faults"].as_array().is_some_and(|all| all.iter().any(|one| one == kind))
    };
    events.until("late answers", |state| has(state, "late-answers"));
    page.done("DELETE", &format!("{faults}/late-answers"), "");
    events.until("in time again", |state| !has(state, "late-answers"));
    let detail = page.ask("POST", faults, r#"{"kind":"hiccups"}"#).problem(422);
    assert!(detail.contains("hiccups"), "{detail}");
}

#[test]
fn a_setting_is_written_refused_saved_lost_and_kept() {
    let (page, mut events) = running();
    let steps = "line/devices/drive/objects/steps-per-turn";
    page.done("PUT", steps, r#"{"value":1000}"#);
    events.until("1000 steps", |state| drive(state)["steps_per_turn"] == 1_000);
    let unsaved = |state: &Value| {
        drive(state)["memory"]["unsaved"].as_array().is_some_and(|all| !all.is_empty())
    };
    events.until("unsaved", unsaved);
    let detail = page.ask("PUT", steps, r#"{"value":8193}"#).problem(422);
    assert!(detail.contains("8192"), "what is allowed: {detail}");
    page.ask("PUT", "line/devices/drive/objects/nothing", r#"{"value":1}"#).problem(404);
    page.done("PUT", "line/devices/drive/objects/direction", r#"{"value":"CCW"}"#);
    events.until("it counts the other way", |state| drive(state)["direction"] == "CCW");

    page.done("POST", "line/devices/drive/restore", "{}");
    events.until("as it was kept", |state| {
        drive(state)["steps_per_turn"] == 8_192 && drive(state)["direction"] == "CW"
    });
    page.done("PUT", steps, r#"{"value":1000}"#);
    page.done("POST", "line/devices/drive/save", "{}");
    events.until("saved", |state| {
        drive(state)["steps_per_turn"] == 1_000
            && !unsaved(state)
            && drive(state)["memory"]["writes"] == 1
    });
    page.done("POST", "line/devices/drive/reset", "{}");
    events.until("as it was delivered", |state| drive(state)["steps_per_turn"] == 8_192);
    page.done("PUT", "line/devices/drive/power", r#"{"on":false}"#);
    page.done("PUT", "line/devices/drive/power", r#"{"on":true}"#);
    events.until("as it was saved", |state| drive(state)["steps_per_turn"] == 1_000);
}

#[test]
fn a_preset_makes_the_position_what_it_says_on_both_buses() {
    let (page, mut events) = running();
    page.done("POST", "line/devices/drive/preset", r#"{"value":4711}"#);
    events.until("on DeviceNet", |state| drive(state)["position"] == 4_711);
    page.done("POST", "field/devices/table/preset", r#"{"value":815}"#);
    events.until("on PROFIBUS", |state| table(state)["position"] == 815);
    page.ask("POST", "line/devices/drive/preset", r#"{"value":4294967295}"#).problem(422);
}

#[test]
fn a_setting_of_a_slave_goes_through_its_master() {
    let (page, mut events) = running();
    let objects = "field/devices/table/objects";
    let steps = format!("{objects}/steps-per-turn");
    let detail = page.ask("PUT", &steps, r#"{"value":3600}"#).problem(422);
    assert!(detail.contains("3600 × 65536 = 235929600"), "why the slave would refuse: {detail}");
    page.done("PUT", &format!("{objects}/total-resolution"), r#"{"value":14745600}"#);
    page.done("PUT", &steps, r#"{"value":3600}"#);
    events.until("3600 steps, and it runs again", |state| {
        table(state)["steps_per_turn"] == 3_600 && table(state)["master"]["state"] == "running"
    });
}
