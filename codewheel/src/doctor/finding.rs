//! What the doctor found, and what to do about it.

use std::fmt;
use std::process::ExitCode;
use std::time::Duration;

use serde::Serialize;
use serde_json::Value;

/// How things stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum State {
    /// As it should be.
    Fine,
    /// It works, and not as well as it could.
    Finding,
    /// It does not work.
    Cannot,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Finding {
    pub(super) about: &'static str,
    pub(super) state: State,
    pub(super) says: String,
    /// What to do; there is none where all is well.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) remedy: Option<String>,
    /// The numbers behind it.
    #[serde(skip_serializing_if = "Value::is_null")]
    pub(super) values: Value,
    /// Lines below it for people; programs have the numbers.
    #[serde(skip)]
    pub(super) lines: Vec<String>,
}

impl State {
    /// 0, 1 or 3.
    pub(super) fn exit_code(self) -> ExitCode {
        ExitCode::from(match self {
            Self::Fine => 0,
            Self::Finding => 1,
            Self::Cannot => 3,
        })
    }
}

impl Finding {
    fn new(about: &'static str, state: State, says: String) -> Self {
        Self { about, state, says, remedy: None, values: Value::Null, lines: Vec::new() }
    }

    pub(super) fn fine(about: &'static str, says: impl Into<String>) -> Self {
        Self::new(about, State::Fine, says.into())
    }

    pub(super) fn trouble(about: &'static str, says: impl Into<String>) -> Self {
        Self::new(about, State::Finding, says.into())
    }

    pub(super) fn cannot(about: &'static str, says: impl Into<String>) -> Self {
        Self::new(about, State::Cannot, says.into())
    }

    pub(super) fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    pub(super) fn values(mut self, values: Value) -> Self {
        self.values = values;
        self
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match self.state {
            State::Fine => "fine",
            State::Finding => "finding",
            State::Cannot => "cannot",
        };
        writeln!(f, "{state:<9}{:<16}{}", self.about, self.says)?;
        for line in &self.lines {
            writeln!(f, "{:25}{line}", "")?;
        }
        if let Some(remedy) = &self.remedy {
            writeln!(f, "{:25}→ {remedy}", "")?;
        }
        Ok(())
    }
}

/// `0.041 ms`.
pub(super) fn milliseconds(time: Duration) -> String {
    format!("{:.3} ms", time.as_secs_f64() * 1e3)
}

/// Times that were measured, in short.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    pub(super) median: Duration,
    /// 99 of 100 are at most this long.
    pub(super) most: Duration,
    pub(super) longest: Duration,
    pub(super) count: usize,
}

impl Times {
    /// `None` of nothing.
    pub(super) fn of(mut times: Vec<Duration>) -> Option<Self> {
        times.sort_unstable();
        let at = |percent: usize| times.get(times.len() * percent / 100).copied();
        Some(Self { median: at(50)?, most: at(99)?, longest: *times.last()?, count: times.len() })
    }

    pub(super) fn values(&self) -> Value {
        serde_json::json!({
            "count": self.count,
            "median_us": self.median.as_nanos() as f64 / 1e3,
            "p99_us": self.most.as_nanos() as f64 / 1e3,
            "max_us": self.longest.as_nanos() as f64 / 1e3,
        })
    }
}

impl fmt::Display for Times {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [median, most, longest] = [self.median, self.most, self.longest].map(milliseconds);
        write!(f, "median {median}, 99 of 100 within {most}, at most {longest}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_tells_people_what_to_do_and_programs_the_numbers() {
        let mut finding = Finding::trouble("timer", "late").remedy("hurry");
        finding.lines.push("a line".to_owned());
        let finding = finding.values(serde_json::json!({ "late": 1 }));
        let text: Vec<_> = finding.to_string().lines().map(str::to_owned).collect();
        let margin = " ".repeat(25);
        assert_eq!(
            text,
            [
                "finding  timer           late".to_owned(),
                format!("{margin}a line"),
                format!("{margin}→ hurry"),
            ]
        );
        assert_eq!(
            serde_json::to_string(&finding).unwrap(),
            "{\"about\":\"timer\",\"state\":\"finding\",\"says\":\"late\",\"remedy\":\"hurry\",\
             \"values\":{\"late\":1}}"
        );
    }

    #[test]
    fn what_cannot_be_used_is_worse_than_a_finding() {
        assert!(State::Cannot > State::Finding && State::Finding > State::Fine);
    }

    #[test]
    fn times_are_told_by_their_middle_their_hundredth_and_their_end() {
        let times = Times::of((1..=200).map(Duration::from_micros).collect()).unwrap();
        assert_eq!(
            times.to_string(),
            "median 0.101 ms, 99 of 100 within 0.199 ms, at most 0.200 ms"
        );
        assert!(Times::of(Vec::new()).is_none());
    }
}
