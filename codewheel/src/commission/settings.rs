//! What a change has changed, and the commands that undo it.

use codewheel_commission::{Reading, Trouble, Value};
use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters::Row;
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
use super::ring::shortest;
use super::value::{json, shown, with_unit, writable};
use crate::arguments::commission::EncoderAddress;

pub(super) const STEPS_PER_TURN: &str = "steps-per-turn";
pub(super) const TOTAL_RESOLUTION: &str = "total-resolution";
const COS_DELTA: &str = "cos-delta";

/// Settings of DeviceNet by whose change a device forgets its offset, in the order in which they are
/// written: each may move those behind it.
const GEOMETRY: [&str; 3] = ["direction", STEPS_PER_TURN, TOTAL_RESOLUTION];

/// Parameters of PROFIBUS without which others are not in force, nor read back.
const HIDING: [&str; 2] = ["class-2", "scaling"];

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

    /// PROFIBUS: class 2 or scaling is off, so nobody looks at steps per turn and total resolution.
    pub(super) fn is_unscaled(&self) -> bool {
        HIDING.iter().any(|key| self.number(key) == Some(0))
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
        match encoder.session.bus() {
            Bus::DeviceNet => self.undo_settings(after, encoder.at),
            Bus::Profibus => self.undo_parameters(after, encoder.at),
        }
    }

    fn undo_settings(&self, after: &Self, at: &EncoderAddress) -> Vec<String> {
        let changes = self.changes(after);
        let mut lost: Vec<&Value> = changes.iter().map(|change| change.before).collect();
        let steps =
            lost.iter().find(|value| value.name == STEPS_PER_TURN).copied().and_then(number);
        let delta = self.values.iter().find(|value| value.name == COS_DELTA);
        // The total resolution is at least the steps per turn on the way, which pulls a greater
        // delta down.
        if let Some(delta) = delta.filter(|delta| steps.is_some() && number(delta) > steps)
            && lost.iter().all(|value| value.name != COS_DELTA)
        {
            lost.push(delta);
        }
        lost.retain(|value| value.writable && value.name != "preset");
        let place = |value: &&Value| {
            GEOMETRY.iter().position(|name| *name == value.name).unwrap_or(GEOMETRY.len())
        };
        lost.sort_by_key(place);
        let forgets = lost.iter().any(|value| place(value) < GEOMETRY.len());
        let mut commands: Vec<String> = lost
            .iter()
            .map(|value| command(&["set", &value.name, &writable(Bus::DeviceNet, value)], at))
            .collect();
        let left = if forgets { 0 } else { after.offset.unwrap_or_default() };
        let range = self.number(TOTAL_RESOLUTION).unwrap_or_default();
        match self.offset.map(|offset| shortest(offset - left, range)) {
            None | Some(0) => {}
            Some(by) => commands.push(command(&["preset", "--by", &by.to_string()], at)),
        }
        commands
    }

    /// One command, since all parameters come in one telegram. Those that class 2 and scaling hide
    /// come with it. The offset comes back by itself: the encoder keeps it with the parameters that it
    /// was made under (decision).
    fn undo_parameters(&self, after: &Self, at: &EncoderAddress) -> Vec<String> {
        let is_same = |before: &Value| {
            after.values.iter().any(|it| it.name == before.name && it.reading == before.reading)
        };
        let is_lost = |value: &&Value| Row::find(&value.name).is_some() && !is_same(value);
        let mut lost: Vec<&Value> = self.values.iter().filter(is_lost).collect();
        // What hides others is written last, with the others in place.
        lost.sort_by_key(|value| {
            HIDING.iter().position(|name| *name == value.name).unwrap_or(HIDING.len())
        });
        let Some((first, others)) = lost.split_first() else { return Vec::new() };
        let given: Vec<String> = others
            .iter()
            .map(|value| format!("{}={}", value.name, writable(Bus::Profibus, value)))
            .collect();
        let value = writable(Bus::Profibus, first);
        let mut words = vec!["set", &first.name, &value];
        words.extend(given.iter().flat_map(|given| ["--parameter", given]));
        vec![command(&words, at)]
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

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::arguments::{Arguments, Verb};

    fn settings(offset: i64, values: &[(&str, i64)]) -> Settings {
        let value = |&(name, number): &(&str, i64)| Value {
            name: name.to_owned(),
            place: String::new(),
            title: String::new(),
            reading: Reading::Number(number),
            label: None,
            unit: String::new(),
            writable: true,
            setting: true,
            range: None,
            help: String::new(),
        };
        Settings { values: values.iter().map(value).collect(), offset: Some(offset) }
    }

    /// The values that are written to undo what made `after` of `before`.
    fn undo(before: &Settings, after: &Settings) -> Vec<String> {
        let words = ["codewheel", "save", "--bus", "slcan:127.0.0.1:4001", "--address", "5"];
        let Verb::Save(typed) = Arguments::parse_from(words).verb.expect("a verb") else {
            panic!("not a save")
        };
        let commands = before.undo_settings(after, &typed.encoder);
        let value = |command: &String| {
            let end = command.find(" --bus").expect("a bus");
            command["codewheel ".len()..end].to_owned()
        };
        commands.iter().map(value).collect()
    }

    #[test]
    fn what_steps_per_turn_take_along_on_the_way_back_is_written_again() {
        let before = [(STEPS_PER_TURN, 1_000), (TOTAL_RESOLUTION, 6_500), (COS_DELTA, 6_400)];
        let after = [(STEPS_PER_TURN, 8_192), (TOTAL_RESOLUTION, 49_152), (COS_DELTA, 6_400)];
        // 1000 steps make 6000 in all at first, and a delta of 6400 is too much for that.
        assert_eq!(
            undo(&settings(-77, &before), &settings(0, &after)),
            [
                "set steps-per-turn 1000",
                "set total-resolution 6500",
                "set cos-delta 6400",
                "preset --by -77"
            ]
        );
        let (mut before, mut after) = (before, after);
        (before[2].1, after[2].1) = (1_000, 1_000);
        assert_eq!(
            undo(&settings(0, &before), &settings(0, &after)),
            ["set steps-per-turn 1000", "set total-resolution 6500"]
        );
    }
}
