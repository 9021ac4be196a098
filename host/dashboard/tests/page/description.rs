//! What does not change while a plant runs.

use crate::client::Page;

#[test]
fn the_plant_says_what_it_is_made_of() {
    let page = Page::start();
    let plant = page.json("/api/v1/plant");
    assert_eq!(plant["name"], "test.toml");
    assert_eq!(plant["read_only"], false);
    assert_eq!(plant["version"], env!("CARGO_PKG_VERSION"));
    let line = &plant["buses"][0];
    assert_eq!((&line["id"], &line["bus"]), (&"line".into(), &"DeviceNet".into()));
    assert_eq!((&line["uri"], &line["bit_rate"]), (&"virtual:line".into(), &"500k".into()));
    assert_eq!(
        (&line["masters"][0]["id"], &line["masters"][0]["address"]),
        (&"scanner".into(), &0.into())
    );
    let drive = &line["devices"][0];
    for (member, value) in
        [("id", "drive"), ("model", "amg11-d29"), ("title", "AMG 11 D29"), ("shaft", "solid")]
    {
        assert_eq!(drive[member], value, "{member}");
    }
    assert_eq!((&drive["steps"], &drive["turns"]), (&8_192.into(), &65_536.into()));
    assert_eq!(drive["switches"]["rotary"].as_array().map(Vec::len), Some(2));
    assert_eq!(drive["switches"]["dip"].as_array().map(Vec::len), Some(3));
    let jump = drive["faults"].as_array().expect("faults").iter().find(|f| f["kind"] == "jump");
    assert_eq!(jump.expect("a jump")["parameters"][0]["name"], "steps");
    let field = &plant["buses"][1];
    assert_eq!(field["bus"], "PROFIBUS");
    assert_eq!(field["devices"][0]["model"], "amg81-p29");
}

#[test]
fn the_objects_of_both_buses_have_keys_places_and_values() {
    let page = Page::start();
    for (path, place) in [("line/devices/drive", "2Fh/1/"), ("field/devices/table", "Set_Prm")] {
        let groups = page.json(&format!("/api/v1/buses/{path}/objects"));
        let objects: Vec<_> = groups
            .as_array()
            .expect("groups")
            .iter()
            .flat_map(|group| group["objects"].as_array().expect("objects"))
            .collect();
        let steps = objects.iter().find(|object| object["key"] == "steps-per-turn");
        let steps = steps.unwrap_or_else(|| panic!("{path} has no steps per turn: {groups:#}"));
        assert_eq!(steps["value"], 8_192);
        assert_eq!(steps["range"][0], 1);
        assert_eq!(steps["editable"], true, "{steps:#}");
        assert!(steps["place"].as_str().is_some_and(|text| text.contains(place)), "{steps:#}");
        assert!(steps["help"].as_str().is_some_and(|text| !text.is_empty()), "{steps:#}");
    }
}

#[test]
fn a_name_that_nobody_has_is_not_found_and_the_names_are_told() {
    let page = Page::start();
    let detail = page.get("/api/v1/buses/nothing/devices/drive/objects").problem(404);
    assert!(detail.contains("nothing") && detail.contains("line"), "{detail}");
    let detail = page.get("/api/v1/buses/line/devices/table/objects").problem(404);
    assert!(detail.contains("table") && detail.contains("drive"), "{detail}");
}

#[test]
fn a_name_with_a_slash_is_reached_as_well() {
    let page = Page::start();
    page.json("/api/v1/buses/line/devices/spare%2F1/objects");
    let mut events = page.events("?device=line/spare/1");
    assert_eq!(events.next_of("objects")["steps-per-turn"], 8_192);
}
