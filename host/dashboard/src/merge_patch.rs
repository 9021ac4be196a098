//! JSON merge patches (RFC 7396): what has changed, and nothing else.

use serde_json::{Map, Value};

/// The merge patch that makes `new` of `old`; `None` where nothing has changed. Objects are gone
/// into, everything else is replaced as a whole.
///
/// A member that is `null` in `new` is left out of it by the patch, as RFC 7396 has it: there
/// `null` and absent are the same.
pub(crate) fn diff(old: &Value, new: &Value) -> Option<Value> {
    match (old, new) {
        (Value::Object(old), Value::Object(new)) => diff_members(old, new).map(Value::Object),
        _ => (old != new).then(|| new.clone()),
    }
}

fn diff_members(old: &Map<String, Value>, new: &Map<String, Value>) -> Option<Map<String, Value>> {
    let mut patch = Map::new();
    for (key, new) in new {
        match old.get(key) {
            Some(old) => {
                if let Some(change) = diff(old, new) {
                    patch.insert(key.clone(), change);
                }
            }
            None if new.is_null() => {}
            None => {
                patch.insert(key.clone(), new.clone());
            }
        }
    }
    for (key, old) in old {
        if !old.is_null() && !new.contains_key(key) {
            patch.insert(key.clone(), Value::Null);
        }
    }
    (!patch.is_empty()).then_some(patch)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// RFC 7396, section 2, as the pseudocode has it.
    fn apply(target: Value, patch: &Value) -> Value {
        let Value::Object(patch) = patch else { return patch.clone() };
        let mut target = match target {
            Value::Object(members) => members,
            _ => Map::new(),
        };
        for (key, change) in patch {
            let old = target.remove(key).unwrap_or(Value::Null);
            if !change.is_null() {
                target.insert(key.clone(), apply(old, change));
            }
        }
        Value::Object(target)
    }

    fn without_nulls(value: Value) -> Value {
        match value {
            Value::Object(members) => Value::Object(
                members
                    .into_iter()
                    .filter(|(_, value)| !value.is_null())
                    .map(|(key, value)| (key, without_nulls(value)))
                    .collect(),
            ),
            other => other,
        }
    }

    #[test]
    fn a_patch_makes_the_new_state_of_the_old_one() {
        let states = [
            json!({ "at": 1, "a": { "b": 1, "c": [1, 2], "d": null } }),
            json!({ "at": 2, "a": { "b": 1, "c": [1, 3], "d": { "e": 1 } } }),
            json!({ "at": 2, "a": { "b": null, "c": [], "d": { "e": 2, "f": {} } }, "g": "h" }),
            json!({ "at": 3, "a": { "d": 5 } }),
            json!({ "at": 3, "a": null }),
            json!({ "at": 3, "a": { "d": { "e": 1 } } }),
        ];
        for old in &states {
            for new in &states {
                let patched = match diff(old, new) {
                    Some(patch) => apply(old.clone(), &patch),
                    None => old.clone(),
                };
                assert_eq!(
                    without_nulls(patched),
                    without_nulls(new.clone()),
                    "from {old} to {new}"
                );
            }
        }
    }

    #[test]
    fn a_patch_says_what_has_changed_and_nothing_else() {
        let old = json!({ "a": { "b": 1, "c": 2 }, "d": [1] });
        let new = json!({ "a": { "b": 1, "c": 3 }, "d": [1] });
        assert_eq!(diff(&old, &new), Some(json!({ "a": { "c": 3 } })));
        assert_eq!(diff(&old, &old), None);
    }
}
