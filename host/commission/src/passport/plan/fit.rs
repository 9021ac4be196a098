//! Whether an encoder can give the positions of a passport.

use codewheel_device::product::Bus;
use codewheel_device::profibus::parameters;

use super::super::take::{self, STEPS_PER_TURN, TOTAL_RESOLUTION, find};
use super::super::{Passport, Subject, compare};
use crate::{Kind, Reading, Session, Trouble, Value};

pub(super) fn tried(session: &dyn Session) -> String {
    format!("apply the passport to the encoder at address {}", session.address())
}

pub(super) fn refused(session: &dyn Session, came: String, remedy: String) -> Trouble {
    Trouble::new(Kind::Refused, tried(session), came, remedy)
}

/// The passport says what no passport can.
fn wrong(session: &dyn Session, came: String, remedy: &str) -> Trouble {
    Trouble::new(Kind::Usage, tried(session), came, remedy)
}

/// Refuses what cannot be, and warns of what may matter.
pub(super) fn check(
    goal: &Passport,
    before: &Passport,
    values: &[Value],
    session: &dyn Session,
    warnings: &mut Vec<String>,
) -> Result<(), Trouble> {
    for name in [STEPS_PER_TURN, TOTAL_RESOLUTION] {
        if let Some(wanted) = goal.number(name).filter(|wanted| *wanted < 1) {
            let came = format!("{name} cannot be {wanted}");
            return Err(refused(session, came, "it takes 1 or more".to_owned()));
        }
    }
    disc(goal, before, session)?;
    for setting in &goal.settings {
        let name = &setting.name;
        let value = find(values, name);
        if take::NO_SETTINGS.contains(&name.as_str()) || value.is_some_and(|value| !value.setting) {
            return Err(wrong(
                session,
                format!("{name} is no setting that a passport carries"),
                "take the line out of [settings]; where the machine stands belongs into [position]",
            ));
        }
        let is_parameter = goal.bus == Bus::Profibus && parameters::Row::find(name).is_some();
        let wants_number = match value {
            Some(value) => matches!(value.reading, Reading::Number(_)),
            None => is_parameter,
        };
        if wants_number && !matches!(setting.reading, Reading::Number(_)) {
            let came = format!("{name} is a number, and the passport says otherwise");
            return Err(wrong(session, came, "write the number there, without quotes"));
        }
        let Some(value) = value else {
            // In class 1 they are there all the same, and cannot be read.
            if is_parameter {
                continue;
            }
            return Err(refused(
                session,
                format!("it has no {name}"),
                "take an encoder of the same model, or take the line out of the passport"
                    .to_owned(),
            ));
        };
        if value.reading == setting.reading {
            continue;
        }
        if !value.writable {
            return Err(refused(
                session,
                format!("its {name} cannot be written here"),
                match goal.bus {
                    Bus::DeviceNet => "take the line out of the passport",
                    Bus::Profibus => {
                        "its parameters belong to its master: change the project there"
                    }
                }
                .to_owned(),
            ));
        }
        range(goal, before, value, session)?;
    }
    identity(goal, before, warnings);
    Ok(())
}

/// n and T against the disc of this encoder.
fn disc(goal: &Passport, before: &Passport, session: &dyn Session) -> Result<(), Trouble> {
    let plate = &before.nameplate;
    let (Some(disc), Some(turns)) = (plate.singleturn_resolution, plate.revolutions) else {
        return Ok(());
    };
    if goal.is_unscaled() {
        let other =
            [(goal.nameplate.singleturn_resolution, disc), (goal.nameplate.revolutions, turns)];
        if other.iter().any(|(was, is)| was.is_some_and(|was| was != *is)) {
            return Err(refused(
                session,
                format!("without scaling it counts {disc} steps and {turns} turns"),
                "take an encoder with the same disc".to_owned(),
            ));
        }
        return Ok(());
    }
    let steps = goal.number(STEPS_PER_TURN);
    if let Some(steps) = steps.filter(|steps| *steps > i64::from(disc)) {
        return Err(refused(
            session,
            format!("{steps} steps per turn are more than the {disc} of its disc"),
            format!("take an encoder with at least {steps} steps per turn"),
        ));
    }
    let steps = steps.or_else(|| before.number(STEPS_PER_TURN)).unwrap_or(i64::from(disc));
    let Some(total) = goal.number(TOTAL_RESOLUTION) else { return Ok(()) };
    let most = steps.saturating_mul(turns.into());
    if total > most {
        let needed = total.checked_div(steps).unwrap_or_default();
        let kind = match turns {
            1 => "a singleturn encoder has".to_owned(),
            _ => format!("an encoder with {turns} turns has"),
        };
        return Err(refused(
            session,
            format!(
                "the passport measures {total} steps, and {kind} only {most} at {steps} steps \
                 per turn"
            ),
            format!("take a multiturn encoder that tells at least {needed} turns apart"),
        ));
    }
    // AMG manual §4, note: on DeviceNet the range of a singleturn encoder is its steps per turn.
    if goal.bus == Bus::DeviceNet && turns == 1 && total != steps {
        return Err(refused(
            session,
            format!(
                "the measuring range of a singleturn encoder is its {steps} steps per turn, not {total}"
            ),
            "take a multiturn encoder".to_owned(),
        ));
    }
    Ok(())
}

/// The range that the device tells. That of these depends on what is still to be written.
fn range(
    goal: &Passport,
    before: &Passport,
    value: &Value,
    session: &dyn Session,
) -> Result<(), Trouble> {
    let name = value.name.as_str();
    let Some(wanted) = goal.number(name) else { return Ok(()) };
    let disc_known = before.nameplate.singleturn_resolution.is_some();
    let range = match name {
        STEPS_PER_TURN | TOTAL_RESOLUTION if disc_known => None,
        "cos-delta" => {
            let total = goal.total_in_force().or_else(|| before.total_in_force());
            total.map(|total| (1, i64::from(total)))
        }
        _ => value.range,
    };
    match range {
        Some((low, high)) if wanted < low || wanted > high => Err(refused(
            session,
            format!("{name} cannot be {wanted}"),
            format!("it takes {low} to {high}"),
        )),
        _ => Ok(()),
    }
}

/// Who it is: nothing that keeps it from measuring, but masters look at it.
fn identity(goal: &Passport, before: &Passport, warnings: &mut Vec<String>) {
    for difference in compare(goal, before) {
        match (difference.subject, difference.name.as_str()) {
            (Subject::Unit, _) => warnings.push(format!("{difference}")),
            (Subject::Bus, name @ "address") => warnings
                .push(format!("the {name} is another one than that of the passport: {difference}")),
            (Subject::Identity, "product-code" | "vendor" | "device-type") => {
                warnings.push(format!("{difference}; a master that checks it will not serve it"));
            }
            (Subject::Identity, "singleturn-resolution" | "revolutions") => {
                warnings.push(format!("another disc: {difference}"));
            }
            _ => {}
        }
    }
    if let (Some(was), Some(is)) = (goal.nameplate.revision, before.nameplate.revision)
        && is < was
    {
        let ((a, b), (c, d)) = (was, is);
        warnings.push(format!(
            "its revision {c}.{d} is older than the {a}.{b} of the passport: a master that checks it \
             may not serve it"
        ));
    }
}

/// What nobody can know from traffic.
pub(super) fn missing(goal: &Passport, warnings: &mut Vec<String>) {
    let settings: Vec<&str> = goal
        .absent
        .iter()
        .filter_map(|name| name.strip_prefix("settings."))
        .filter(|name| goal.setting(name).is_none())
        .collect();
    if !settings.is_empty() {
        warnings
            .push(format!("not in the capture, so they stay as they are: {}", settings.join(", ")));
    }
}

/// Where T does not divide n·M, the position also depends on how often the code has passed its zero
/// since the settings were made, which nobody can read.
pub(super) fn warn_of_turns(goal: &Passport, before: &Passport, warnings: &mut Vec<String>) {
    let Some(total) = goal.total_in_force() else { return };
    let steps = goal.number(STEPS_PER_TURN).or_else(|| before.number(STEPS_PER_TURN));
    let turns = before.nameplate.revolutions;
    let range = steps.zip(turns).map(|(steps, turns)| steps.saturating_mul(turns.into()));
    if range.and_then(|range| range.checked_rem(i64::from(total))).is_some_and(|rest| rest != 0) {
        warnings.push(format!(
            "its code does not repeat with the measuring range of {total} steps: if the code has \
             passed its zero since the preset was made, the offset alone gives other positions; say \
             where the machine stands to be sure"
        ));
    }
}
