//! `codewheel preset`: makes a number the position of now.

use std::io::Write;

use codewheel_commission::{Kind, Reading, Trouble};
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
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
        (None, Some(by), Some(range)) => wrapped(before, by, range),
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
            let by = shortest(wanted, before, range).to_string();
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
    let off = range.map_or(i64::from(sample.position) - i64::from(wanted), |range| {
        shortest(wanted, sample.position, range)
    });
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

/// `position` moved by `by` in a measuring range.
fn wrapped(position: u32, by: i64, range: u32) -> u32 {
    let moved = i128::from(position) + i128::from(by);
    u32::try_from(moved.rem_euclid(i128::from(range))).unwrap_or(position)
}

/// The shortest way in a measuring range.
fn shortest(from: u32, to: u32, range: u32) -> i64 {
    let range = i64::from(range);
    let way = (i64::from(to) - i64::from(from)).rem_euclid(range);
    if way > range / 2 { way - range } else { way }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preset_is_undone_by_the_way_back_around_the_end_of_the_range() {
        for (before, wanted) in [(0, 999), (999, 0), (10, 20), (20, 10), (0, 500), (501, 0)] {
            let by = shortest(wanted, before, 1_000);
            assert_eq!(wrapped(wanted, by, 1_000), before, "{before} {wanted}");
            assert!(by.abs() <= 500);
        }
        assert_eq!(
            wrapped(5, i64::MIN, 1_000),
            (5 - i128::from(i64::MIN.unsigned_abs())).rem_euclid(1_000) as u32
        );
    }
}
