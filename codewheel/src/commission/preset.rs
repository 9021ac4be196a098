//! `codewheel preset`: makes a number the position of now.

use std::io::Write;

use codewheel_commission::{Kind, Reading, Trouble};
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
use super::ring::{moved, shortest};
use super::settings::{tell_how_long, tell_undo};
use crate::arguments::commission::PresetArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Line<'a> {
    before: u32,
    after: u32,
    undo: &'a [String],
}

pub(super) fn run(encoder: &mut Encoder, arguments: &PresetArguments) -> Result<(), Failure> {
    let range = encoder.find("total-resolution")?.and_then(|value| match value.reading {
        Reading::Number(steps) => u32::try_from(steps).ok().filter(|steps| *steps > 0),
        _ => None,
    });
    let wanted = |position| match (arguments.value, arguments.by, range) {
        (Some(value), _, _) => Ok(value),
        (None, Some(by), Some(range)) => Ok(moved(position, by, range)),
        (None, _, _) => Err(Failure::Usage(
            "this device does not tell its measuring range, so nobody knows where the position \
             wraps: give the position itself, as in `codewheel preset 1000`"
                .to_owned(),
        )),
    };
    let (shown, is_turning) = look(encoder)?;
    encoder.propose(&format!("position: {shown} → {} step", wanted(shown)?), arguments.consent);
    if is_turning {
        encoder.say("the shaft turns: the position of the moment in which it arrives becomes that");
    }
    arguments.consent.ask("Preset it?", encoder)?;
    let offset_before = offset(encoder)?;
    // A person takes their time, and a shaft turns meanwhile. This is the last thing asked before.
    let (before, turned) = look(encoder)?;
    let is_turning = is_turning || turned || before.abs_diff(shown) > 1;
    let wanted = wanted(before)?;
    let sample = encoder.session.preset(wanted)?;
    // What is done is done, and told, also where nobody answers any more.
    let offset_after = offset(encoder).unwrap_or_default();
    let ring = range.map_or(0, i64::from);
    let made =
        offset_before.zip(offset_after).map(|(before, after)| shortest(after - before, ring));
    let undo = match (range, made) {
        // Wherever the shaft stands then.
        (Some(_), Some(made)) => by(shortest(-made, ring), encoder),
        (Some(_), None) => by(shortest(i64::from(before) - i64::from(wanted), ring), encoder),
        (None, _) => command(&["preset", &before.to_string()], encoder.at),
    };
    let undo = [undo];
    let told = tell(arguments, &Line { before, after: sample.position, undo: &undo });
    // Also where nobody reads what is told.
    if let (Some(wanted), Some(made)) = (arguments.by, made)
        && shortest(wanted, ring) != made
    {
        encoder.say(&format!("the shaft turned on meanwhile: positions are moved by {made} step"));
    }
    tell_undo(&undo, encoder);
    tell_how_long(encoder);
    told?;
    let off = shortest(i64::from(sample.position) - i64::from(wanted), ring);
    // A shaft that stands may stand between two steps.
    if is_turning || off.abs() <= 1 {
        return Ok(());
    }
    Err(Trouble::new(
        Kind::Differs,
        format!("preset the encoder at address {}", encoder.session.address()),
        format!("{wanted} was written and {} is read", sample.position),
        "if the shaft has moved meanwhile, stop it and do it again",
    )
    .into())
}

fn tell(arguments: &PresetArguments, line: &Line<'_>) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    if arguments.format.json {
        writeln!(out, "{}", serde_json::to_string(line).map_err(std::io::Error::from)?)?;
    } else {
        writeln!(out, "position: {} → {} step", line.before, line.after)?;
    }
    Ok(())
}

/// The position now, and whether the shaft turns. The first sample may have come a while ago.
fn look(encoder: &mut Encoder) -> Result<(u32, bool), Trouble> {
    let first = encoder.session.sample()?.position;
    let now = encoder.session.sample()?.position;
    Ok((now, now != first))
}

/// What presets have added to the scaled code, where the device tells it.
fn offset(encoder: &mut Encoder) -> Result<Option<i64>, Trouble> {
    Ok(encoder.find("offset")?.and_then(|value| match value.reading {
        Reading::Number(steps) => Some(steps),
        _ => None,
    }))
}

/// The command that moves all positions by so many steps.
fn by(steps: i64, encoder: &Encoder) -> String {
    command(&["preset", "--by", &steps.to_string()], encoder.at)
}
