//! Carrying a plan out.

use codewheel_device::product::Bus;

use super::compare::{compare, same_offset, told};
use super::measure::{self, distance, preset_for};
use super::take::{self, TOTAL_RESOLUTION, find};
use super::{
    Change, Circumstances, Difference, Passport, Plan, Positioning, Report, Step, Subject, Verdict,
};
use crate::{Kind, Name, Progress, Reading, Session, Trouble};

/// A shaft that stands on an edge gives now this step, now that; after so many presets it turns.
const ATTEMPTS: usize = 5;

/// A plan on its way.
struct Course<'a> {
    plan: &'a Plan,
    session: &'a mut dyn Session,
    progress: &'a mut dyn FnMut(Progress),
    steps: Vec<Step>,
    remarks: Vec<String>,
}

impl Plan {
    /// Does what the plan says: writes the settings, saves them, makes the preset, saves it, and reads
    /// everything back. `progress` hears what is being done.
    ///
    /// It gives a report whatever happens: what it names as a step has been done. Keep
    /// [`undo`](Plan::undo) on file before.
    pub fn carry_out(
        &self,
        session: &mut dyn Session,
        circumstances: &Circumstances,
        progress: &mut dyn FnMut(Progress),
    ) -> Report {
        let mut course =
            Course { plan: self, session, progress, steps: Vec::new(), remarks: Vec::new() };
        let (verdict, after) = match course.run(circumstances) {
            Ok((verdict, after)) => (verdict, Some(after)),
            Err(trouble) => {
                course.stopped();
                (Verdict::Stopped(trouble), None)
            }
        };
        let Course { steps, mut remarks, .. } = course;
        if self.goal.bus == Bus::Profibus {
            remarks.push(
                "the parameters last as long as this session, and a preset only counts under the \
                 parameters it was made with: they must stand in the project of the master"
                    .to_owned(),
            );
        }
        Report { steps, verdict, after, remarks, project: self.project() }
    }
}

impl Course<'_> {
    fn run(&mut self, circumstances: &Circumstances) -> Result<(Verdict, Passport), Trouble> {
        let changes = &self.plan.changes;
        // Each of them, the preset, and reading back.
        let all = changes.len() + 2;
        for (place, change) in changes.iter().enumerate() {
            self.tell(&format!("writing {}", change.name), place, all);
            self.write(change)?;
        }
        if !changes.is_empty() {
            self.save()?;
        }
        self.tell("setting the position", changes.len(), all);
        match self.plan.positioning {
            Positioning::Offset { offset } => {
                self.restore_offset(offset)?;
                self.save()?;
            }
            Positioning::Preset { position } => {
                self.preset(position)?;
                self.save()?;
            }
            Positioning::Nothing | Positioning::Unknown => {}
        }
        self.tell("reading back", changes.len() + 1, all);
        let after = take::take(self.session, circumstances)?;
        let verdict = self.judge(&after);
        self.tell("done", all, all);
        Ok((verdict, after))
    }

    fn tell(&mut self, doing: &str, done: usize, all: usize) {
        let percent = (done * 100).checked_div(all).and_then(|percent| u8::try_from(percent).ok());
        let percent = percent.unwrap_or(100);
        (self.progress)(Progress { doing: doing.to_owned(), percent });
    }

    fn tried(&self, what: &str) -> String {
        format!("{what} of the encoder at address {}", self.session.address())
    }

    fn step(&mut self, name: &str, was: Option<Reading>, is: Option<Reading>) {
        self.steps.push(Step { name: name.to_owned(), was, is });
    }

    fn write(&mut self, change: &Change) -> Result<(), Trouble> {
        let Some(wanted) = &change.to else { return Ok(()) };
        let name = name(&change.name);
        let is = self.session.write(&name, wanted)?.reading;
        let came_true = is == *wanted;
        self.step(&change.name, change.from.clone(), Some(is.clone()));
        if came_true {
            return Ok(());
        }
        Err(Trouble::new(
            Kind::Differs,
            self.tried(&format!("write {}", change.name)),
            format!("{} was written, and {} read back", told(Some(wanted)), told(Some(&is))),
            "ask for its range, and whether another master writes to it",
        ))
    }

    /// PROFIBUS knows no Save: a preset is kept at once, parameters never.
    fn save(&mut self) -> Result<(), Trouble> {
        if self.session.bus() == Bus::Profibus {
            return Ok(());
        }
        self.session.save()?;
        self.step("save", None, None);
        Ok(())
    }

    /// The measuring range in force.
    fn total(&mut self) -> Result<u32, Trouble> {
        if let Some(total) = self.plan.goal.total_in_force() {
            return Ok(total);
        }
        let value = self.session.value(&Name::Key(TOTAL_RESOLUTION.to_owned()))?;
        let total = match find(&[value], TOTAL_RESOLUTION).map(|value| &value.reading) {
            Some(Reading::Number(total)) => u32::try_from(*total).ok(),
            _ => None,
        };
        total.ok_or_else(|| {
            Trouble::new(
                Kind::Refused,
                self.tried("set the position"),
                "it does not tell its measuring range",
                "write the preset by hand",
            )
        })
    }

    /// Watches the shaft: a preset is for a machine that stands.
    fn at_rest(&mut self, total: u32) -> Result<u32, Trouble> {
        let watched = measure::watch(self.session, self.plan.watch, Some(total))?;
        if watched.at_rest {
            return Ok(watched.position);
        }
        Err(Trouble::new(
            Kind::Refused,
            self.tried("set the position"),
            "its shaft turns, and a preset is for a machine that stands",
            "stop the machine and apply the passport again",
        ))
    }

    fn restore_offset(&mut self, wanted: i64) -> Result<(), Trouble> {
        let total = self.total()?;
        self.at_rest(total)?;
        let was = take::offset(self.session)?;
        let mut now = was;
        for _ in 0..ATTEMPTS {
            let position = self.session.sample()?.position;
            let preset = preset_for(wanted, position, now, total);
            self.session.preset(preset)?;
            now = take::offset(self.session)?;
            if same_offset(&self.plan.goal, now, wanted) {
                self.step("offset", Some(Reading::Number(was)), Some(Reading::Number(now)));
                return Ok(());
            }
        }
        self.step("offset", Some(Reading::Number(was)), Some(Reading::Number(now)));
        Err(Trouble::new(
            Kind::Differs,
            self.tried("restore the offset"),
            format!("the offset became {now}, not {wanted}: the shaft moves"),
            "stop the machine and apply the passport again",
        ))
    }

    fn preset(&mut self, wanted: u32) -> Result<(), Trouble> {
        let total = self.total()?;
        let was = self.at_rest(total)?;
        let is = self.session.preset(wanted)?.position;
        self.step("position", Some(Reading::Number(was.into())), Some(Reading::Number(is.into())));
        if distance(is, wanted, Some(total)) <= 1 {
            return Ok(());
        }
        Err(Trouble::new(
            Kind::Differs,
            self.tried("set the position"),
            format!("after a preset of {wanted} it is at {is}"),
            "see that the machine stands and apply the passport again",
        ))
    }

    /// What was read back against the passport.
    fn judge(&mut self, after: &Passport) -> Verdict {
        let goal = &self.plan.goal;
        let mut differences: Vec<Difference> = compare(goal, after)
            .into_iter()
            .filter(|difference| difference.subject == Subject::Setting && difference.was.is_some())
            .collect();
        let position = |steps: Option<u32>| steps.map(|steps| Reading::Number(steps.into()));
        match self.plan.positioning {
            Positioning::Offset { offset } => {
                let now = after.position.offset;
                if !now.is_some_and(|now| same_offset(goal, now, offset)) {
                    differences.push(Difference {
                        subject: Subject::Offset,
                        name: "offset".to_owned(),
                        was: Some(Reading::Number(offset)),
                        is: now.map(Reading::Number),
                    });
                }
            }
            Positioning::Preset { position: wanted } if after.position.at_rest == Some(true) => {
                let total = after.total_in_force();
                let near = |now| distance(now, wanted, total) <= 1;
                if !after.position.steps.is_some_and(near) {
                    differences.push(Difference {
                        subject: Subject::Offset,
                        name: "position".to_owned(),
                        was: position(Some(wanted)),
                        is: position(after.position.steps),
                    });
                }
            }
            Positioning::Preset { .. } => self.remarks.push(
                "the shaft began to turn after the preset, so the position could not be verified"
                    .to_owned(),
            ),
            Positioning::Nothing | Positioning::Unknown => {}
        }
        if differences.is_empty() { Verdict::Done } else { Verdict::Differs(differences) }
    }

    /// What people can do who have half of it.
    fn stopped(&mut self) {
        if self.steps.is_empty() {
            return self.remarks.push("nothing has been written".to_owned());
        }
        self.remarks.push(
            "what stands above has been written, the rest not; apply the passport again to go on, or \
             the one of before to go back"
                .to_owned(),
        );
        let saved = self.steps.iter().any(|step| step.name == "save");
        if self.session.bus() == Bus::DeviceNet && !saved {
            self.remarks.push("nothing has been saved: a power cycle undoes it".to_owned());
        }
    }
}

/// A name as the passport has it.
fn name(text: &str) -> Name {
    let path = |text: &str| {
        let mut parts = text.split('/').map(|part| u8::from_str_radix(part, 16).ok());
        match (parts.next()??, parts.next()??, parts.next()??, parts.next()) {
            (class, instance, attribute, None) => Some(Name::Path { class, instance, attribute }),
            _ => None,
        }
    };
    let parameter = || text.strip_prefix("parameter/")?.parse().ok().map(Name::Parameter);
    let octet = || text.strip_prefix("octet/")?.parse().ok().map(Name::Octet);
    path(text).or_else(parameter).or_else(octet).unwrap_or_else(|| Name::Key(text.to_owned()))
}
