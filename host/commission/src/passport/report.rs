//! What has come of a plan.

use std::fmt;

use serde::Serialize;

use super::compare::{optional, told};
use super::{Difference, Passport, Project};
use crate::{Kind, Reading, Trouble};

/// One thing that was done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Step {
    /// What: the name of a setting, `preset`, `save`.
    pub name: String,
    /// What it was; `None` where nothing can be said.
    #[serde(serialize_with = "optional")]
    pub was: Option<Reading>,
    /// What it is, read back.
    #[serde(serialize_with = "optional")]
    pub is: Option<Reading>,
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.was, &self.is) {
            (None, None) => f.write_str(&self.name),
            (was, is) => {
                write!(f, "{}: {} → {}", self.name, told(was.as_ref()), told(is.as_ref()))
            }
        }
    }
}

/// How it ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// All was read back, and is as the passport says.
    Done,
    /// All was written, and something read back is otherwise.
    Differs(Vec<Difference>),
    /// It stopped midway.
    Stopped(Trouble),
}

/// What was done to an encoder, and whether it is now as the passport says.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// What was done, in this order; what is here has happened.
    pub steps: Vec<Step>,
    /// How it ended.
    pub verdict: Verdict,
    /// The encoder as it is now; `None` where it could not be read.
    pub after: Option<Passport>,
    /// What people should know.
    pub remarks: Vec<String>,
    /// What the project of the master must say, or all is lost with this session; empty on DeviceNet.
    pub project: Project,
}

impl Report {
    /// What kind of trouble it met with; `None` where all is well.
    #[must_use]
    pub fn kind(&self) -> Option<Kind> {
        match &self.verdict {
            Verdict::Done => None,
            Verdict::Differs(_) => Some(Kind::Differs),
            Verdict::Stopped(trouble) => Some(trouble.kind),
        }
    }
}

impl fmt::Display for Report {
    /// A line for each step, the verdict, and what to do.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.steps.iter().try_for_each(|step| writeln!(f, "{step}"))?;
        match &self.verdict {
            Verdict::Done => writeln!(f, "the encoder is as the passport says")?,
            Verdict::Differs(differences) => {
                for difference in differences {
                    writeln!(f, "differs: {difference}")?;
                }
            }
            Verdict::Stopped(trouble) => writeln!(f, "{trouble}")?,
        }
        self.remarks.iter().try_for_each(|remark| writeln!(f, "note: {remark}"))?;
        if !self.project.is_empty() {
            writeln!(f, "the project of the master must say:")?;
            write!(f, "{}", self.project)?;
        }
        Ok(())
    }
}
