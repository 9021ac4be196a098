//! What a change has changed, and the commands that undo it.

use codewheel_commission::{Reading, Trouble, Value};
use codewheel_device::product::Bus;
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
use super::ring::shortest;
use super::value::{json, shown, with_unit, writable};

/// Settings by whose change a device forgets its offset, in the order in which they are written:
/// each may move those behind it.
const GEOMETRY: [&str; 4] = ["direction", "scaling", "steps-per-turn", "total-resolution"];

/// The settings of an encoder at one moment.
#[derive(Debug)]
pub(super) struct Settings {
    values: Vec<Value>,
    offset: Option<i64>,
}

/// A setting that is not what it was.
#[derive(Debug)]
pub(super) struct Change<'a> {
    pub(super) before: &'a Value,
    pub(super) after: &'a Value,
}

#[derive(Serialize)]
pub(super) struct ChangeLine<'a> {
    pub(super) name: &'a str,
    before: serde_json::Value,
    after: serde_json::Value,
}

impl ChangeLine<'_> {
    /// An offset before and after.
    fn offset((before, after): (i64, i64)) -> Self {
        Self { name: "offset", before: before.into(), after: after.into() }
    }
}

impl<'a> From<&Change<'a>> for ChangeLine<'a> {
    fn from(change: &Change<'a>) -> Self {
        Self {
            name: &change.after.name,
            before: json(&change.before.reading),
            after: json(&change.after.reading),
        }
    }
}

impl std::fmt::Display for Change<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { before, after } = self;
        write!(f, "{}: {} → {}", after.name, shown(before), with_unit(after))
    }
}

impl Settings {
    /// Reads all of them.
    pub(super) fn of(encoder: &mut Encoder) -> Result<Self, Trouble> {
        let all = encoder.session.values()?;
        let offset = all.iter().find(|value| value.name == "offset").and_then(number);
        let values = all.into_iter().filter(|value| value.setting).collect();
        Ok(Self { values, offset })
    }

    fn number(&self, key: &str) -> Option<i64> {
        self.values.iter().find(|value| value.name == key).and_then(number)
    }

    /// What is different in `after`, in its order.
    pub(super) fn changes<'a>(&'a self, after: &'a Self) -> Vec<Change<'a>> {
        let pairs = after.values.iter().filter_map(|after| {
            let before = self.values.iter().find(|before| before.name == after.name)?;
            Some(Change { before, after })
        });
        pairs.filter(|change| change.before.reading != change.after.reading).collect()
    }

    /// The offset before and after, where both are known and differ.
    pub(super) fn offsets(&self, after: &Self) -> Option<(i64, i64)> {
        self.offset.zip(after.offset).filter(|(before, after)| before != after)
    }

    /// All that is different in `after`, the offset too, for programs.
    pub(super) fn lines<'a>(&'a self, after: &'a Self) -> Vec<ChangeLine<'a>> {
        let changes = self.changes(after);
        let offset = self.offsets(after).map(ChangeLine::offset);
        changes.iter().map(ChangeLine::from).chain(offset).collect()
    }

    /// The settings as one line for people.
    pub(super) fn summary(&self) -> String {
        let settings = self.values.iter().map(|value| format!("{} {}", value.name, shown(value)));
        let offset = self.offset.map(|offset| format!("offset {offset}"));
        settings.chain(offset).collect::<Vec<_>>().join(", ")
    }

    /// The commands that bring back `self` where `after` is in force, in the order to give them.
    ///
    /// They are right wherever the shaft stands: a preset is undone by as many steps as it made.
    pub(super) fn undo(&self, after: &Self, encoder: &Encoder) -> Vec<String> {
        let bus = encoder.session.bus();
        let mut changes = self.changes(after);
        changes.retain(|change| change.before.writable && change.before.name != "preset");
        let place = |change: &Change<'_>| {
            GEOMETRY.iter().position(|name| *name == change.before.name).unwrap_or(GEOMETRY.len())
        };
        changes.sort_by_key(place);
        let forgets = changes.iter().any(|change| place(change) < GEOMETRY.len());
        let mut commands: Vec<String> = changes
            .iter()
            .map(|Change { before, .. }| {
                command(&["set", &before.name, &writable(bus, before)], encoder.at)
            })
            .collect();
        let left = if forgets { 0 } else { after.offset.unwrap_or_default() };
        let range = self.number("total-resolution").unwrap_or_default();
        match self.offset.map(|offset| shortest(offset - left, range)) {
            None | Some(0) => {}
            Some(by) => commands.push(command(&["preset", "--by", &by.to_string()], encoder.at)),
        }
        commands
    }
}

fn number(value: &Value) -> Option<i64> {
    match value.reading {
        Reading::Number(number) => Some(number),
        _ => None,
    }
}

/// Tells a person how to undo what was done.
pub(super) fn tell_undo(commands: &[String], encoder: &Encoder) {
    for command in commands {
        encoder.say(&format!("undo: {command}"));
    }
}

/// Bus settings of DeviceNet, which an encoder keeps without Save.
const KEPT_AT_ONCE: [&str; 4] =
    ["heartbeat-interval", "bus-off-interrupt", "poll-assembly", "change-assembly"];

/// Tells how long the value of this name lasts.
pub(super) fn tell_how_long_it_lasts(name: &str, encoder: &Encoder) {
    if KEPT_AT_ONCE.contains(&name) {
        encoder.say("the encoder keeps it at once");
    } else {
        tell_how_long(encoder);
    }
}

/// Tells how long what was written lasts, and what makes it last.
pub(super) fn tell_how_long(encoder: &Encoder) {
    if encoder.session.bus() == Bus::DeviceNet {
        let save = command(&["save"], encoder.at);
        encoder.say(&format!("it is lost when the power goes, unless it is saved: {save}"));
    }
}
