//! What can be read of a device, and set, whatever its bus.

use crate::{Cause, Refusal, Value};

/// Objects that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectGroup {
    /// What they are: `Encoder Position object, class 2Fh instance 1`.
    pub title: &'static str,
    /// The objects, in the order of their places.
    pub objects: Vec<Object>,
}

/// One value of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name in commands, unique in a device: `steps-per-turn`.
    pub key: String,
    /// Where it lies: `2Fh/1/7`, `octets 10–13 of Set_Prm`.
    pub place: String,
    /// Its name in the manual.
    pub title: &'static str,
    /// Its data type as the manual writes it: `UDINT`.
    pub data_type: &'static str,
    /// The unit; empty where there is none.
    pub unit: &'static str,
    /// One sentence that helps.
    pub help: &'static str,
    /// What else is worth knowing; empty where nothing is.
    pub note: &'static str,
    /// Whether people choose it; otherwise the device tells it.
    pub setting: bool,
    /// Why it cannot be written; `None` where it can.
    pub why_not: Option<String>,
    /// The smallest and the largest value it takes now, where that is worth saying.
    pub range: Option<(i64, i64)>,
    /// The names of the values 0, 1, …, empty where it has none.
    pub values: &'static [&'static str],
    /// The value in force; `None` where nobody knows it, as without power.
    pub value: Option<Value>,
    /// The value that the next power-up brings back, where it is kept.
    pub saved: Option<Value>,
}

impl Object {
    /// Whether it can be written now.
    #[must_use]
    pub const fn is_editable(&self) -> bool {
        self.why_not.is_none()
    }
}

/// The number that `value` is, or that has this name among `names`.
///
/// # Errors
/// What is allowed, as a sentence without a full stop.
pub(crate) fn number_of(value: &Value, names: &[&str]) -> Result<i64, String> {
    let text = match value {
        Value::Number(number) => return Ok(*number),
        Value::Text(text) => text.trim(),
    };
    let place = names.iter().position(|name| !name.is_empty() && name.eq_ignore_ascii_case(text));
    if let Some(number) = place.and_then(|place| i64::try_from(place).ok()) {
        return Ok(number);
    }
    text.parse().map_err(|_| {
        let names: Vec<_> = names.iter().filter(|name| !name.is_empty()).copied().collect();
        match names.as_slice() {
            [] => "it is a number".to_owned(),
            names => format!("it is {}, or their number", names.join(" or ")),
        }
    })
}

/// The refusal where a device has no such object.
pub(crate) fn unknown(key: &str) -> Refusal {
    let text = format!("the device has no object {key:?}: list its objects");
    Refusal::new(Cause::Unknown, text)
}
