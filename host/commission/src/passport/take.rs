//! Asking a device for its passport.

use super::measure::{self, Watched};
use super::{Circumstances, Nameplate, Passport, Position, Project, Setting, Source};
use crate::{Kind, Name, Reading, Session, Trouble, Value};

/// What is no setting in a passport, although people write it: it belongs to the position.
const PRESET: &str = "preset";
/// What presets add to the scaled code.
const OFFSET: &str = "offset";
/// The measuring range.
pub(super) const TOTAL_RESOLUTION: &str = "total-resolution";
/// The steps in a turn.
pub(super) const STEPS_PER_TURN: &str = "steps-per-turn";
/// The configuration that Chk_Cfg had.
const CONFIGURATION: &str = "configuration";
/// What people write, and is no setting in a passport: it has places of its own there.
pub(super) const NO_SETTINGS: [&str; 3] = [PRESET, OFFSET, CONFIGURATION];
/// The steps of the disc in a turn.
const SINGLETURN_RESOLUTION: &str = "singleturn-resolution";
/// The turns that can be told apart, as a device tells them: 65535 for 65536, 0 for 1.
const REVOLUTIONS: &str = "revolutions";

/// Asks the encoder for all that its passport says, and watches its shaft for a while. It writes
/// nothing.
///
/// # Errors
/// What the session meets with. A device that tells no position gives a passport without one.
pub fn take(session: &mut dyn Session, circumstances: &Circumstances) -> Result<Passport, Trouble> {
    take_with_values(session, circumstances).map(|(passport, _)| passport)
}

/// The same, with all that it told: the ranges of the settings are there.
pub(super) fn take_with_values(
    session: &mut dyn Session,
    circumstances: &Circumstances,
) -> Result<(Passport, Vec<Value>), Trouble> {
    let identity = session.identify()?;
    let values = session.values()?;
    let total = number(&values, TOTAL_RESOLUTION).and_then(|total| u32::try_from(total).ok());
    let watched = match measure::watch(session, circumstances.watch, total) {
        Ok(watched) => Some(watched),
        // It has no position to tell, which is no reason to keep the rest from people.
        Err(Trouble { kind: Kind::Refused | Kind::Usage, .. }) => None,
        Err(trouble) => return Err(trouble),
    };
    let mut nameplate = Nameplate::from(identity);
    let disc = number(&values, SINGLETURN_RESOLUTION);
    nameplate.singleturn_resolution = disc.and_then(|steps| u32::try_from(steps).ok());
    nameplate.revolutions = number(&values, REVOLUTIONS).and_then(told_revolutions);
    let mut passport = Passport {
        taken: circumstances.taken(),
        program: circumstances.program.clone(),
        source: Source::Device,
        absent: Vec::new(),
        bus: session.bus(),
        address: session.address(),
        bit_rate: circumstances.bit_rate,
        nameplate,
        settings: settings(&values),
        position: Position {
            preset: number(&values, PRESET),
            offset: offset_of(&values),
            steps: watched.map(|Watched { position, .. }| position),
            at_rest: watched.map(|Watched { at_rest, .. }| at_rest),
        },
        project: Project::default(),
    };
    passport.project.configuration = configuration(&values);
    passport.derive_project();
    Ok((passport, values))
}

/// What a device calls its number of revolutions, as a number.
pub(super) fn told_revolutions(told: i64) -> Option<u32> {
    match told {
        0 => Some(1),
        0xFFFF => Some(1 << 16),
        told => u32::try_from(told).ok(),
    }
}

/// The value of this name; a setting goes before a reading.
pub(super) fn find<'a>(values: &'a [Value], name: &str) -> Option<&'a Value> {
    let named = || values.iter().filter(|value| value.name == name);
    named().find(|value| value.setting).or_else(|| named().next())
}

fn number(values: &[Value], name: &str) -> Option<i64> {
    match find(values, name)?.reading {
        Reading::Number(number) => Some(number),
        _ => None,
    }
}

fn offset_of(values: &[Value]) -> Option<i64> {
    number(values, OFFSET)
}

/// The offset now.
///
/// # Errors
/// What the session meets with.
pub(super) fn offset(session: &mut dyn Session) -> Result<i64, Trouble> {
    let value = session.value(&Name::Key(OFFSET.to_owned()))?;
    Ok(offset_of(&[value]).unwrap_or_default())
}

fn configuration(values: &[Value]) -> Option<Vec<u8>> {
    match &find(values, CONFIGURATION)?.reading {
        Reading::Octets(octets) => Some(octets.clone()),
        Reading::Number(identifier) => Some(vec![u8::try_from(*identifier).ok()?]),
        Reading::Real(_) | Reading::Text(_) => None,
    }
}

fn settings(values: &[Value]) -> Vec<Setting> {
    let mut settings: Vec<Setting> = Vec::new();
    for value in values.iter().filter(|value| value.setting) {
        let is_known = settings.iter().any(|known| known.name == value.name);
        if is_known || NO_SETTINGS.contains(&value.name.as_str()) {
            continue;
        }
        let reading = value.reading.clone();
        settings.push(Setting { name: value.name.clone(), reading, note: note(value) });
    }
    settings
}

/// `CW: Sense of rotation`, `step: Steps per turn`, in one line whatever the device calls it.
fn note(value: &Value) -> String {
    let before = value.label.as_deref().unwrap_or(&value.unit);
    let text = match (before.is_empty(), value.title.is_empty()) {
        (true, _) => value.title.clone(),
        (false, true) => before.to_owned(),
        (false, false) => format!("{before}: {}", value.title),
    };
    one_line(&text)
}

/// Foreign devices call things what they like; a comment ends with its line.
pub(super) fn one_line(text: &str) -> String {
    let words = text.split(|letter: char| letter.is_whitespace() || letter.is_control());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    words.join(" ").trim_start_matches(['#', ' ']).to_owned()
}
