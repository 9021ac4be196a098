//! `codewheel set`: writes one value, and says how to undo it.

use std::io::Write;

use codewheel_commission::{Kind, Name, Reading, Trouble, Value};
use codewheel_datasheet::hilo;
use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters::{Field, Row};
use serde::Serialize;

use super::command_line::command;
use super::encoder::Encoder;
use super::settings::{
    Change, ChangeLine, STEPS_PER_TURN, Settings, TOTAL_RESOLUTION, tell_how_long_it_lasts,
    tell_undo,
};
use super::value;
use crate::arguments::commission::SetArguments;
use crate::failure::Failure;

#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    change: ChangeLine<'a>,
    /// What else changed by it.
    changed: Vec<ChangeLine<'a>>,
    undo: &'a [String],
}

pub(super) fn run(
    encoder: &mut Encoder,
    name: &Name,
    arguments: &SetArguments,
) -> Result<(), Failure> {
    let bus = encoder.session.bus();
    let old = encoder.session.value(name)?;
    if old.name == "preset" {
        return Err(Failure::Usage(
            "a preset moves the position: write `codewheel preset VALUE`, which shows what it does"
                .to_owned(),
        ));
    }
    let (labels, note) = value::known(bus, &old);
    if !old.writable && bus == Bus::Profibus && Row::find(&old.name).is_some() {
        // A parameter that belongs to another master: the refusal says to whom.
        let wanted = value::parse(&arguments.value, &old, labels)?;
        encoder.session.write(name, &wanted)?;
    }
    if !old.writable {
        return Err(Failure::Usage(format!(
            "{} is told by the encoder and cannot be written; it is {}",
            old.name,
            value::with_unit(&old)
        )));
    }
    let wanted = value::parse(&arguments.value, &old, labels)?;
    if wanted == old.reading {
        encoder.say(&format!("{} is {} already", old.name, value::with_unit(&old)));
        return tell(arguments, &Change { before: &old, after: &old }, Vec::new(), &[]);
    }
    let new = match (&wanted, labels) {
        (Reading::Number(number), [_, ..]) => usize::try_from(*number)
            .ok()
            .and_then(|number| labels.get(number))
            .map_or_else(|| value::plain(&wanted), |label| (*label).to_owned()),
        _ => value::plain(&wanted),
    };
    let proposal = format!("{}: {} → {new} {}", old.name, value::shown(&old), old.unit);
    encoder.propose(proposal.trim_end(), arguments.consent);
    if !note.is_empty() {
        encoder.propose(note, arguments.consent);
    }
    let before = Settings::of(encoder)?;
    arguments.consent.ask("Write it?", encoder)?;
    let after_write = match encoder.session.write(name, &wanted) {
        Ok(value) => value,
        Err(trouble) => {
            tell_doubt(&trouble, &before, &old, encoder);
            return Err(with_range(trouble, encoder, &old, &wanted).into());
        }
    };
    let after =
        Settings::of(encoder).inspect_err(|trouble| tell_doubt(trouble, &before, &old, encoder))?;
    let undo = before.undo(&after, encoder);
    let mut changes = before.changes(&after);
    changes.retain(|change| change.after.name != old.name);
    for change in &changes {
        encoder.say(&format!("this changed too: {change}"));
    }
    if let Some((before, after)) = before.offsets(&after) {
        encoder.say(&format!("this changed too: offset: {before} → {after} step"));
    }
    let mut changed = before.lines(&after);
    changed.retain(|line| line.name != old.name);
    let told = tell(arguments, &Change { before: &old, after: &after_write }, changed, &undo);
    // Also where nobody reads what is told.
    tell_undo(&undo, encoder);
    match bus {
        Bus::DeviceNet => tell_how_long_it_lasts(&old.name, encoder),
        Bus::Profibus => {
            if let parameters @ [_, ..] = encoder.at.parameters.as_slice() {
                encoder.say(&format!("what --parameter gave stays: {}", parameters.join(", ")));
            }
            tell_project(encoder, &after_write);
        }
    }
    told?;
    if after_write.reading == wanted {
        return Ok(());
    }
    let is_scale = [STEPS_PER_TURN, TOTAL_RESOLUTION].contains(&old.name.as_str());
    Err(Trouble::new(
        Kind::Differs,
        format!("write {} of the encoder at address {}", old.name, encoder.session.address()),
        format!(
            "{} was written and {} is read",
            value::plain(&wanted),
            value::plain(&after_write.reading)
        ),
        if is_scale && after.is_unscaled() {
            "it counts with its whole disc, since class 2 or scaling is off: set them on first, or \
             with it, as in --parameter scaling=on"
        } else {
            "another master may have written too: look who is on the bus with `codewheel scan`"
        },
    )
    .into())
}

/// Where nobody answers any more, a write may have been done all the same.
fn tell_doubt(trouble: &Trouble, before: &Settings, old: &Value, encoder: &Encoder) {
    if matches!(trouble.kind, Kind::Refused | Kind::Usage) {
        return;
    }
    encoder.say(&format!("it may have been written; before it was: {}", before.summary()));
    let old_value = value::writable(encoder.session.bus(), old);
    tell_undo(&[command(&["set", &old.name, &old_value], encoder.at)], encoder);
}

/// On PROFIBUS steps per turn and total resolution come together, and the second may be too much for
/// the first: then the refusal says what to send with it.
fn with_range(trouble: Trouble, encoder: &mut Encoder, old: &Value, wanted: &Reading) -> Trouble {
    let Reading::Number(steps) = *wanted else { return trouble };
    let is_meant = encoder.session.bus() == Bus::Profibus
        && trouble.kind == Kind::Refused
        && old.name == "steps-per-turn"
        && old.range.is_some_and(|(least, most)| (least..=most).contains(&steps));
    let mut number = |key| match encoder.find(key) {
        Ok(Some(Value { reading: Reading::Number(number), .. })) => Some(number),
        _ => None,
    };
    let Some((turns, total)) =
        is_meant.then(|| number("revolutions").zip(number("total-resolution"))).flatten()
    else {
        return trouble;
    };
    // Two octets hold no 65536.
    let turns = if turns == 65_535 { 65_536 } else { turns.max(1) };
    let most = steps.saturating_mul(turns);
    if total <= most {
        return trouble;
    }
    let turns = if turns == 1 { "1 turn".to_owned() } else { format!("{turns} turns") };
    let remedy = format!(
        "{steps} steps in {turns} are less than the total resolution of {total}: send another \
         one with it, as in --parameter total-resolution={most}"
    );
    Trouble { remedy, ..trouble }
}

fn tell(
    arguments: &SetArguments,
    change: &Change<'_>,
    changed: Vec<ChangeLine<'_>>,
    undo: &[String],
) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    if arguments.format.json {
        let line = Line { change: change.into(), changed, undo };
        writeln!(out, "{}", serde_json::to_string(&line).map_err(std::io::Error::from)?)?;
    } else {
        writeln!(out, "{change}")?;
    }
    Ok(())
}

/// What the project of the encoder's own master has to say, since only that lasts.
fn tell_project(encoder: &Encoder, written: &Value) {
    let number = match written.reading {
        Reading::Number(number) => u32::try_from(number).ok(),
        _ => None,
    };
    let Some((row, number)) = Row::find(&written.name).zip(number) else { return };
    let octets = row.octets;
    encoder.say(&match row.field {
        Field::Bit(bit) => format!(
            "it lasts until a master parameterises anew: put {} into the project of its master, \
             \"{}\", bit {bit} of octet {} of Set_Prm",
            value::shown(written),
            row.name,
            octets.first
        ),
        Field::Unsigned32 { words } => {
            let (hi, lo) = hilo(number);
            let [high, low] = words;
            format!(
                "it lasts until a master parameterises anew: put it into the project of its master, \
                 \"{high}\" {hi} and \"{low}\" {lo}, octets {}–{} of Set_Prm",
                octets.first, octets.last
            )
        }
    });
}
