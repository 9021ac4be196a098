//! What can be read of a device, and set.

use codewheel_plant::{Object, ObjectGroup, Value};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Objects that belong together.
#[derive(Serialize, ToSchema)]
pub(crate) struct GroupDocument {
    /// `Encoder Position object, class 2Fh instance 1`.
    title: &'static str,
    pub(crate) objects: Vec<ObjectDocument>,
}

/// One value of a device.
#[derive(Serialize, ToSchema)]
pub(crate) struct ObjectDocument {
    /// Its name, unique in a device: `steps-per-turn`.
    pub(crate) key: String,
    /// Where it lies: `2Fh/1/7`.
    place: String,
    title: &'static str,
    /// The data type as the manual writes it.
    #[serde(rename = "type")]
    kind: &'static str,
    unit: &'static str,
    help: &'static str,
    note: &'static str,
    /// Whether it can be written now.
    editable: bool,
    /// Why not.
    why_not: Option<String>,
    /// Whether people choose it; otherwise the device tells it.
    setting: bool,
    /// The smallest and the largest value it takes now.
    range: Option<[i64; 2]>,
    /// The names of the values 0, 1, …
    values: Option<&'static [&'static str]>,
    /// The value in force; null where nobody knows it.
    pub(crate) value: Option<ValueDocument>,
    /// The value that the next power-up brings back, where it is kept.
    saved: Option<ValueDocument>,
}

/// A number or a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub(crate) enum ValueDocument {
    /// A number.
    Number(i64),
    /// A text; to write, the name of a value.
    Text(String),
}

impl From<&ObjectGroup> for GroupDocument {
    fn from(group: &ObjectGroup) -> Self {
        let objects = group.objects.iter().map(ObjectDocument::from).collect();
        Self { title: group.title, objects }
    }
}

impl From<&Object> for ObjectDocument {
    fn from(object: &Object) -> Self {
        Self {
            key: object.key.clone(),
            place: object.place.clone(),
            title: object.title,
            kind: object.data_type,
            unit: object.unit,
            help: object.help,
            note: object.note,
            editable: object.is_editable(),
            why_not: object.why_not.clone(),
            setting: object.setting,
            range: object.range.map(|(least, most)| [least, most]),
            values: (!object.values.is_empty()).then_some(object.values),
            value: object.value.as_ref().map(ValueDocument::from),
            saved: object.saved.as_ref().map(ValueDocument::from),
        }
    }
}

impl From<&Value> for ValueDocument {
    fn from(value: &Value) -> Self {
        match value {
            Value::Number(number) => Self::Number(*number),
            Value::Text(text) => Self::Text(text.clone()),
        }
    }
}

impl From<ValueDocument> for Value {
    fn from(value: ValueDocument) -> Self {
        match value {
            ValueDocument::Number(number) => Self::Number(number),
            ValueDocument::Text(text) => Self::Text(text),
        }
    }
}
