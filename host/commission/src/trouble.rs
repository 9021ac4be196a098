//! Why something could not be done, as a person needs to hear it.

use std::fmt;

use codewheel_link::LinkError;
use thiserror::Error;

/// What kind of trouble it is: programs decide by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// It was done, and what was read back is not what was written; or two things differ that
    /// should be the same.
    Differs,
    /// It was asked for wrongly: no such name, a value that cannot be.
    Usage,
    /// The bus cannot be used: it is lost, silent, at another rate, or belongs to others.
    Bus,
    /// The device, or the bus it is on, refuses.
    Refused,
    /// Nothing came back in time.
    TimeOut,
}

/// Why something could not be done: what was tried, what came back, what to do.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct Trouble {
    /// What kind it is.
    pub kind: Kind,
    /// What was tried: `write steps-per-turn of the encoder at address 5`.
    pub tried: String,
    /// What came back: `it answers 09 (invalid attribute value)`.
    pub came: String,
    /// What to do: `it takes 1 to 8192`; empty where nobody knows.
    pub remedy: String,
}

impl Trouble {
    /// Trouble of a kind: what was tried, what came back, what to do.
    #[must_use]
    pub fn new(
        kind: Kind,
        tried: impl Into<String>,
        came: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { kind, tried: tried.into(), came: came.into(), remedy: remedy.into() }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tried, came, remedy, .. } = self;
        write!(f, "cannot {tried}: {came}")?;
        if remedy.is_empty() { Ok(()) } else { write!(f, "; {remedy}") }
    }
}

impl From<LinkError> for Trouble {
    fn from(error: LinkError) -> Self {
        Self::new(Kind::Bus, "use the bus", error.to_string(), "")
    }
}
