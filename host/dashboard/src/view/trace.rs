//! What a bus carries.

use codewheel_plant::{TraceLine, Traced};
use serde::Serialize;
use utoipa::ToSchema;

/// What a bus has carried since the trace before.
#[derive(Serialize, ToSchema)]
pub(crate) struct TraceDocument {
    lines: Vec<LineDocument>,
    /// How many lines came before these and are lost, because the bus was faster than the stream.
    lost: u64,
}

/// A frame or telegram, and what it says.
#[derive(Serialize, ToSchema)]
struct LineDocument {
    /// Seconds since the start, when it ended.
    at: f64,
    /// The address of who sent it.
    from: Option<String>,
    /// The address of whom it is for.
    to: Option<String>,
    /// What kind of message it is: `poll response`.
    name: String,
    /// What it says.
    text: String,
    /// The identifier of a CAN frame; empty for a telegram.
    identifier: String,
    /// Its octets: `39 30 00 00`.
    octets: String,
}

impl From<Traced> for TraceDocument {
    fn from(traced: Traced) -> Self {
        let lines = traced.lines.into_iter().map(LineDocument::from).collect();
        Self { lines, lost: traced.lost }
    }
}

impl From<TraceLine> for LineDocument {
    fn from(line: TraceLine) -> Self {
        Self {
            at: super::rounded(line.at.as_nanos() as f64 / 1e9, 6),
            from: line.from.map(|address| address.to_string()),
            to: line.to.map(|address| address.to_string()),
            name: line.name,
            text: line.text,
            identifier: line.identifier,
            octets: line.octets,
        }
    }
}
