//! What must be done to an encoder so that it gives the positions of a passport.

mod fit;

use std::fmt;

use codewheel_device::product::Bus;
use codewheel_station::Duration;
use serde::Serialize;

use super::compare::{optional, same_offset, told};
use super::measure::distance;
use super::take::{self, STEPS_PER_TURN, TOTAL_RESOLUTION};
use super::{Circumstances, Difference, Passport, Project, Source, Subject, compare};
use crate::{Kind, Reading, Session, Trouble};

/// One setting to be written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Its name on the command line.
    pub name: String,
    /// What it is.
    #[serde(serialize_with = "optional")]
    pub from: Option<Reading>,
    /// What it must be; never `None`.
    #[serde(serialize_with = "optional")]
    pub to: Option<Reading>,
    /// Whether it clears preset and offset.
    pub clears_offset: bool,
}

impl fmt::Display for Change {
    /// `steps-per-turn: 8192 → 3600`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} → {}", self.name, told(self.from.as_ref()), told(self.to.as_ref()))
    }
}

/// How the positions become those of the passport.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "by", rename_all = "kebab-case")]
pub enum Positioning {
    /// They are already.
    Nothing,
    /// It is the encoder of the passport: its offset is restored, wherever the machine stands.
    Offset {
        /// The offset, on the ring of the measuring range.
        offset: i64,
    },
    /// A preset, while the machine stands at this position.
    Preset {
        /// The position in steps.
        position: u32,
    },
    /// Not at all: nobody knows where the machine stands.
    Unknown,
}

/// What is to be written to an encoder, in which order, and what people should know before.
///
/// Making a plan writes nothing. It is for the encoder as it was then: carry it out soon, and while
/// the machine stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub(super) goal: Passport,
    pub(super) before: Passport,
    pub(super) changes: Vec<Change>,
    pub(super) positioning: Positioning,
    pub(super) warnings: Vec<String>,
    pub(super) watch: Duration,
}

/// What clears preset and offset where it changes, in the order of writing on DeviceNet: steps per
/// turn set the total resolution (AMG manual §8).
const GEOMETRY: [&str; 3] = ["direction", STEPS_PER_TURN, TOTAL_RESOLUTION];

/// By how much a position must differ to be produced. A smaller total resolution pulls it down.
const COS_DELTA: &str = "cos-delta";

/// n and T.
const SCALE: [&str; 2] = [STEPS_PER_TURN, TOTAL_RESOLUTION];

/// Finds what makes the encoder of `session` give the positions of `passport`. It takes a passport of
/// the encoder as it is, and writes nothing.
///
/// `position` is where the machine stands now, in steps of the passport, where a person knows it.
/// Without it the encoder of the passport, known by its serial number and its model, gets its offset
/// back wherever the machine stands; for another one the machine must stand where it stood when the
/// passport was taken.
///
/// # Errors
/// [`Kind::Refused`] where this encoder cannot give these positions: another bus, settings beyond what
/// it can measure, a passport of a shaft that turned. [`Kind::Usage`] for a position that cannot be. What
/// the session meets with.
pub fn plan(
    passport: &Passport,
    session: &mut dyn Session,
    circumstances: &Circumstances,
    position: Option<u32>,
) -> Result<Plan, Trouble> {
    let mut warnings = Vec::new();
    if passport.bus != session.bus() {
        return Err(fit::refused(
            session,
            format!("the passport is of an encoder on {}", passport.bus),
            format!("take a passport of an encoder on {}", session.bus()),
        ));
    }
    let (before, values) = take::take_with_values(session, circumstances)?;
    fit::check(passport, &before, &values, session, &mut warnings)?;
    let changes = changes(passport, &before);
    let positioning = positioning(passport, &before, &changes, position, session, &mut warnings)?;
    fit::missing(passport, &mut warnings);
    Ok(Plan {
        goal: passport.clone(),
        before,
        changes,
        positioning,
        warnings,
        watch: circumstances.watch,
    })
}

/// The settings that differ, in the order in which they can be written.
fn changes(goal: &Passport, before: &Passport) -> Vec<Change> {
    let differences = compare(before, goal);
    let mut changes: Vec<Change> = differences
        .into_iter()
        .filter(|difference| difference.subject == Subject::Setting && difference.is.is_some())
        // Nobody looks at these without scaling.
        .filter(|difference| !goal.is_unscaled() || !SCALE.contains(&difference.name.as_str()))
        .map(|Difference { name, was, is, .. }| Change {
            clears_offset: GEOMETRY.contains(&name.as_str()),
            name,
            from: was,
            to: is,
        })
        .collect();
    let order = order(goal, before);
    changes.sort_by_key(|change| order.iter().position(|name| *name == change.name));
    // Writing the steps per turn sets the total resolution, which then has to be written again.
    let at = changes.iter().position(|change| change.name == STEPS_PER_TURN);
    let follows =
        goal.bus == Bus::DeviceNet && changes.iter().all(|change| change.name != TOTAL_RESOLUTION);
    if let (Some(at), true, Some(total)) = (at, follows, goal.setting(TOTAL_RESOLUTION)) {
        let from = before.setting(TOTAL_RESOLUTION).cloned();
        let to = Some(total.clone());
        let name = TOTAL_RESOLUTION.to_owned();
        changes.insert(at + 1, Change { name, from, to, clears_offset: true });
    }
    // On the way the total resolution may be as small as the steps per turn, which pulls a greater
    // delta down for good.
    let delta = goal.number(COS_DELTA).filter(|delta| Some(*delta) > goal.number(STEPS_PER_TURN));
    if let (Some(_), Some(delta)) = (at, delta)
        && changes.iter().all(|change| change.name != COS_DELTA)
    {
        let from = before.setting(COS_DELTA).cloned();
        let to = Some(Reading::Number(delta));
        changes.push(Change { name: COS_DELTA.to_owned(), from, to, clears_offset: false });
    }
    changes
}

/// The names of all settings of `goal`: what others depend on first.
fn order<'a>(goal: &'a Passport, before: &Passport) -> Vec<&'a str> {
    let first = match goal.bus {
        Bus::DeviceNet => GEOMETRY.to_vec(),
        Bus::Profibus => {
            // Each write is a parameterization, which is judged whole: T must never exceed n × M. And
            // without class 2 and scaling neither is in force, nor read back.
            let total = goal.number(TOTAL_RESOLUTION).unwrap_or_default();
            // In class 1 it counts with the whole disc.
            let disc = before.nameplate.singleturn_resolution.map(i64::from);
            let steps = before.number(STEPS_PER_TURN).or(disc).unwrap_or_default();
            let turns = i64::from(before.nameplate.revolutions.unwrap_or(1));
            let mut scale = SCALE;
            if total <= steps.saturating_mul(turns) {
                scale.reverse();
            }
            [&["direction", "class-2", "scaling"], &scale[..]].concat()
        }
    };
    let names = || goal.settings.iter().map(|setting| setting.name.as_str());
    let of_first = first.iter().filter_map(|first| names().find(|name| name == first));
    of_first.chain(names().filter(|name| !first.contains(name))).collect()
}

fn positioning(
    goal: &Passport,
    before: &Passport,
    changes: &[Change],
    told: Option<u32>,
    session: &dyn Session,
    warnings: &mut Vec<String>,
) -> Result<Positioning, Trouble> {
    let total = goal.total_in_force().or_else(|| before.total_in_force());
    let clears = changes.iter().any(|change| change.clears_offset || change.name == "scaling");
    let stands_there = |position: u32| {
        if let Some(total) = total.filter(|total| position >= *total) {
            return Err(Trouble::new(
                Kind::Usage,
                fit::tried(session),
                format!("no machine stands at {position}: the measuring range is {total} steps"),
                format!("give a position of 0 to {}", total.saturating_sub(1)),
            ));
        }
        if !clears
            && before.position.at_rest == Some(true)
            && before.position.steps == Some(position)
        {
            return Ok(Positioning::Nothing);
        }
        must_stand(before, session)?;
        if goal.number("class-2") == Some(0) {
            return Err(fit::refused(
                session,
                format!("with class 2 off it takes no preset, and it is not at {position}"),
                "turn class 2 on in the project of the master, or turn its shaft to that position \
                 before it is mounted"
                    .to_owned(),
            ));
        }
        Ok(Positioning::Preset { position })
    };
    if let Some(position) = told {
        return stands_there(position);
    }
    let is_same_unit = goal.nameplate.is_same_unit(&before.nameplate);
    let keeps = |offset| {
        let now = before.position.offset;
        !clears && now.is_some_and(|now| same_offset(goal, now, offset))
    };
    match (is_same_unit, goal.position.offset) {
        (Some(true), Some(offset)) => {
            if keeps(offset) {
                return Ok(Positioning::Nothing);
            }
            must_stand(before, session)?;
            fit::warn_of_turns(goal, before, warnings);
            return Ok(Positioning::Offset { offset });
        }
        // Two encoders have the same offset, other than none, by no chance worth counting on.
        (None, Some(offset)) if offset != 0 && keeps(offset) => {
            return Ok(Positioning::Nothing);
        }
        _ => {}
    }
    let Some(stood) = goal.position.steps else {
        warnings.push(
            "the passport does not know where the machine stood, so the positions stay as they are; \
             say where it stands to have them set"
                .to_owned(),
        );
        return Ok(Positioning::Unknown);
    };
    if goal.position.at_rest == Some(false) {
        return Err(fit::refused(
            session,
            "the shaft turned when the passport was taken, so nobody knows where the machine stood"
                .to_owned(),
            "say where the machine stands now".to_owned(),
        ));
    }
    let found = stands_there(stood)?;
    if let Positioning::Preset { position } = found {
        let when = goal.taken;
        warnings.push(match goal.source {
            Source::Device => format!(
                "the machine must stand where it stood at the backup of {when}: at {position}"
            ),
            Source::Capture => format!(
                "the machine must stand where it stood at the end of the capture, {when}: at {position}"
            ),
        });
        if goal.position.at_rest.is_none() {
            warnings.push("whether the shaft was at rest then is not known".to_owned());
        }
        if is_same_unit.is_none() {
            let near =
                before.position.steps.zip(total).is_some_and(|(now, total)| {
                    !clears && distance(now, position, Some(total)) <= 1
                });
            if near {
                return Ok(Positioning::Nothing);
            }
            warnings.push(
                "nothing tells whether this is the encoder of the passport; if it is, and the machine \
                 has moved, say where it stands"
                    .to_owned(),
            );
        }
    }
    Ok(found)
}

fn must_stand(before: &Passport, session: &dyn Session) -> Result<(), Trouble> {
    if before.position.at_rest != Some(false) {
        return Ok(());
    }
    Err(fit::refused(
        session,
        "its shaft turns, and a preset is for a machine that stands".to_owned(),
        "stop the machine and try again".to_owned(),
    ))
}

impl Plan {
    /// What is written, in this order.
    #[must_use]
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// How the positions become those of the passport; it comes last.
    #[must_use]
    pub const fn positioning(&self) -> Positioning {
        self.positioning
    }

    /// What people should know before they say yes.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Whether nothing has to be done.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty()
            && matches!(self.positioning, Positioning::Nothing | Positioning::Unknown)
    }

    /// The encoder as it was before: apply this passport to go back. Keep it on file before the plan
    /// is carried out.
    #[must_use]
    pub const fn undo(&self) -> &Passport {
        &self.before
    }

    /// What the project of the master must say afterwards; empty on DeviceNet, where the encoder keeps
    /// everything.
    #[must_use]
    pub fn project(&self) -> Project {
        match self.goal.bus {
            Bus::DeviceNet => Project::default(),
            Bus::Profibus => self.goal.project.clone(),
        }
    }
}

impl fmt::Display for Plan {
    /// A line for each thing to be done, then the warnings.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            writeln!(f, "nothing to do")?;
        }
        for change in &self.changes {
            writeln!(f, "{change}")?;
        }
        let was = self.before.position.offset.unwrap_or_default();
        match self.positioning {
            Positioning::Offset { offset } => writeln!(f, "offset: {was} → {offset}")?,
            Positioning::Preset { position } => {
                let now =
                    self.before.position.steps.map_or(String::new(), |now| format!("{now} → "));
                writeln!(f, "preset: {now}{position}")?;
            }
            Positioning::Nothing | Positioning::Unknown => {}
        }
        self.warnings.iter().try_for_each(|warning| writeln!(f, "note: {warning}"))
    }
}
