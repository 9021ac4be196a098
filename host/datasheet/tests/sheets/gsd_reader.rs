//! A reader of GSD files for the tests, which keeps every keyword: gsd-parser keeps those that a
//! master needs.

use std::collections::BTreeMap;

/// Keywords and values. Numbers are decimal. What stands in a block has the block's keyword and
/// number in front: `PrmText 1 Text(0)`, `ExtUserPrmData 5`, `ExtUserPrmData 5 type`, `Module 0xF1`.
pub(crate) type Facts = BTreeMap<String, String>;

/// The keywords and values of a file.
pub(crate) fn facts(text: &str) -> Facts {
    let mut facts = Facts::new();
    let mut block = String::new();
    let text = text.replace("\\\r\n", "");
    let (_, body) = text.split_once("#Profibus_DP\r\n").expect("the file begins");
    for line in body.lines() {
        // No text in these files has a semicolon.
        let line = line.split(';').next().unwrap_or_default().trim();
        if line.is_empty() {
        } else if line.starts_with("End") {
            assert!(!block.is_empty(), "{line} ends nothing");
            block.clear();
        } else if let Some((keyword, value)) = line.split_once('=') {
            let (keyword, value) = (keyword.trim(), value.trim());
            match keyword {
                "PrmText" => block = format!("PrmText {value} "),
                "ExtUserPrmData" => {
                    let (number, name) = value.split_once(' ').expect("number and name");
                    put(&mut facts, format!("ExtUserPrmData {number}"), name);
                    block = format!("ExtUserPrmData {number} ");
                }
                "Module" => {
                    let (name, identifier) = value.rsplit_once(' ').expect("name and identifier");
                    put(&mut facts, format!("Module {identifier}"), name);
                    block = format!("Module {identifier} ");
                }
                _ => put(&mut facts, format!("{block}{keyword}"), value),
            }
        } else {
            assert!(block.starts_with("ExtUserPrmData"), "{line} is no assignment");
            put(&mut facts, format!("{block}type"), line);
        }
    }
    assert!(block.is_empty(), "{block} does not end");
    facts
}

/// What several parameters say of one octet is joined.
fn put(facts: &mut Facts, keyword: String, value: &str) {
    let value = match value {
        text if text.starts_with('"') => text.to_owned(),
        numbers => {
            let numbers = numbers.split(',').map(|number| decimal(number.trim()));
            numbers.collect::<Vec<_>>().join(",")
        }
    };
    if keyword.starts_with("Ext_User_Prm_Data_Ref") {
        let found = facts.entry(keyword).or_default();
        let separator = if found.is_empty() { "" } else { "," };
        found.push_str(&format!("{separator}{value}"));
    } else {
        let found = facts.insert(keyword.clone(), value);
        assert_eq!(found, None, "{keyword} stands there twice");
    }
}

fn decimal(number: &str) -> String {
    match number.strip_prefix("0x").map(|digits| u32::from_str_radix(digits, 16)) {
        Some(number) => number.expect("hexadecimal").to_string(),
        None => number.to_owned(),
    }
}
