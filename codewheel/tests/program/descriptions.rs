//! `codewheel describe`: one description as text, Markdown and JSON.

use serde_json::Value;

use crate::prompt::{codewheel, printed, stderr};

fn json(model: &str) -> Value {
    serde_json::from_str(&printed(&["describe", model, "--json"])).expect("JSON")
}

#[test]
fn programs_get_numbers_under_names() {
    let amg = json("amg11-d29");
    assert_eq!(amg["model"], "amg11-d29");
    assert_eq!(amg["product"]["turns"], 65_536);
    assert_eq!(amg["product"]["product-code"], 0x0A);
    assert_eq!(amg["product"]["lithium-cell"], false);
    assert_eq!(amg["services"][4]["service"], "16h");
    let attributes = amg["attributes"].as_array().expect("rows");
    let total = attributes.iter().find(|row| row["attribute"] == 8).expect("attribute 8");
    assert_eq!(total["key"], "total-resolution");
    assert_eq!(total["default"], 536_870_912);
    assert_eq!(total["range"]["maximum"], 536_870_912);

    let heag = json("heag162-p18");
    assert_eq!(heag["product"]["ident-number"], 0x059B);
    assert_eq!(heag["parameters"][4]["range"]["maximum"], 262_144);
    assert_eq!(heag["configurations"][1]["identifier"], 0xF1);
    assert!(heag["ssi"].is_object() && amg["ssi"].is_null());
}

/// What stands in the cells for people must be the same whatever it is shown as.
#[test]
fn text_and_markdown_say_the_same_as_json() {
    for model in ["amg81-d29", "hmg10-p13", "heag162-p29"] {
        let (text, markdown) =
            (printed(&["describe", model]), printed(&["describe", model, "--markdown"]));
        let mut count = 0;
        let mut look = |value: &Value| {
            let Value::String(sentence) = value else { return };
            count += 1;
            assert!(text.contains(sentence.as_str()), "the text of {model} lacks {sentence:?}");
            let plain: String = markdown.chars().filter(|letter| *letter != '\\').collect();
            assert!(plain.contains(sentence.as_str()), "Markdown of {model} lacks {sentence:?}");
        };
        for section in json(model).as_object().expect("an object").values() {
            match section {
                Value::Object(facts) => facts.values().for_each(&mut look),
                Value::Array(rows) => rows
                    .iter()
                    .flat_map(|row| row.as_object().expect("a row").values())
                    .for_each(&mut look),
                other => look(other),
            }
        }
        assert!(count > 60, "{count} sentences of {model}");
    }
}

#[test]
fn all_models_are_two_chapters_or_23_lines_of_json() {
    let markdown = printed(&["describe", "--all", "--markdown"]);
    let heads: Vec<_> = markdown.lines().filter(|line| line.starts_with("# ")).collect();
    assert_eq!(heads, ["# DeviceNet models", "# PROFIBUS models"]);
    assert!(printed(&["describe", "--all"]).contains("PROFIBUS models\n"));
    let lines = printed(&["describe", "--all", "--json"]);
    assert_eq!(lines.lines().count(), 23);
    for line in lines.lines() {
        let model: Value = serde_json::from_str(line).expect("JSON");
        assert!(model["model"].is_string());
    }
}

#[test]
fn descriptions_become_files_named_after_what_they_describe() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().to_str().expect("text");
    printed(&["describe", "amg11-d29", "--markdown", "-o", place]);
    printed(&["describe", "AMG11-D29", "--json", "-o", place]);
    printed(&["describe", "amg11-d29", "-o", place]);
    for name in ["amg11-d29.md", "amg11-d29.json", "amg11-d29.txt"] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
}

#[test]
fn a_description_needs_one_model_or_all_and_one_form() {
    for (arguments, part) in [
        (&["describe"][..], "MODEL"),
        (&["describe", "amg11-d29", "--all"], "--all"),
        (&["describe", "amg11-d29", "--json", "--markdown"], "--markdown"),
    ] {
        let output = codewheel(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
}
