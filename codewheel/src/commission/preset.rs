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
    let first = encoder.session.sample()?.position;
    let before = encoder.session.sample()?.position;
    let is_turning = first != before;
    let wanted = match (arguments.value, arguments.by, range) {
        (Some(value), _, _) => value,
        (None, Some(by), Some(range)) => moved(before, by, range),
        (None, _, _) => {
            return Err(Failure::Usage(
                "this device does not tell its measuring range, so nobody knows where the position \
                 wraps: give the position itself, as in `codewheel preset 1000`"
                    .to_owned(),
            ));
        }
    };
    encoder.propose(&format!("position: {before} → {wanted} step"), arguments.consent);
    if is_turning {
        encoder.say("the shaft turns: the position of the moment in which it arrives becomes that");
    }
    arguments.consent.ask("Preset it?", encoder)?;
    let sample = encoder.session.preset(wanted)?;
    let undo = match range {
        // Wherever the shaft stands then.
        Some(range) => {
            let by = shortest(i64::from(before) - i64::from(wanted), range.into()).to_string();
            command(&["preset", "--by", &by], encoder.at)
        }
        None => command(&["preset", &before.to_string()], encoder.at),
    };
    let undo = [undo];
    let mut out = std::io::stdout().lock();
    if arguments.format.json {
        let line = Line { before, after: sample.position, undo: &undo };
        writeln!(out, "{}", serde_json::to_string(&line).map_err(std::io::Error::from)?)?;
    } else {
        writeln!(out, "position: {before} → {} step", sample.position)?;
    }
    tell_undo(&undo, encoder);
    tell_how_long(encoder);
    let off = i64::from(sample.position) - i64::from(wanted);
    let off = shortest(off, range.map_or(0, i64::from));
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
